#include "program.hpp"

using calot_test::Result;
class List : public calot_test::ProgramTest {};

TEST_F(List, shows_models_by_kind_and_succeeds) {
    const Result all = calot({"list"});
    EXPECT_EQ(all.exit_code, 0) << all.err;
    EXPECT_NE(all.out.find("org.calot.test.tissue"), std::string::npos) << all.out;
    const Result rods = calot({"list", "rod"});
    EXPECT_NE(rods.out.find("org.calot.test.rod "), std::string::npos) << rods.out;
    EXPECT_EQ(rods.out.find("org.calot.test.tissue"), std::string::npos) << rods.out;
}

TEST_F(List, shows_what_is_refused_with_the_reason) {
    environment["CALOT_PLUGIN_PATH"] = plugins("bad/test-bad-abort").string();
    const Result list = calot({"list"});
    EXPECT_EQ(list.exit_code, 0) << list.err;
    EXPECT_NE(list.out.find("org.calot.test.bad-abort: "), std::string::npos) << list.out;
    EXPECT_NE(list.out.find("crashes while it is loaded"), std::string::npos) << list.out;
    const Result why = calot({"why", "org.calot.test.bad-abort"});
    EXPECT_EQ(why.exit_code, 0) << why.err;
    for (const char* part :
         {"can't be used", "crashes while it is loaded", "lib/calot/plugins (beside the program)"})
        EXPECT_NE(why.out.find(part), std::string::npos) << "lacks " << part << ": " << why.out;
}

TEST_F(List, of_an_unknown_kind_or_subcommand_is_bad_input_in_one_line) {
    for (const std::vector<std::string>& words :
         {std::vector<std::string>{"list", "rope"}, {"lsit"}, {"run"}}) {
        const Result result = calot(words);
        EXPECT_EQ(result.exit_code, 2) << words[0];
        EXPECT_EQ(result.messages().size(), 1u) << result.err;
    }
}

TEST_F(List, why_says_where_it_looked_for_what_is_not_there) {
    environment["CALOT_PLUGIN_PATH"] = "/nowhere";
    const Result why = calot({"why", "org.example.none"});
    EXPECT_EQ(why.exit_code, 0) << why.err;
    EXPECT_NE(why.out.find("/nowhere (CALOT_PLUGIN_PATH): no such folder"), std::string::npos) << why.out;
}

TEST_F(List, help_ends_well_and_teaches_by_examples) {
    for (const char* command : {"list", "why", "run", "replay"}) {
        const Result help = calot({command, "--help"});
        EXPECT_EQ(help.exit_code, 0) << command;
        EXPECT_NE(help.out.find("Examples:"), std::string::npos) << help.out;
    }
}

#include "fitting/bench_table.hpp"
#include "host/error.hpp"

#include <gtest/gtest.h>

#include <string>

namespace calot::fitting {

namespace {

std::string refusal(const std::string& text) {
    try {
        parse_bench_table(text, "bench.csv");
    } catch (const host::UserError& error) {
        return error.what();
    }
    return "nothing was refused";
}

const std::string head = "test,segment,span,deflection,force,length,angle,torque,time,amplitude\n";

} // namespace

TEST(BenchTable, is_read_in_any_order_of_columns_with_comments_and_blanks) {
    const auto readings =
        parse_bench_table("\xef\xbb\xbf# made today\r\n force , test,segment,span,deflection\r\n\r\n"
                          "0.5, bend, shaft, 0.2, 0.003\r\n# and\n1e0,bend,shaft,0.2,-6e-3",
                          "bench.csv");
    ASSERT_EQ(readings.size(), 2u);
    EXPECT_EQ(readings[0].line, 4);
    EXPECT_EQ(readings[0].segment, "shaft");
    EXPECT_DOUBLE_EQ(readings[0].size, 0.2);
    EXPECT_DOUBLE_EQ(readings[0].x, 0.003);
    EXPECT_DOUBLE_EQ(readings[0].load, 0.5);
    EXPECT_EQ(readings[1].line, 6);
    EXPECT_DOUBLE_EQ(readings[1].x, -0.006);
}

TEST(BenchTable, each_test_takes_its_own_columns) {
    const auto readings =
        parse_bench_table(head + "bend,shaft,0.2,0.003,0.5,,,,,\ntwist,shaft,,,,0.5,0.3,0.2,,\n"
                                 "vibration,shaft,,,,,,,0.25,3\n",
                          "bench.csv");
    ASSERT_EQ(readings.size(), 3u);
    EXPECT_EQ(readings[1].test, BenchTest::twist);
    EXPECT_DOUBLE_EQ(readings[1].size, 0.5);
    EXPECT_DOUBLE_EQ(readings[1].load, 0.2);
    EXPECT_EQ(readings[2].test, BenchTest::vibration);
    EXPECT_DOUBLE_EQ(readings[2].x, 0.25);
}

TEST(BenchTable, what_is_wrong_is_named_by_line_and_column) {
    EXPECT_EQ(refusal(head + "bend,shaft,0.2,0.003,0.5,,,,,\nbend,shaft,0.2,abc,0.5,,,,,\n"),
              "bench.csv: line 3: deflection: is \"abc\"; give a number with a decimal point, in SI units");
    EXPECT_EQ(refusal(head + "bend,shaft,200,0.003,0.5,,,,,\n"),
              "bench.csv: line 2: span: is 200; it must lie between 0.01 and 5 (SI units)");
    EXPECT_EQ(refusal(head + "twist,shaft,,,,0.5,,0.2,,\n"),
              "bench.csv: line 2: angle: is empty; give a number with a decimal point, in SI units");
    EXPECT_TRUE(
        refusal(head + "bend,shaft,0.2,nan,0.5,,,,,\n").starts_with("bench.csv: line 2: deflection: is"));
    EXPECT_EQ(refusal(head + "press,shaft,,,,,,,,\n"),
              "bench.csv: line 2: test: is \"press\"; use bend, twist or vibration");
    EXPECT_EQ(refusal(head + "bend,Shaft 1,0.2,0.003,0.5,,,,,\n").substr(0, 28),
              "bench.csv: line 2: segment: ");
    EXPECT_EQ(refusal(head + "bend,shaft,0.2\n"),
              "bench.csv: line 2: has 3 columns, the first line 10; correct it");
    EXPECT_EQ(refusal("test,segment,colour\n").substr(0, 27), "bench.csv: line 1: \"colour\"");
    EXPECT_EQ(refusal("test,test,segment\n"), "bench.csv: line 1: \"test\": stands twice; remove one");
    EXPECT_EQ(refusal("test,segment,span,deflection\nbend,shaft,0.2,0.003\n"),
              "bench.csv: line 2: force: is missing among the columns, and this row's test needs it; add it");
    EXPECT_EQ(refusal(head), "bench.csv: line 1: no row follows the columns' names; add what was measured");
    EXPECT_NE(refusal(""), "nothing was refused");
    EXPECT_NE(refusal(head + "bend,shaft,0.2,0,003,0.5,,,,,\n").find("line 2: has 11 columns"),
              std::string::npos)
        << "a decimal comma gives another column";
}

TEST(BenchTable, a_figure_that_its_test_has_no_use_for_is_refused) {
    EXPECT_EQ(refusal(head + "bend,shaft,0.2,0.003,0.5,0.4,,,,\n"),
              "bench.csv: line 2: length: is filled, but bend has no use for it; leave it empty");
}

TEST(BenchTable, hostile_files_are_refused_in_one_line) {
    std::string many = head;
    for (int k = 0; k < 20'001; ++k)
        many += "bend,shaft,0.2,0.003,0.5,,,,,\n";
    EXPECT_EQ(refusal(many), "bench.csv: line 20002: is one more than 20000 rows; leave some out");
    EXPECT_NE(refusal(std::string(100'000, ',')).find("more than 32 columns"), std::string::npos);
    EXPECT_NE(refusal(head + std::string(1000, 'x')).find("more than 64 bytes"), std::string::npos);
    const std::string control = refusal(head + "bend,shaft,0.2,\x1b[2J,0.5,,,,,\n");
    EXPECT_EQ(control.find('\x1b'), std::string::npos) << "nothing reaches the terminal as it was";
    // Every cut and every flipped bit is refused in one line or read.
    const std::string good = head + "bend,shaft,0.2,0.003,0.5,,,,,\ntwist,shaft,,,,0.5,0.3,0.2,,\n";
    int refused = 0;
    for (std::size_t at = 0; at < good.size(); ++at)
        for (int bit = 0; bit < 8; ++bit) {
            std::string flipped = good;
            flipped[at] = static_cast<char>(flipped[at] ^ (1 << bit));
            const std::string line = refusal(flipped);
            EXPECT_EQ(line.find('\n'), std::string::npos) << line;
            refused += line != "nothing was refused";
        }
    EXPECT_GT(refused, 500);
}

} // namespace calot::fitting

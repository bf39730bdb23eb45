// Reads the contract's headers as text: the fingerprint must be theirs, and every function must say on which
// thread it is called and whether it is real-time.
#include <calot/abi/plugin.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <string>
#include <vector>

namespace {

std::vector<std::filesystem::path> headers() {
    std::vector<std::filesystem::path> found;
    for (const auto& entry : std::filesystem::directory_iterator(CALOT_SOURCE_DIR "/sdk/include/calot/abi"))
        if (entry.path().extension() == ".h") found.push_back(entry.path());
    std::sort(found.begin(), found.end());
    return found;
}

std::string text_of(const std::filesystem::path& path) {
    std::ifstream file(path);
    return {std::istreambuf_iterator<char>(file), {}};
}

// Words and numbers, string literals, and every other character alone; comments and spaces left out.
std::vector<std::string> tokens_of(const std::string& text) {
    std::vector<std::string> tokens;
    const auto is_word = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_'; };
    for (std::size_t i = 0; i < text.size();) {
        std::size_t end = i + 1;
        if (text.compare(i, 2, "/*") == 0) {
            i = text.find("*/", i) + 2;
            continue;
        }
        if (std::isspace(static_cast<unsigned char>(text[i]))) {
            ++i;
            continue;
        }
        if (text[i] == '"')
            end = text.find('"', i + 1) + 1;
        else if (is_word(text[i]))
            while (end < text.size() && is_word(text[end]))
                ++end;
        tokens.push_back(text.substr(i, end - i));
        i = end;
    }
    return tokens;
}

std::uint64_t fingerprint_of_headers() {
    std::uint64_t hash = 0xcbf29ce484222325ull;
    for (const auto& path : headers()) {
        const std::string text =
            std::regex_replace(text_of(path), std::regex("#define CALOT_ABI_FINGERPRINT [^\n]*\n"), "");
        for (const std::string& token : tokens_of(text))
            for (const char c : token + "\n")
                hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3ull;
    }
    return hash;
}

struct Function {
    std::string name;
    std::string comment; // the one just above it
};

// Pointer members "type (*name)(", and function typedefs likewise; pointers within an argument list don't
// count.
std::vector<Function> functions_of(const std::string& text) {
    std::vector<Function> functions;
    std::string comment;
    int depth = 0; // of parentheses
    for (std::size_t i = 0; i < text.size(); ++i) {
        if (text.compare(i, 2, "/*") == 0) {
            const std::size_t end = text.find("*/", i);
            // A comment behind a declaration belongs to it, not to what follows.
            const std::size_t line = text.rfind('\n', i);
            const bool stands_alone =
                text.find_first_not_of(" \t", line == std::string::npos ? 0 : line + 1) == i;
            if (depth == 0 && stands_alone) comment = text.substr(i, end - i);
            i = end + 1;
        } else if (text.compare(i, 2, "(*") == 0 && depth == 0) {
            const std::size_t end = text.find(')', i);
            functions.push_back({text.substr(i + 2, end - i - 2), comment});
            comment.clear();
            i = end;
        } else if (text[i] == '(') {
            ++depth;
        } else if (text[i] == ')') {
            --depth;
        }
    }
    return functions;
}

int count(const std::string& text, const std::string& what) {
    int n = 0;
    // Comments wrap: a tag may stand on a line of its own, but is never broken.
    for (std::size_t i = text.find(what); i != std::string::npos; i = text.find(what, i + 1))
        ++n;
    return n;
}

TEST(Contract, fingerprint_is_that_of_the_headers) {
    ASSERT_GE(headers().size(), 8u);
    char want[32];
    std::snprintf(want, sizeof want, "0x%016llxull",
                  static_cast<unsigned long long>(fingerprint_of_headers()));
    EXPECT_EQ(CALOT_ABI_FINGERPRINT, fingerprint_of_headers())
        << "the headers changed: in abi/common.h put\n#define CALOT_ABI_FINGERPRINT " << want
        << "\nand, if a version with the old one was released, raise CALOT_ABI_MINOR";
}

TEST(Contract, fingerprint_ignores_comments_and_layout_but_not_a_type) {
    EXPECT_EQ(tokens_of("int  a ; /* why */\n"), tokens_of("int a;"));
    EXPECT_NE(tokens_of("int a;"), tokens_of("long a;"));
}

TEST(Contract, every_function_has_one_thread_tag_and_one_real_time_tag) {
    int checked = 0;
    for (const auto& path : headers()) {
        for (const Function& f : functions_of(text_of(path))) {
            const int threads = count(f.comment, "[main]") + count(f.comment, "[simulation]") +
                                count(f.comment, "[device]") + count(f.comment, "[any]");
            const int real_time = count(f.comment, "[real-time]") + count(f.comment, "[not-real-time]");
            EXPECT_EQ(threads, 1) << path.filename() << ": " << f.name << " has " << threads
                                  << " thread tags, expected one";
            EXPECT_EQ(real_time, 1) << path.filename() << ": " << f.name << " has " << real_time
                                    << " real-time tags, expected one";
            ++checked;
        }
    }
    EXPECT_GE(checked, 60) << "the reader of the headers misses functions";
}

TEST(Contract, a_function_without_tags_is_noticed) {
    const auto functions =
        functions_of("/* Tagged. [any] [real-time] */\nvoid (*a)(int);\nint (*b)(void);\n");
    ASSERT_EQ(functions.size(), 2u);
    EXPECT_EQ(functions[0].name, "a");
    EXPECT_EQ(count(functions[0].comment, "[any]"), 1);
    EXPECT_EQ(functions[1].comment, "");
}

} // namespace

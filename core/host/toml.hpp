// The TOML parser, for files that anyone may have written.
#pragma once

// toml++ 3.3 asserts what it then reports as an error of the file: in debug builds a broken key would abort.
#define TOML_ASSERT(expr) static_cast<void>(0)
#include <toml++/toml.h>

#include <cstddef>
#include <string_view>

namespace calot::host {

/// The line of the first byte outside ASCII that stands neither in a text nor in a comment, or 0. TOML allows
/// none there, and toml++ 3.3 runs into undefined behaviour on some: look before parsing.
inline std::size_t line_of_stray_byte(std::string_view text) {
    std::size_t line = 1, i = text.substr(0, 3) == "\xEF\xBB\xBF" ? 3 : 0;
    char quote = 0; // the text that we are in, or '#'
    bool is_long = false;
    for (; i < text.size(); ++i) {
        const char c = text[i];
        line += c == '\n';
        if (quote == 0) {
            if (static_cast<unsigned char>(c) >= 0x80) return line;
            if (c != '#' && c != '"' && c != '\'') continue;
            quote = c;
            is_long = c != '#' && text.substr(i, 3) == std::string_view(c == '"' ? "\"\"\"" : "'''");
            if (is_long) i += 2;
        } else if (c == '\n' && !is_long) {
            quote = 0;
        } else if (quote == '"' && c == '\\') {
            line += i + 1 < text.size() && text[i + 1] == '\n';
            ++i;
        } else if (c == quote && c != '#') {
            if (is_long) {
                std::size_t run = 1;
                while (run < 5 && i + run < text.size() && text[i + run] == quote)
                    ++run;
                i += run - 1;
                if (run < 3) continue; // quotes within
            }
            quote = 0;
        }
    }
    return 0;
}

} // namespace calot::host

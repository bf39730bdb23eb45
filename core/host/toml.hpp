// The TOML parser, for files that anyone may have written.
#pragma once

// toml++ 3.3 asserts what it then reports as an error of the file: in debug builds a broken key would abort.
#define TOML_ASSERT(expr) static_cast<void>(0)
#include <toml++/toml.h>

#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>

namespace calot::host {

/// Something that the user can put right. what() is one line: "FILE: FIELD: what is wrong; remedy".
class UserError : public std::runtime_error {
  public:
    explicit UserError(const std::string& line) : std::runtime_error(line) {}
    /// Parts that are empty are left out.
    UserError(const std::string& file, const std::string& field, const std::string& what_and_remedy);
};

/// A call into a plugin that did not return CALOT_OK, or whose answer breaks the contract.
class PluginError : public std::runtime_error {
  public:
    PluginError(std::string plugin, std::string function, std::int32_t status, std::int32_t code,
                std::string field, std::string message);

    std::string plugin;   ///< id of the model
    std::string function; ///< "rod.step"
    std::int32_t status;  ///< CALOT_DISCARD, CALOT_ERROR or CALOT_FATAL
    std::int32_t code;    ///< CALOT_CODE_...
    std::string field;
    std::string message;
};

/// "invalid argument" for CALOT_CODE_INVALID_ARGUMENT and so on.
const char* code_name(std::int32_t code);

} // namespace calot::host

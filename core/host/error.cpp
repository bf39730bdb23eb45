#include "host/error.hpp"

#include <calot/abi/common.h>

#include <utility>

namespace calot::host {
namespace {

std::string join(std::initializer_list<const std::string*> parts) {
    std::string line;
    for (const std::string* part : parts) {
        if (part->empty()) continue;
        if (!line.empty()) line += ": ";
        line += *part;
    }
    return line;
}

} // namespace

UserError::UserError(const std::string& file, const std::string& field, const std::string& what_and_remedy)
    : std::runtime_error(join({&file, &field, &what_and_remedy})) {}

PluginError::PluginError(std::string plugin_id, std::string function_name, std::int32_t call_status,
                         std::int32_t error_code, std::string error_field, std::string error_message)
    : std::runtime_error(join({&plugin_id, &function_name, &error_field, &error_message})),
      plugin(std::move(plugin_id)), function(std::move(function_name)), status(call_status), code(error_code),
      field(std::move(error_field)), message(std::move(error_message)) {}

const char* code_name(std::int32_t code) {
    switch (code) {
    case CALOT_CODE_NONE:
        return "no code given";
    case CALOT_CODE_INVALID_ARGUMENT:
        return "invalid argument";
    case CALOT_CODE_OUT_OF_RANGE:
        return "out of range";
    case CALOT_CODE_NOT_FINITE:
        return "not finite";
    case CALOT_CODE_WRONG_STATE:
        return "wrong state";
    case CALOT_CODE_UNAVAILABLE:
        return "unavailable";
    case CALOT_CODE_MISSING_ASSET:
        return "missing asset";
    case CALOT_CODE_MISSING_SERVICE:
        return "missing service";
    case CALOT_CODE_CORRUPT_STATE:
        return "corrupt state";
    case CALOT_CODE_UNSUPPORTED:
        return "unsupported";
    case CALOT_CODE_VERSION:
        return "version";
    case CALOT_CODE_CAPACITY:
        return "capacity";
    case CALOT_CODE_INTERNAL:
        return "internal error";
    default:
        return "unknown code";
    }
}

} // namespace calot::host

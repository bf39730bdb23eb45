// One way to call a plugin's function: marked for the supervisor, checked, its error thrown.
#pragma once

#include "host/blame.hpp"
#include "host/error.hpp"
#include "simulation/plugin.hpp"

#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace calot::simulation {

inline calot_string abi_text(std::string_view text) {
    return {text.data(), text.size()};
}
inline std::string_view view(calot_string text) {
    return text.data == nullptr ? std::string_view() : std::string_view(text.data, text.size);
}

template<class Kind>
const Kind& functions(const Plugin& plugin) {
    return *static_cast<const Kind*>(plugin.instance->kind);
}

/// An extension's functions, or null where the plugin lacks it or its struct is shorter.
template<class Functions>
const Functions* extension(const Plugin& plugin, std::string_view id) {
    if (plugin.instance->extension == nullptr) return nullptr;
    const host::Call mark(plugin.id.c_str(), "extension");
    const auto* found =
        static_cast<const Functions*>(plugin.instance->extension(plugin.instance->self, abi_text(id)));
    return found != nullptr && found->struct_size >= sizeof(Functions) ? found : nullptr;
}

[[noreturn]] inline void fail(const Plugin& plugin, const char* function, calot_status status,
                              std::int32_t code, std::string field, std::string message) {
    throw host::PluginError(plugin.id, function, status, code, std::move(field), std::move(message));
}

/// function(self, arguments..., error); throws host::PluginError unless it returns CALOT_OK.
template<class F, class... Arguments>
void call(const Plugin& plugin, const char* name, F function, Arguments... arguments) {
    calot_error error;
    error.struct_size = sizeof error;
    error.code = 0;
    error.field[0] = error.message[0] = '\0';
    calot_status status;
    {
        const host::Call mark(plugin.id.c_str(), name);
        status = function(plugin.instance->self, arguments..., &error);
    }
    if (status == CALOT_OK) return;
    error.field[sizeof error.field - 1] = error.message[sizeof error.message - 1] = '\0';
    fail(plugin, name, status, error.code, error.field,
         error.message[0] ? error.message : host::code_name(error.code));
}

inline bool all_finite(std::span<const double> values) {
    double sum = 0; // a NaN or an infinity stays one when it is multiplied by zero
    for (const double v : values)
        sum += 0 * v;
    return sum == 0;
}

inline void require_finite(const Plugin& plugin, const char* function, const char* field,
                           std::span<const double> values) {
    if (!all_finite(values))
        fail(plugin, function, CALOT_OK, CALOT_CODE_NOT_FINITE, field, "is not finite; the plugin is broken");
}

} // namespace calot::simulation

// libFuzzer: any text as an endoscope's or instrument's datasheet and as a scene.
#include "host/error.hpp"
#include "simulation/endoscope_datasheet.hpp"
#include "simulation/scene.hpp"

#include <cstdint>
#include <string_view>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    try {
        calot::simulation::parse_endoscope(text, "fuzz");
    } catch (const calot::host::UserError&) { // refused in order
    }
    try {
        calot::simulation::parse_instrument(text, "fuzz");
    } catch (const calot::host::UserError&) {
    }
    try {
        calot::simulation::parse_scene(text, "fuzz");
    } catch (const calot::host::UserError&) {
    }
    return 0;
}

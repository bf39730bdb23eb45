// libFuzzer: any bytes as a record of a case, read and walked to its end.
#include "cases/journal.hpp"
#include "host/error.hpp"

#include <cstdint>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    try {
        const calot::cases::Journal journal =
            calot::cases::parse_journal({reinterpret_cast<const char*>(data), size}, "fuzz");
        calot::cases::StepDecoder steps(journal.steps);
        calot_controls controls{};
        std::uint32_t mark = 0;
        std::size_t count = 0;
        while (steps.next(controls, mark))
            ++count;
        if (count != journal.marks.size()) __builtin_trap();
    } catch (const calot::host::UserError&) { // refused in order
    }
    return 0;
}

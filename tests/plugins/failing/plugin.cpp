// Models that load and begin well, and fail at tick 500: each in its own way.
#include "../rigid_rod.hpp"

#include <calot/plugin.hpp>

#include <csignal>
#include <limits>
#include <unistd.h>

namespace {

constexpr std::int64_t failing_tick = 500;

enum class Way { crash, hang, overflow, nan, error };

// Never returns while `go_on` is true; the compiler must not see that it always is.
int deep(volatile bool& go_on, int level) {
    volatile char frame[4096];
    frame[0] = static_cast<char>(level);
    return go_on ? deep(go_on, level + 1) + frame[0] : level;
}

template<Way way>
class FailingRod final : public calot_test::RigidRod {
  public:
    calot::Result step(const calot_rod_input& input, calot_rod_output& output) override {
        const calot::Result result = RigidRod::step(input, output);
        if (input.tick < failing_tick) return result;
        volatile bool go_on = true;
        if constexpr (way == Way::crash) std::raise(SIGSEGV);
        if constexpr (way == Way::overflow) deep(go_on, 0);
        if constexpr (way == Way::hang)
            while (go_on)
                usleep(1000);
        if constexpr (way == Way::nan)
            calot::span(output.position)[7] = std::numeric_limits<double>::quiet_NaN();
        if constexpr (way == Way::error)
            return calot::Result::error(CALOT_CODE_INTERNAL, "matrix", "is singular; start again");
        return result;
    }
};

} // namespace

CALOT_PLUGIN(calot::export_rod<FailingRod<Way::crash>>("org.calot.test.rod-crash", "Test: crashes", "0.1.0"),
             calot::export_rod<FailingRod<Way::overflow>>("org.calot.test.rod-overflow", "Test: recurses",
                                                          "0.1.0"),
             calot::export_rod<FailingRod<Way::hang>>("org.calot.test.rod-hang", "Test: hangs", "0.1.0"),
             calot::export_rod<FailingRod<Way::nan>>("org.calot.test.rod-nan", "Test: not a number", "0.1.0"),
             calot::export_rod<FailingRod<Way::error>>("org.calot.test.rod-error", "Test: an error", "0.1.0"))

// What the tests of the pipeline share: the built plugins, the shipped anatomy, scripted hands.
#pragma once

#include "host/plugins.hpp"
#include "host/services.hpp"
#include "simulation/simulation.hpp"

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

namespace calot::simulation::test {

/// Hands that follow a function of the tick.
class ScriptedHands : public ControlSource {
  public:
    explicit ScriptedHands(std::function<void(std::int64_t, calot_controls&)> script)
        : script_(std::move(script)) {}
    bool next(std::int64_t tick, calot_controls& out) override {
        script_(tick, out);
        return true;
    }

  private:
    std::function<void(std::int64_t, calot_controls&)> script_;
};

/// The plugins of this build.
class Parts {
  public:
    Parts() : plugins_(services_, options()) {}
    host::Instance rod() { return plugins_.make(host::Kind::rod, "org.calot.rod-cosserat"); }

    /// The oesophagus and stomach alone, so that the test's cost does not grow with the anatomy.
    static std::shared_ptr<const World> world() {
        static const std::shared_ptr<const World> world = load_world(
            parse_scene(
                "format = 1\norgans = [\"upper-gi\"]\n[start.default]\npath = \"path\"\ninsertion = 0.14\n"
                "insertion_spread = 0.02\nrotation_spread = 0.3\n"
                "[marker.way]\nkind = \"path\"\nlandmark = \"path\"\ncolour = [0, 1, 0, 1]\nshown = true\n",
                "scene.toml"),
            {.assets = std::filesystem::path(CALOT_SOURCE_DIR) / "assets"});
        return world;
    }

  private:
    static host::Plugins::Options options() {
        const std::filesystem::path build = CALOT_BINARY_DIR;
        host::Plugins::Options o;
        o.places = {{build / "lib/calot/plugins", "the build", true, 0}};
        o.probe_program = build / "bin/calot-probe";
        return o;
    }
    host::Services services_;
    host::Plugins plugins_;
};

/// Pushes in, turns and steers, at a third of what a hand can do.
inline void push_and_steer(std::int64_t tick, calot_controls& c) {
    const double t = static_cast<double>(tick) * 1e-3;
    c.insertion = 0.1 * t;
    c.rotation = 0.5 * t;
    c.wheel[0] = 0.4 * t;
    c.wheel[1] = -0.2 * t;
}

} // namespace calot::simulation::test

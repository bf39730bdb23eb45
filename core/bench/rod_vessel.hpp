// A catheter pushed into a random, winding, rigid vessel until its tip is blocked: the compression test of
// Korzeniowski et al. (2016), figure 6.
#pragma once

#include "bench/lumen.hpp"
#include "bench/row.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace calot::bench {

/// One rod on its way into the vessel.
class PushedRod {
  public:
    /// 256 nodes 1 mm apart, radius 1 mm, EI = GJ = 1e-4 N m^2 unless the options say otherwise; a vessel of
    /// 3 mm radius, four fifths of the rod long, blind, bent no tighter than 20 mm. Pushed at 0.2 m/s by at
    /// most `load`. For a rod thicker than 1 mm all lengths that are not given are so much larger, EI and GJ
    /// by the square of that, the speed by its root.
    PushedRod(const MakeInstance& make, const RodOptions& options, double load, double friction);

    /// Advances by a step unless it is over: blocked for a third of a second, or a second late.
    bool step();
    bool is_blocked() const { return blocked_for_ >= blocked_at_; }
    double shortening() const {
        return 1 - shortest_ / uniform_.length;
    }                                                        ///< most, of the centreline's length
    double push() const { return pressed_; }                 ///< N, most at the base
    double penetration() const { return penetration_; }      ///< m, most
    double seconds_of_step() const { return step_seconds_; } ///< processor time of the last step
    bool is_colliding(int node) const {
        return colliding_[static_cast<std::size_t>(node)];
    } ///< in the last step
    const std::vector<Vec3>& axis() const { return axis_; }
    const BenchRod& rod() const { return rod_; }
    const UniformRod& uniform() const { return uniform_; }

    double vessel_radius() const { return 3e-3 * scale_; } ///< m

  private:
    static constexpr double blocked_at_ = 0.33; // s
    static constexpr double holds_for_ =
        5e-4; // m that a node goes before contacts are looked up anew, at scale 1
    static BenchRod::Setup setup(const UniformRod& uniform);

    UniformRod uniform_;
    double scale_; // of the scene, 1 for a rod of 1 mm radius or less
    std::vector<Vec3> axis_;
    Lumen lumen_;
    BenchRod rod_;
    std::vector<bool> colliding_;
    double load_, speed_, longest_, shortest_, blocked_for_ = 0, pressed_ = 0, penetration_ = 0,
                                               step_seconds_ = 0;
};

/// Every model into the same vessel, step by step in turn: percent of compression and processor time side by
/// side; with `picture` (.png or .svg) drawn, nodes that collide green, others red, the vessel's outline
/// round them. Options: seed, nodes, load (10 N unless given), friction, and
/// the rod's numbers.
struct VesselModel {
    std::string id;
    MakeInstance make;
};
std::vector<Row> run_vessel(const std::vector<VesselModel>& models, const RodOptions& options,
                            const std::filesystem::path& picture);

} // namespace calot::bench

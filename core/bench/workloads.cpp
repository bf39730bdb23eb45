#include "bench/workloads.hpp"

#include "bench/block_solve.hpp"
#include "bench/geometry_scenes.hpp"
#include "bench/lumen.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

namespace calot::bench {

namespace {

volatile double keep; // what is measured must not be optimised away

BenchRod::Setup straight(const UniformRod& rod, double from) {
    BenchRod::Setup s;
    s.rod = rod;
    s.position = straight_line(rod, {from, 0, 0}, along_x);
    s.frame = same_frames(rod, along_x);
    return s;
}

class Free : public Workload {
  public:
    Free(const MakeInstance& make, const UniformRod& uniform) : rod_(make, straight(uniform, 0)) {
        rod_.clamp_base({}, along_x);
        rod_.input.gravity[1] = 9.81;
    }
    void run() override { rod_.step(); }

  private:
    BenchRod rod_;
};

// Lies on a floor by its weight, is drawn along at 1 cm/s and turned.
class Floor : public Workload {
  public:
    Floor(const MakeInstance& make, const UniformRod& uniform) : rod_(make, setup(uniform)) {
        rod_.input.gravity[1] = 9.81;
    }
    void prepare() override {
        const double t = rod_.seconds() + rod_.rod().dt;
        rod_.clamp_base({0.01 * t, 0, 0}, axis_angle({1, 0, 0}, t) * along_x);
        list_.clear();
        for (int k = 1; k <= contacts; ++k) {
            const int i = std::max(1, k * (rod_.nodes() - 1) / contacts);
            const Vec3 p = rod_.position(i);
            list_.push_back(node_contact(rod_, i, static_cast<std::uint64_t>(k),
                                         {p.x, rod_.rod().radius, p.z}, {0, -1, 0}, -p.y, 0.2));
        }
    }
    void run() override { rod_.step(list_); }

  private:
    static constexpr int contacts = 20;
    static BenchRod::Setup setup(const UniformRod& uniform) {
        BenchRod::Setup s = straight(uniform, 0);
        s.max_contacts = contacts;
        s.drag = 5;
        return s;
    }
    BenchRod rod_;
    std::vector<calot_contact> list_;
};

// Half in a bent tube, turned at its base.
class Tube : public Workload {
  public:
    Tube(const MakeInstance& make, const UniformRod& uniform)
        : rod_(make, setup(uniform)),
          lumen_(Lumen::bend(0.6 * uniform.length, 0.1, std::numbers::pi / 2, 0.3), 0.01, false, 0.1) {
        rod_.input.gravity[1] = 9.81;
        rod_.input.base.mode = CALOT_END_COUPLED;
        rod_.input.base.insertion = {-outside * uniform.length, 0, 5000, 50, 50};
        rod_.input.base.rotation = {0, 1, 10, 0.1, 1};
    }
    void prepare() override {
        list_ = lumen_.contacts(rod_);
        rod_.input.base.rotation.target += rod_.input.base.rotation.velocity * rod_.rod().dt;
    }
    void run() override { rod_.step(list_); }

  private:
    static constexpr double outside = 0.55;
    static BenchRod::Setup setup(const UniformRod& uniform) {
        BenchRod::Setup s = straight(uniform, -outside * uniform.length);
        s.drag = 5;
        s.bending_damping = 2e-5;
        s.max_contacts = static_cast<std::uint32_t>(uniform.nodes + 1);
        calot_guide guide{};
        guide.present = 1;
        guide.direction[0] = 1;
        s.guide = guide;
        return s;
    }
    BenchRod rod_;
    Lumen lumen_;
    std::span<const calot_contact> list_;
};

class BlockSolve : public Workload {
  public:
    void run() override { keep = block_solve(); }
};

class Spheres : public Workload {
  public:
    Spheres() {
        for (int i = 0; i < 100; ++i) {
            const auto part = [&](double step) { return 2 * std::fmod(0.5 + step * i, 1) - 1; };
            centres_.push_back(
                {0.064 * part(0.8191725134), 0.064 * part(0.6710436067), 0.124 * part(0.5497004779)});
        }
    }
    void run() override {
        double sum = 0;
        for (const geometry::Vec3& p : centres_)
            sum += nearest_point(scene_, p, 6e-3).distance;
        keep = sum;
    }

  private:
    geometry::TriangleScene scene_ = FoldedTube(FoldedTube::Kind::stomach).wall(70, 71).scene();
    std::vector<geometry::Vec3> centres_;
};

class Capsules : public Workload {
  public:
    explicit Capsules(double step) {
        const FoldedTube tube(FoldedTube::Kind::stomach);
        scene_ = tube.wall(70, 71).scene();
        for (int i = 0; i < 80; ++i)
            places_.push_back(tube.shaft_on_wall(radii_.size() + 1, radii_[0], step * i));
    }
    void prepare() override {
        const int last = static_cast<int>(places_.size()) - 1;
        at_ = std::abs(turn_++ % (2 * last) - last); // to and fro
    }
    void run() override {
        const auto chain = geometry::Chain::of_block(places_[static_cast<std::size_t>(at_)], radii_);
        keep = static_cast<double>(contacts_.find(scene_, chain, 2e-3).size());
    }

  private:
    geometry::TriangleScene scene_;
    std::vector<std::vector<double>> places_;
    std::vector<double> radii_ = std::vector<double>(100, 6.3e-3);
    geometry::ChainContacts contacts_{101};
    int turn_ = 0, at_ = 0;
};

class Refit : public Workload {
  public:
    void prepare() override { turn_ = 1 - turn_; }
    void run() override { scene_.move_vertices(walls_[turn_].vertices); }

  private:
    FoldedTube tube_{FoldedTube::Kind::stomach};
    Surface walls_[2] = {tube_.wall(27, 28), tube_.wall(27, 28, 1e-4)};
    geometry::TriangleScene scene_ = walls_[0].scene();
    int turn_ = 0;
};

} // namespace

std::unique_ptr<Workload> rod_workload(std::string_view name, const MakeInstance& make) {
    UniformRod rod; // as in `calot bench rod --compare`
    rod.length = 1, rod.radius = 6e-3, rod.mass_per_length = 0.15;
    rod.bending = 0.15 * 9.81 / 5, rod.torsion = rod.bending * 2 / 3;
    if (name == "rod-free") return std::make_unique<Free>(make, rod);
    if (name == "rod-floor") return std::make_unique<Floor>(make, rod);
    UniformRod gastroscope; // as in `calot bench rod`
    gastroscope.length = 1.03;
    if (name == "rod-tube") return std::make_unique<Tube>(make, gastroscope);
    return nullptr;
}

std::unique_ptr<Workload> plain_workload(std::string_view name) {
    if (name == "block-solve") return std::make_unique<BlockSolve>();
    if (name == "spheres") return std::make_unique<Spheres>();
    if (name == "capsules") return std::make_unique<Capsules>(3e-4);
    if (name == "capsules-again") return std::make_unique<Capsules>(1.5e-5);
    if (name == "refit") return std::make_unique<Refit>();
    return nullptr;
}

} // namespace calot::bench

// A chain of Simbody's gimbal joints with its linear mobility springs, stepped by its semi-explicit Euler
// integrator.
#include "peer.hpp"

#include <Simbody.h>
#include <memory>

namespace calot::bench::peers {

class SimbodyChain {
  public:
    SimbodyChain(const ChainRod& rod, double dt)
        : rod_(rod), matter_(system_), forces_(system_),
          gravity_(forces_, matter_, SimTK::Vec3(0, rod.gravity, 0)) {
        using namespace SimTK;
        const Real l = rod.link(), m = rod.mass / rod.links;
        const Vec3 centre(0, 0, l / 2);
        const Inertia about_end =
            (m * UnitInertia::cylinderAlongZ(rod.radius, l / 2)).shiftFromMassCenter(centre, m);
        const Body::Rigid body(MassProperties(m, centre, about_end));
        MobilizedBody before = matter_.Ground();
        for (int k = 0; k < rod.links; ++k) {
            MobilizedBody::Gimbal next(before, Transform(Vec3(0, 0, k == 0 ? 0 : l)), body, Transform());
            for (int c = 0; c < 3; ++c)
                Force::MobilityLinearSpring(forces_, next, MobilizerQIndex(c),
                                            c < 2 ? rod.bending_spring(k) : rod.torsion_spring(k), 0);
            before = next;
        }
        tip_ = before.getMobilizedBodyIndex();
        system_.realizeTopology();
        integrator_ = std::make_unique<SemiExplicitEulerIntegrator>(system_, dt);
        integrator_->initialize(system_.getDefaultState());
        dt_ = dt;
    }
    void step() { integrator_->stepTo(integrator_->getTime() + dt_); }
    double tip_drop() const {
        const SimTK::State& s = integrator_->getState();
        system_.realize(s, SimTK::Stage::Position);
        return matter_.getMobilizedBody(tip_).findStationLocationInGround(s,
                                                                          SimTK::Vec3(0, 0, rod_.link()))[1];
    }

  private:
    ChainRod rod_;
    double dt_ = 0;
    SimTK::MultibodySystem system_;
    SimTK::SimbodyMatterSubsystem matter_;
    SimTK::GeneralForceSubsystem forces_;
    SimTK::Force::UniformGravity gravity_;
    SimTK::MobilizedBodyIndex tip_;
    std::unique_ptr<SimTK::SemiExplicitEulerIntegrator> integrator_;
};

} // namespace calot::bench::peers

int main(int argc, char** argv) {
    return calot::bench::peers::report<calot::bench::peers::SimbodyChain>("simbody", argc, argv);
}

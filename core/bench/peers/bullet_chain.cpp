// A chain of Bullet's multibody links with spherical joints, springs as joint torques.
#include "peer.hpp"

#include <BulletDynamics/Featherstone/btMultiBody.h>
#include <BulletDynamics/Featherstone/btMultiBodyConstraintSolver.h>
#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>
#include <btBulletDynamicsCommon.h>
#include <memory>
#include <vector>

namespace calot::bench::peers {

class BulletChain {
  public:
    BulletChain(const ChainRod& rod, double dt)
        : rod_(rod), dt_(dt), dispatcher_(&configuration_),
          world_(&dispatcher_, &broadphase_, &solver_, &configuration_) {
        const btScalar l = rod.link(), m = rod.mass / rod.links, r = rod.radius;
        const btVector3 inertia(m * (3 * r * r + l * l) / 12, m * (3 * r * r + l * l) / 12, m * r * r / 2);
        body_ = std::make_unique<btMultiBody>(rod.links, 0, btVector3(0, 0, 0), true, false);
        for (int k = 0; k < rod.links; ++k)
            body_->setupSpherical(k, m, inertia, k - 1, btQuaternion::getIdentity(),
                                  btVector3(0, 0, k == 0 ? 0 : l / 2), btVector3(0, 0, l / 2), true);
        body_->finalizeMultiDof();
        body_->setLinearDamping(0), body_->setAngularDamping(0);
        body_->setBaseWorldTransform(btTransform::getIdentity());
        world_.setGravity(btVector3(0, rod.gravity, 0));
        world_.addMultiBody(body_.get());
    }
    ~BulletChain() { world_.removeMultiBody(body_.get()); }

    void step() {
        for (int k = 0; k < rod_.links; ++k) {
            const btScalar* q = body_->getJointPosMultiDof(k); // x, y, z, w
            const btScalar s = q[3] < 0 ? -2 : 2;
            btScalar torque[3] = {-s * rod_.bending_spring(k) * q[0], -s * rod_.bending_spring(k) * q[1],
                                  -s * rod_.torsion_spring(k) * q[2]};
            body_->addJointTorqueMultiDof(k, torque);
        }
        world_.stepSimulation(dt_, 0);
    }
    double tip_drop() const {
        return body_->localPosToWorld(rod_.links - 1, btVector3(0, 0, rod_.link() / 2)).y();
    }

  private:
    ChainRod rod_;
    double dt_;
    btDefaultCollisionConfiguration configuration_;
    btCollisionDispatcher dispatcher_;
    btDbvtBroadphase broadphase_;
    btMultiBodyConstraintSolver solver_;
    btMultiBodyDynamicsWorld world_;
    std::unique_ptr<btMultiBody> body_;
};

} // namespace calot::bench::peers

int main(int argc, char** argv) {
    return calot::bench::peers::report<calot::bench::peers::BulletChain>("bullet", argc, argv);
}

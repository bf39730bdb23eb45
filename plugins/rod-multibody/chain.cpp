// Compiled as C++17 and without NDEBUG; see chain.hpp.
#include "chain.hpp"

#include <Simbody.h>
#include <algorithm>
#include <cmath>
#include <vector>

namespace calot::rod_multibody {

using namespace SimTK;

namespace {

// Plain, so that the compiler sees through the recursion's loops.
struct Mat66 {
    Real v[36] = {};
    Real& operator()(int i, int j) { return v[6 * i + j]; }
    Real operator()(int i, int j) const { return v[6 * i + j]; }
    Mat33 block(int a, int b) const {
        Mat33 m;
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j)
                m(i, j) = (*this)(3 * a + i, 3 * b + j);
        return m;
    }
};

Quaternion turned(const Quaternion& q, const Vec3& rotation) {
    const Real angle = rotation.norm();
    const Vec3 v = angle > 1e-12 ? Vec3(std::sin(angle / 2) / angle * rotation) : Vec3(0.5 * rotation);
    const Real w = std::cos(angle / 2);
    const Vec4 p(w * q[0] - v[0] * q[1] - v[1] * q[2] - v[2] * q[3],
                 w * q[1] + v[0] * q[0] + v[1] * q[3] - v[2] * q[2],
                 w * q[2] + v[1] * q[0] + v[2] * q[1] - v[0] * q[3],
                 w * q[3] + v[2] * q[0] + v[0] * q[2] - v[1] * q[1]);
    return Quaternion(p); // normalises
}

} // namespace

struct Chain::Inside {
    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    std::vector<MobilizedBody> bodies;
    State state;
    std::vector<BodyMotion> motion;
    std::vector<double> speeds;
    mutable Vector joint_forces, no_acceleration, residual;
    mutable Vector_<SpatialVec> wrenches;
    // The recursion's, for each body: its three (or six) motions' columns, and what goes with them.
    struct Link {
        Vec3 arm; // from the former body's origin
        Mat66 gain, inverse;
        Vec6 rest;
    };
    mutable std::vector<Mat66> inertia, columns;
    mutable std::vector<Link> links;
    mutable std::vector<Vec6> bias, change;

    void realize() {
        system.realize(state, Stage::Velocity);
        for (std::size_t k = 0; k < bodies.size(); ++k) {
            const Transform& x = bodies[k].getBodyTransform(state);
            const SpatialVec& v = bodies[k].getBodyVelocity(state);
            const Quaternion q = x.R().convertRotationToQuaternion();
            BodyMotion& m = motion[k];
            for (int i = 0; i < 4; ++i)
                m.orientation[i] = q[i];
            for (int i = 0; i < 3; ++i)
                m.origin[i] = x.p()[i], m.turning[i] = v[0][i], m.velocity[i] = v[1][i];
        }
        const Vector& u = state.getU();
        for (std::size_t i = 0; i < speeds.size(); ++i)
            speeds[i] = u[static_cast<int>(i)];
    }
    static int motions_of(std::size_t k) { return k == 0 ? 6 : 3; }
    static int first_of(std::size_t k) { return k == 0 ? 0 : 6 + 3 * (static_cast<int>(k) - 1); }
};

Chain::Chain(int count, const Body* bodies) : in_(std::make_unique<Inside>()) {
    Inside& in = *in_;
    for (int k = 0; k < count; ++k) {
        const Body& b = bodies[k];
        const Vec3 centre(0, 0, b.length / 2);
        const Inertia central = b.mass * UnitInertia::cylinderAlongZ(b.radius, b.length / 2);
        const SimTK::Body::Rigid rigid(
            MassProperties(b.mass, centre, central.shiftFromMassCenter(centre, b.mass)));
        if (k == 0)
            in.bodies.push_back(MobilizedBody::Free(in.matter.Ground(), Transform(), rigid, Transform()));
        else
            in.bodies.push_back(MobilizedBody::Ball(
                in.bodies.back(), Transform(Vec3(0, 0, bodies[k - 1].length)), rigid, Transform()));
    }
    in.state = in.system.realizeTopology();
    in.matter.setUseEulerAngles(in.state, false);
    in.system.realizeModel(in.state);
    const auto n = static_cast<std::size_t>(count);
    in.motion.resize(n), in.links.resize(n), in.inertia.resize(n), in.columns.resize(n), in.bias.resize(n);
    in.change.resize(n);
    in.speeds.assign(static_cast<std::size_t>(motions()), 0.0);
    in.joint_forces.resize(motions()), in.residual.resize(motions());
    in.no_acceleration.resize(motions()), in.no_acceleration = 0;
    in.wrenches.resize(count + 1), in.wrenches = SpatialVec(Vec3(0), Vec3(0));
    in.realize();
}

Chain::~Chain() = default;

int Chain::motions() const {
    return 6 + 3 * (static_cast<int>(in_->bodies.size()) - 1);
}

void Chain::place(const double* origin, const double* orientations, const double* motion) {
    Inside& in = *in_;
    Rotation before;
    Vector& q = in.state.updQ();
    for (std::size_t k = 0; k < in.bodies.size(); ++k) {
        const double* o = orientations + 4 * k;
        const Rotation r(Quaternion(o[0], o[1], o[2], o[3]));
        const Quaternion relative = (~before * r).convertRotationToQuaternion();
        const int at = k == 0 ? 0 : 7 + 4 * (static_cast<int>(k) - 1);
        for (int i = 0; i < 4; ++i)
            q[at + i] = relative[i];
        before = r;
    }
    for (int i = 0; i < 3; ++i)
        q[4 + i] = origin[i];
    Vector& u = in.state.updU();
    for (int i = 0; i < motions(); ++i)
        u[i] = motion[i];
    in.realize();
}

const BodyMotion& Chain::body(int k) const {
    return in_->motion[static_cast<std::size_t>(k)];
}
const double* Chain::motion() const {
    return in_->speeds.data();
}
int Chain::coordinates() const {
    return 7 + 4 * (static_cast<int>(in_->bodies.size()) - 1);
}
void Chain::read(double* coordinates) const {
    for (int i = 0; i < this->coordinates(); ++i)
        coordinates[i] = in_->state.getQ()[i];
}
void Chain::restore(const double* coordinates, const double* motion) {
    for (int i = 0; i < this->coordinates(); ++i)
        in_->state.updQ()[i] = coordinates[i];
    for (int i = 0; i < motions(); ++i)
        in_->state.updU()[i] = motion[i];
    in_->realize();
}
void Chain::momentum(int k, double* six) const {
    const MobilizedBody& b = in_->bodies[static_cast<std::size_t>(k)];
    const SpatialVec p = b.getBodySpatialInertiaInGround(in_->state) * b.getBodyVelocity(in_->state);
    for (int i = 0; i < 3; ++i)
        six[i] = p[0][i], six[3 + i] = p[1][i];
}
double Chain::kinetic_energy() const {
    return in_->matter.calcKineticEnergy(in_->state);
}

void Chain::residual(const double* joint_moments, const double* wrenches, double* out) const {
    const Inside& in = *in_;
    for (int i = 0; i < motions(); ++i)
        in.joint_forces[i] = joint_moments[i];
    for (std::size_t k = 0; k < in.bodies.size(); ++k) {
        const double* w = wrenches + 6 * k;
        in.wrenches[static_cast<int>(k) + 1] = SpatialVec(Vec3(w[0], w[1], w[2]), Vec3(w[3], w[4], w[5]));
    }
    in.matter.calcResidualForceIgnoringConstraints(in.state, in.joint_forces, in.wrenches, in.no_acceleration,
                                                   in.residual);
    for (int i = 0; i < motions(); ++i)
        out[i] = in.residual[i];
}

// The articulated-body recursion (Featherstone 2008, ch. 7.3; Jain 2011), with S in two places: a joint's own
// part adds to D = H^T P H, as the inertia of a motor's rotor would, and a body's to its spatial inertia.
void Chain::solve(const double* at_joint, const double* at_body, const double* right, double* x) const {
    const Inside& in = *in_;
    const std::size_t n = in.bodies.size();
    for (std::size_t k = 0; k < n; ++k) {
        const SpatialMat m = in.bodies[k].getBodySpatialInertiaInGround(in.state).toSpatialMat();
        for (int i = 0; i < 6; ++i)
            for (int j = 0; j < 6; ++j)
                in.inertia[k](i, j) = m(i / 3, j / 3)(i % 3, j % 3) + at_body[36 * k + 6 * i + j];
        in.bias[k] = Vec6(0);
        const int count = Inside::motions_of(k);
        for (int c = 0; c < count; ++c) {
            const SpatialVec h = in.bodies[k].getHCol(in.state, MobilizerUIndex(c));
            for (int i = 0; i < 3; ++i)
                in.columns[k](i, c) = h[0][i], in.columns[k](3 + i, c) = h[1][i];
        }
    }
    for (std::size_t k = n; k-- > 0;) {
        Inside::Link& link = in.links[k];
        const int count = Inside::motions_of(k), first = Inside::first_of(k);
        const Mat66& p = in.inertia[k];
        const Mat66& h = in.columns[k];
        Mat66 ph;
        for (int i = 0; i < 6; ++i)
            for (int c = 0; c < count; ++c)
                for (int j = 0; j < 6; ++j)
                    ph(i, c) += p(i, j) * h(j, c);
        Mat66 d;
        Vec6 rest(0);
        for (int a = 0; a < count; ++a) {
            rest[a] = right[first + a];
            for (int i = 0; i < 6; ++i)
                rest[a] -= h(i, a) * in.bias[k][i];
            for (int b = 0; b < count; ++b) {
                d(a, b) = k > 0 ? at_joint[9 * k + static_cast<std::size_t>(3 * a + b)] : 0;
                for (int i = 0; i < 6; ++i)
                    d(a, b) += h(i, a) * ph(i, b);
            }
        }
        // Its inverse, by Gauss and Jordan: symmetric and definite, so no pivots are looked for.
        Mat66 inverse;
        for (int i = 0; i < 6; ++i)
            inverse(i, i) = 1;
        for (int c = 0; c < count; ++c) {
            const Real scale = 1 / d(c, c);
            for (int j = 0; j < count; ++j)
                d(c, j) *= scale, inverse(c, j) *= scale;
            for (int r = 0; r < count; ++r) {
                if (r == c) continue;
                const Real f = d(r, c);
                for (int j = 0; j < count; ++j)
                    d(r, j) -= f * d(c, j), inverse(r, j) -= f * inverse(c, j);
            }
        }
        link.gain = Mat66(), link.inverse = inverse, link.rest = rest;
        for (int i = 0; i < 6; ++i)
            for (int c = 0; c < count; ++c)
                for (int j = 0; j < count; ++j)
                    link.gain(i, c) += ph(i, j) * inverse(j, c);
        if (k == 0) break;
        // What the body before feels, moved to its origin: forces by (t + arm x f, f).
        link.arm =
            in.bodies[k].getBodyTransform(in.state).p() - in.bodies[k - 1].getBodyTransform(in.state).p();
        Mat66 rigid = p;
        Vec6 z = in.bias[k];
        for (int i = 0; i < 6; ++i)
            for (int c = 0; c < count; ++c) {
                z[i] += link.gain(i, c) * rest[c];
                for (int j = 0; j < 6; ++j)
                    rigid(i, j) -= link.gain(i, c) * ph(j, c);
            }
        // Rounding makes it lopsided, which would grow along the chain.
        for (int i = 0; i < 6; ++i)
            for (int j = 0; j < i; ++j)
                rigid(i, j) = rigid(j, i) = 0.5 * (rigid(i, j) + rigid(j, i));
        const Mat33 cross = crossMat(link.arm);
        const Mat33 tt = rigid.block(0, 0), tf = rigid.block(0, 1), ft = rigid.block(1, 0),
                    ff = rigid.block(1, 1);
        const Mat33 top = tf + cross * ff, left = ft + ff * ~cross;
        const Mat33 corner = tt + cross * ft + top * ~cross;
        Mat66& to = in.inertia[k - 1];
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j)
                to(i, j) += corner(i, j), to(i, 3 + j) += top(i, j), to(3 + i, j) += left(i, j),
                    to(3 + i, 3 + j) += ff(i, j);
        const Vec3 torque = z.getSubVec<3>(0), force = z.getSubVec<3>(3), moved = torque + link.arm % force;
        for (int i = 0; i < 3; ++i)
            in.bias[k - 1][i] += moved[i], in.bias[k - 1][3 + i] += force[i];
    }
    for (std::size_t k = 0; k < n; ++k) {
        const Inside::Link& link = in.links[k];
        const int count = Inside::motions_of(k), first = Inside::first_of(k);
        Vec6 a(0);
        if (k > 0) {
            const Vec3 turning = in.change[k - 1].getSubVec<3>(0),
                       velocity = in.change[k - 1].getSubVec<3>(3);
            const Vec3 moved = velocity + turning % link.arm;
            for (int i = 0; i < 3; ++i)
                a[i] = turning[i], a[3 + i] = moved[i];
        }
        for (int c = 0; c < count; ++c) {
            Real value = 0;
            for (int j = 0; j < count; ++j)
                value += link.inverse(c, j) * link.rest[j];
            for (int i = 0; i < 6; ++i)
                value -= link.gain(i, c) * a[i];
            x[first + c] = value;
        }
        for (int c = 0; c < count; ++c)
            for (int i = 0; i < 6; ++i)
                a[i] += in.columns[k](i, c) * x[first + c];
        in.change[k] = a;
    }
}

const double* Chain::body_change(int k) const {
    return &in_->change[static_cast<std::size_t>(k)][0];
}

void Chain::advance(double h, const double* change) {
    Inside& in = *in_;
    Vector& u = in.state.updU();
    Vector& q = in.state.updQ();
    for (int i = 0; i < motions(); ++i)
        u[i] += change[i];
    for (std::size_t k = 0; k < in.bodies.size(); ++k) {
        const int at = k == 0 ? 0 : 7 + 4 * (static_cast<int>(k) - 1), first = Inside::first_of(k);
        const Quaternion before(q[at], q[at + 1], q[at + 2], q[at + 3]);
        const Quaternion after = turned(before, h * Vec3(u[first], u[first + 1], u[first + 2]));
        for (int i = 0; i < 4; ++i)
            q[at + i] = after[i];
    }
    for (int i = 0; i < 3; ++i)
        q[4 + i] += h * u[3 + i];
    in.realize();
}

} // namespace calot::rod_multibody

// What is done once: set up, choose the substeps and the penalties, keep the state.
#include "corde_rod.hpp"

#include <cmath>

namespace calot::rod_corde {

namespace {

// The largest share of the explicit stability limit, 2/w, that a substep uses; the rest is for large
// rotations, contacts and friction.
constexpr double stability_share = 0.75;
constexpr double longest_substep = 1e-4; // s; bounds the leapfrog's energy error
constexpr double heavier_below = 5e-6;   // s
constexpr int most_substeps = 1'000'000;
// (h w)^2 of a substep.
constexpr double limit = 4.0 * stability_share * stability_share;
// A rod on a soft parallel constraint bends like a beam that shears: a cantilever's tip goes down by 3
// EI/(kappa L^2) too far. Where the substep of bending and twist bears no stiffer one, this share is let be.
constexpr double most_shear = 5e-4;
// Internal friction is explicit too: with velocities half a substep behind, h^2 w^2 + 2 d < 4 where d is the
// share of relative speed that it takes in a substep. What is above these shares is ignored.
constexpr double most_friction = 0.3, most_shear_friction = 0.15;
// s, added to every bending damping: the frames' own quick modes lose some per cent in a period by it, the
// lowest mode of a metre of endoscope a part in 10^5.
constexpr double numerical_viscosity = 1e-6;

} // namespace

CordeRod::CordeRod(const RodDescription& d, std::span<const double> p)
    : CordeRod(d, Settings{p[0], p[1], p[2], p[3]}) {}

CordeRod::CordeRod(const RodDescription& d, const Settings& settings)
    : n_(d.nodes), dt_(d.dt), settings_(settings), guide_(d.guide) {
    const auto n = static_cast<std::size_t>(n_), m = n - 1;
    for (Array* a : {&x_,
                     &y_,
                     &z_,
                     &vx_,
                     &vy_,
                     &vz_,
                     &fx_,
                     &fy_,
                     &fz_,
                     &mass_,
                     &w_,
                     &slow_,
                     &k1_,
                     &k2_,
                     &k3_,
                     &rest1_,
                     &rest2_,
                     &rest3_,
                     &cell_,
                     &per_cell_,
                     &gx_,
                     &gy_,
                     &gz_,
                     &bend_friction_,
                     &twist_friction_})
        a->assign(n, 0.0);
    for (Array* a : {&qw_, &qx_, &qy_, &qz_, &o1_, &o2_, &o3_, &t1_, &t2_, &t3_, &across_, &along_,
                     &slow_spin_, &stretch_, &penalty_, &stretch_friction_, &shear_friction_})
        a->assign(m, 0.0);
    for (Array* a : {&px_, &py_, &pz_})
        a->assign(n + 1, 0.0);
    const auto contacts = static_cast<std::size_t>(d.max_contacts);
    rows_.resize(contacts), memory_.resize(contacts), impulse_.resize(contacts);
    touching_.assign(n, 0);
    length_ = d.length;
    rest_darboux_ = d.rest_darboux;
    for (std::size_t i = 0; i < n; ++i)
        x_[i] = d.position[3 * i], y_[i] = d.position[3 * i + 1], z_[i] = d.position[3 * i + 2];
    const std::vector<double> frames = aligned_frames(d);
    for (std::size_t j = 0; j < m; ++j)
        qw_[j] = frames[4 * j], qx_[j] = frames[4 * j + 1], qy_[j] = frames[4 * j + 2],
        qz_[j] = frames[4 * j + 3];
    set_properties(d.properties);
    base_clamp_ = frame(0), tip_clamp_ = frame(n_ - 2);
}

void CordeRod::set_properties(const RodProperties& p) {
    properties_ = p;
    std::fill(mass_.begin(), mass_.end(), 0.0);
    std::fill(slow_.begin(), slow_.end(), 0.0);
    for (int j = 0; j < n_ - 1; ++j) {
        const double l = length_[j], mass = p.mass_per_length[j] * l, r = p.radius[j];
        // A round solid section's. Frames that would ask for very short substeps are made heavier, by no more
        // than a quarter of a segment's length as radius of gyration: that vanishes with the spacing's
        // square.
        const double most = mass * l * l / 16, per = 4 / l * heavier_below * heavier_below / limit;
        const double bend = std::max(p.bending_x[j], p.bending_y[j]);
        across_[j] = std::max(0.25 * mass * r * r, std::min(most, per * bend));
        along_[j] = std::max(0.5 * mass * r * r, std::min(most, per * p.torsion[j]));
        for (const int i : {j, j + 1})
            mass_[i] += 0.5 * mass, slow_[i] += 0.5 * l * p.drag[j];
    }
    update_joints();
    choose_substeps();
}

// Joint i spans half of each neighbouring segment; compliances and rest angles of the halves add. At the ends
// the cell is half a segment: what lies between the end's cross-section and the segment's middle.
void CordeRod::update_joints() {
    const auto series = [](double la, double ka, double lb, double kb) {
        return (la + lb) / (la / ka + lb / kb);
    };
    for (int i = 0; i < n_; ++i) {
        const int a = std::max(i - 1, 0), b = std::min(i, n_ - 2);
        const double la = i > 0 ? 0.5 * length_[a] : 0.0, lb = i < n_ - 1 ? 0.5 * length_[b] : 0.0;
        k1_[i] = series(la, properties_.bending_x[a], lb, properties_.bending_x[b]);
        k2_[i] = series(la, properties_.bending_y[a], lb, properties_.bending_y[b]);
        k3_[i] = series(la, properties_.torsion[a], lb, properties_.torsion[b]);
        cell_[i] = la + lb;
        per_cell_[i] = 2.0 / cell_[i];
        const auto mean = [&](int k) {
            return (la * rest_darboux_[3 * a + k] + lb * rest_darboux_[3 * b + k]) / (la + lb);
        };
        rest1_[i] = mean(0), rest2_[i] = mean(1), rest3_[i] = mean(2);
    }
}

// The highest frequency of the frames against each other bounds the substep (row sums of the mass-scaled
// stiffness, Gershgorin). Lengths and the parallel constraint are then made as stiff as this substep bears,
// unless their stiffness is given: the "highest possible (but stable) stretching modulus" of Korzeniowski et
// al. (2016). A chain of springs K/l between masses m has w^2 <= 4 K/(l m); a frame tied to its edge by kappa
// has w^2 <= kappa (4/(l m) + l/I).
void CordeRod::choose_substeps() {
    const int m = n_ - 1;
    double top = limit / (longest_substep * longest_substep), whole = 0;
    for (const double l : length_)
        whole += l;
    const auto row = [&](int j, const Array& inertia, const auto& stiffness) {
        double sum = 0;
        for (const int i : {j, j + 1}) {
            const int o = i == j ? j - 1 : j + 1;
            const double s = stiffness(i) / cell_[i];
            sum += s / inertia[j];
            if (o >= 0 && o < m) sum += s / std::sqrt(inertia[j] * inertia[o]);
        }
        return sum;
    };
    const auto bending = [&](int j) {
        return row(j, across_, [&](int i) { return std::max(k1_[i], k2_[i]); });
    };
    const auto mass = [&](int j) { return properties_.mass_per_length[j] * length_[j]; };
    const auto per_penalty = [&](int j) { return 4.0 / (length_[j] * mass(j)) + length_[j] / across_[j]; };
    for (int j = 0; j < m; ++j) {
        const double r = properties_.radius[j], b = bending(j),
                     bend = std::max(properties_.bending_x[j], properties_.bending_y[j]);
        stretch_[j] = settings_.stretch_modulus * 3.14159265358979324 * r * r;
        penalty_[j] = settings_.parallel_penalty;
        const double needed = penalty_[j] > 0 ? penalty_[j] : 3 * bend / (most_shear * whole * whole);
        top = std::max({top, row(j, along_, [&](int i) { return k3_[i]; }),
                        b + std::max(0.5 * b, needed * per_penalty(j)),
                        4.0 * stretch_[j] / (length_[j] * mass(j))});
    }
    const double h = std::sqrt(limit / top);
    substeps_ = static_cast<int>(clamp(std::ceil(dt_ / h - 1e-9), 1, most_substeps));
    const double per_h = substeps_ / dt_;
    for (int j = 0; j < m; ++j) {
        if (settings_.stretch_modulus == 0) stretch_[j] = 0.25 * top * length_[j] * mass(j);
        if (settings_.parallel_penalty == 0) penalty_[j] = (top - bending(j)) / per_penalty(j);
        const double tau = settings_.internal_friction;
        stretch_friction_[j] =
            std::min(stretch_[j] * tau / length_[j], most_friction * 0.25 * mass(j) * per_h);
        shear_friction_[j] = std::min(penalty_[j] * tau * length_[j],
                                      most_shear_friction * per_h * length_[j] / per_penalty(j));
        const double solid = 0.5 * mass(j) * properties_.radius[j] * properties_.radius[j] / along_[j];
        slow_spin_[j] =
            std::exp(-properties_.drag[j] / properties_.mass_per_length[j] * solid * dt_ / substeps_);
    }
    for (int i = 0; i < n_; ++i) {
        // Here slow_ becomes what set_properties has collected drag for.
        slow_[i] = std::exp(-slow_[i] / mass_[i] * dt_ / substeps_);
        if (i == 0 || i == n_ - 1) continue;
        const double la = length_[i - 1], lb = length_[i];
        const auto mean = [&](const Array& a) { return (la * a[i - 1] + lb * a[i]) / (la + lb); };
        const double bend =
                         std::max(k1_[i], k2_[i]) * (numerical_viscosity + mean(properties_.bending_damping)),
                     twist = k3_[i] * (numerical_viscosity + mean(properties_.torsion_damping));
        const auto most = [&](const Array& inertia) {
            return most_friction * 0.25 * per_h * std::min(inertia[i - 1], inertia[i]);
        };
        bend_friction_[i] = std::min(bend / cell_[i], most(across_));
        twist_friction_[i] = std::min(twist / cell_[i], most(along_));
    }
}

void CordeRod::stop() {
    for (Array* a : {&vx_, &vy_, &vz_, &o1_, &o2_, &o3_})
        std::fill(a->begin(), a->end(), 0.0);
    memory_count_ = 0;
    base_force_ = base_torque_ = tip_force_ = tip_torque_ = {};
    std::fill(impulse_.begin(), impulse_.end(), Vec3{});
}

bool CordeRod::is_finite() const {
    double sum = 0.0;
    for (const Array* a : {&x_, &y_, &z_, &vx_, &vy_, &vz_, &qw_, &qx_, &qy_, &qz_, &o1_, &o2_, &o3_})
        for (const double v : *a)
            sum += v * 0.0;
    return sum == 0.0;
}

double CordeRod::insertion() const {
    return guide_.present != 0 ? dot(position(0) - vec3(guide_.exit), vec3(guide_.direction)) : 0.0;
}

double CordeRod::arc_length() const {
    double sum = 0.0;
    for (int j = 0; j < n_ - 1; ++j)
        sum += norm(position(j + 1) - position(j));
    return sum;
}

double CordeRod::constraint_energy() const {
    double sum = 0;
    for (int j = 0; j < n_ - 1; ++j) {
        const Vec3 e = position(j + 1) - position(j);
        const double l = norm(e), strain = l / length_[j] - 1;
        const Vec3 off = (1 / l) * e - third_axis(frame(j));
        sum += 0.5 * length_[j] * (stretch_[j] * strain * strain + penalty_[j] * dot(off, off));
    }
    return sum;
}

RodEnergies CordeRod::energies() const {
    RodEnergies e;
    for (int i = 0; i < n_; ++i) {
        e.kinetic += 0.5 * mass_[i] * dot(velocity(i), velocity(i));
        // What lies in the sleeve has no weight: its height is the mouth's.
        e.gravity -= mass_[i] * dot(gravity_, i < on_axis_ ? vec3(guide_.exit) : position(i));
    }
    for (int j = 0; j < n_ - 1; ++j)
        e.kinetic += 0.5 * (across_[j] * (o1_[j] * o1_[j] + o2_[j] * o2_[j]) + along_[j] * o3_[j] * o3_[j]);
    for (int i = 0; i < n_; ++i) {
        Quat p;
        if (i > 0 && i < n_ - 1)
            p = short_turn(frame(i - 1), frame(i));
        else if (i == 0 && base_.mode == CALOT_END_CLAMPED)
            p = short_turn(base_clamp_, frame(0));
        else if (i == n_ - 1 && tip_.mode == CALOT_END_CLAMPED)
            p = short_turn(frame(i - 1), tip_clamp_);
        else
            continue;
        const double d1 = per_cell_[i] * p.x - rest1_[i], d2 = per_cell_[i] * p.y - rest2_[i],
                     d3 = 2.0 / cell_[i] * p.z - rest3_[i];
        e.bending += (k1_[i] * d1 * d1 + k2_[i] * d2 * d2) / per_cell_[i];
        e.twist += 0.5 * cell_[i] * k3_[i] * d3 * d3;
    }
    // The penalties stand for the stiffness of bending: what they hold belongs to it.
    e.bending += constraint_energy();
    return e;
}

template<class Rod, class F>
void CordeRod::visit_state(Rod& rod, F f) {
    for (auto* a : {&rod.x_, &rod.y_, &rod.z_, &rod.vx_, &rod.vy_, &rod.vz_, &rod.qw_, &rod.qx_, &rod.qy_,
                    &rod.qz_, &rod.o1_, &rod.o2_, &rod.o3_, &rod.rest_darboux_})
        for (auto& v : *a)
            f(v);
    for (auto* q : {&rod.base_clamp_, &rod.tip_clamp_})
        f(q->w), f(q->x), f(q->y), f(q->z);
    f(rod.roll_);
}

std::size_t CordeRod::state_size() const {
    std::size_t size = 0;
    visit_state(*this, [&](const double&) { ++size; });
    return size + 1 + 7 * rows_.size();
}

// Ids are 64 bits: two halves, each a whole number that a double holds.
void CordeRod::save(std::span<double> state) const {
    std::size_t at = 0;
    visit_state(*this, [&](const double& v) { state[at++] = v; });
    state[at++] = static_cast<double>(memory_count_);
    for (std::size_t k = 0; k < rows_.size(); ++k) {
        const Memory m = k < memory_count_ ? memory_[k] : Memory{};
        for (const double v : {static_cast<double>(m.id >> 32), static_cast<double>(m.id & 0xffffffffu),
                               m.stick.x, m.stick.y, m.stick.z, m.offset, m.force})
            state[at++] = v;
    }
}

bool CordeRod::load(std::span<const double> state) {
    if (state.size() != state_size()) return false;
    const std::size_t contacts = state.size() - 7 * rows_.size();
    const auto is_whole = [](double v, double most) { return v >= 0 && v <= most && v == std::floor(v); };
    if (!is_whole(state[contacts - 1], static_cast<double>(rows_.size()))) return false;
    for (std::size_t k = 0; k < 7 * rows_.size(); k += 7)
        if (!is_whole(state[contacts + k], 4294967295.0) || !is_whole(state[contacts + k + 1], 4294967295.0))
            return false;
    std::size_t at = 0;
    visit_state(*this, [&](double& v) { v = state[at++]; });
    memory_count_ = static_cast<std::size_t>(state[contacts - 1]);
    for (std::size_t k = 0; k < rows_.size(); ++k) {
        const double* s = state.data() + contacts + 7 * k;
        memory_[k] = {(static_cast<std::uint64_t>(s[0]) << 32) | static_cast<std::uint64_t>(s[1]),
                      {s[2], s[3], s[4]},
                      s[5],
                      s[6]};
    }
    update_joints();
    return true;
}

} // namespace calot::rod_corde

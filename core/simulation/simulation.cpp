#include "simulation/simulation.hpp"

#include "host/blame.hpp"
#include "host/philox.hpp"
#include "simulation/case_state.hpp"
#include "simulation/operator_link.hpp"
#include "simulation/pacer.hpp"
#include "simulation/plugin_call.hpp"
#include "simulation/procedure_view.hpp"
#include "simulation/shaft.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <optional>
#include <thread>

namespace calot::simulation {

namespace {

constexpr std::int64_t procedure_period = 16, digest_period = 1000; // ticks

// The hand holds the shaft by a grip that is stiff against what a finger feels (1 mm for 3 N), and damped
// well below what the mass in the guide, 0.2 kg, and one tick bear: 2 m / dt = 400 N s/m.
constexpr CouplingGains grip{.stiffness = {3000, 8}, .damping = {30, 0.02}, .limit = {50, 1}};

constexpr std::uint64_t start_stream = 0x7374617274; // "start", of the random numbers

double seconds_since(std::chrono::steady_clock::time_point begin) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

Shaft::Start drawn_start(const World& world, const std::string& name, std::uint64_t seed) {
    const StartPose* pose = world.scene.start(name);
    if (pose == nullptr) {
        std::string known;
        for (const StartPose& s : world.scene.starts)
            known += (known.empty() ? "" : ", ") + s.name;
        throw host::UserError(world.scene.file, "start." + name,
                              "is no start pose of this scene; choose " + known);
    }
    const auto spread = [&](std::uint64_t counter, double by) {
        return by * (2 * host::random_uniform(seed, start_stream, counter) - 1);
    };
    Shaft::Start start;
    start.path = pose->path;
    start.insertion = pose->insertion + spread(0, pose->insertion_spread);
    start.rotation = pose->rotation + spread(1, pose->rotation_spread);
    for (std::size_t k = 0; k < 2; ++k)
        start.wheels[k] = pose->wheels[k] + spread(2 + k, pose->wheels_spread[k]);
    return start;
}

calot_controls start_controls(const Shaft::Start& start) {
    calot_controls c{};
    c.struct_size = sizeof c;
    c.wheel[0] = start.wheels[0];
    c.wheel[1] = start.wheels[1];
    c.retractor.quaternion[0] = 1;
    return c;
}

CouplingGains gains_for(const Setup& setup, const OperatorLink& hand) {
    CouplingGains g = grip;
    g.limit = {setup.max_force, setup.max_torque};
    const double strongest[2] = {hand.max_force(), hand.max_torque()};
    for (std::size_t k = 0; k < 2; ++k) {
        if (hand.stiffness_limit(static_cast<int>(k)) > 0)
            g.stiffness[k] = std::min(g.stiffness[k], hand.stiffness_limit(static_cast<int>(k)));
        if (strongest[k] > 0) g.limit[k] = std::min(g.limit[k], strongest[k]);
    }
    return g;
}

} // namespace

struct Simulation::Impl {
    Setup setup;
    const World& world;
    Snapshot now;
    SnapshotRing ring;
    calot_controls controls;
    OperatorLink hand;
    Shaft shaft;
    CaseState state;
    ProcedureView procedure_view;
    InputQueue input;
    std::vector<Observer*> observers;

    std::array<double, 2> offset{}; // m, rad that the hand moved without effect
    Hash control_hash;
    std::atomic<bool> is_pause_asked{false}, is_stop_asked{false};
    bool is_begun = false, is_procedure_active = false, is_replay_over = false, is_unplugged = false;
    End end = End::stopped;

    Impl(Setup given, const Shaft::Start& start)
        : setup(std::move(given)), world(*setup.world), ring(setup.nodes, setup.max_contacts),
          controls(start_controls(start)),
          hand(setup.device, setup.replay, controls, world.endoscope.camera.field_of_view, setup.seed),
          shaft(setup.rod, world, setup.nodes, setup.max_contacts, setup.threads > 1, setup.measure,
                setup.seed, start, gains_for(setup, hand)),
          state(world, setup.procedure, now), procedure_view(world) {
        now.contact.resize(setup.max_contacts);
        now.gravity = world.scene.gravity;
        now.controls = controls;
        now.retractor.quaternion[0] = 1;
        now.feedback.struct_size = sizeof now.feedback;
        shaft.show(now);
        hand.remember(now);
        publish();
        if (setup.procedure) begin_procedure();
        if (!setup.until.empty() && std::none_of(state.tasks().begin(), state.tasks().end(),
                                                 [&](const auto& t) { return t.id == setup.until; })) {
            std::string known;
            for (const TaskState& t : state.tasks())
                known += (known.empty() ? "" : ", ") + t.id;
            throw host::UserError("--until", setup.until, "is no task of this procedure; choose " + known);
        }
    }

    ~Impl() {
        if (!is_procedure_active) return;
        try {
            call(setup.procedure, "procedure.deactivate", setup.procedure.instance->deactivate);
        } catch (const host::PluginError&) { // the case is over; there is nobody left to tell
        }
    }

    void begin_procedure() {
        const auto& f = functions<calot_procedure>(setup.procedure);
        calot_procedure_setup to{};
        to.struct_size = sizeof to;
        to.shaft_radius = shaft.endoscope().radii().back();
        to.shaft_length = shaft.endoscope().length();
        to.node_count = shaft.endoscope().nodes();
        to.start = &procedure_view.of(now);
        call(setup.procedure, "procedure.configure", f.configure, &to);
        calot_activation activation{};
        activation.struct_size = sizeof activation;
        activation.step_nanoseconds = procedure_period * 1'000'000;
        activation.seed = setup.seed;
        call(setup.procedure, "procedure.activate", setup.procedure.instance->activate, &activation);
        is_procedure_active = true;
    }

    void update_procedure() {
        const auto& f = functions<calot_procedure>(setup.procedure);
        call(setup.procedure, "procedure.update", f.update, &procedure_view.of(now), &state.commands());
    }

    void begin() {
        is_begun = true;
        host::blame().tick.store(0, std::memory_order_relaxed);
        for (Observer* o : observers)
            o->began(now);
        if (setup.procedure) update_procedure();
    }

    // Whether time stands still at this tick: asked for by the window, by the device, or it is unplugged.
    bool is_held() const {
        return is_pause_asked.load(std::memory_order_relaxed) || is_unplugged ||
               (controls.buttons & CALOT_BUTTON_PAUSE) != 0;
    }

    enum class Ticked { yes, paused, over };

    Ticked tick() {
        if (!is_begun) begin();
        const auto begin_time = std::chrono::steady_clock::now();
        host::blame().tick.store(now.tick, std::memory_order_relaxed);
        switch (hand.poll(now.tick, input, controls)) {
        case OperatorLink::Polled::over:
            end = End::replay_ended;
            return Ticked::over;
        case OperatorLink::Polled::unplugged:
            is_unplugged = true;
            break;
        case OperatorLink::Polled::ok:
            is_unplugged = false;
            break;
        }
        if (is_held()) {
            show_pause(true);
            return Ticked::paused;
        }
        if (now.is_paused) show_pause(false);
        const double device_seconds = setup.measure ? seconds_since(begin_time) : 0;

        hand.remember(now); // for the poll after this step
        const bool is_reset = now.fade >= 1 || (controls.buttons & CALOT_BUTTON_RESET) != 0;
        if (is_reset) {
            offset[0] += controls.insertion - now.controls.insertion;
            offset[1] += controls.rotation - now.controls.rotation;
        }
        now.controls = controls;
        hash_controls();
        if (now.fade < 1) {
            const std::array<double, 2> at{controls.insertion - offset[0], controls.rotation - offset[1]};
            shaft.step(now.tick, at, controls.wheel, controls.brake, now);
            const auto slip = shaft.take_slip();
            offset[0] += slip[0];
            offset[1] += slip[1];
        }
        now.hose_offset[0] = offset[0];
        now.hose_offset[1] = offset[1];
        ++now.tick;
        now.feedback.tick = now.tick;
        now.feedback.stopped = now.fade >= 1;
        hand.send(now.feedback);

        const auto procedure_begin = std::chrono::steady_clock::now();
        if (setup.procedure && now.tick % procedure_period == 0) {
            state.act(now.tick, now, [&](const Command& c) {
                for (Observer* o : observers)
                    o->commanded(now.tick, c);
            });
            if (!is_over()) update_procedure();
        }
        if (setup.measure) {
            now.cost.device = device_seconds;
            now.cost.procedure = seconds_since(procedure_begin);
            now.cost.total = seconds_since(begin_time);
        }
        publish();
        tell_observers();
        return is_over() ? Ticked::over : Ticked::yes;
    }

    bool is_over() {
        if (!setup.until.empty() && state.is_completed(setup.until)) {
            end = End::until;
            return true;
        }
        if (now.is_finished) end = End::finished;
        return now.is_finished;
    }

    void tell_observers() {
        if (observers.empty()) return;
        Hash shaft_hash;
        shaft_hash.add(std::span<const double>(now.position));
        shaft_hash.add(std::span<const double>(now.velocity));
        const std::uint64_t hash = shaft_hash.value();
        const auto mark = static_cast<std::uint32_t>(hash ^ (hash >> 32));
        for (Observer* o : observers) {
            o->ticked(now);
            o->marked(now.tick, mark);
        }
        if (now.tick % digest_period == 0)
            for (Observer* o : observers)
                o->digested(digest());
    }

    void hash_controls() {
        control_hash.add(controls.insertion);
        control_hash.add(controls.rotation);
        control_hash.add(std::span<const double>(controls.wheel));
        control_hash.add(std::uint64_t{controls.brake[0]} | std::uint64_t{controls.brake[1]} << 1 |
                         std::uint64_t{controls.pedals} << 8 | std::uint64_t{controls.buttons} << 16);
    }

    Digest digest() const {
        Hash rod;
        rod.add(std::span<const double>(now.position));
        rod.add(std::span<const double>(now.velocity));
        rod.add(std::span<const double>(now.frame));
        rod.add(std::span<const double>(now.angular_velocity));
        return {.tick = now.tick,
                .rod = rod.value(),
                .contacts = shaft.contact_hash(),
                .controls = control_hash.value(),
                .procedure = state.hash()};
    }

    // Time stands still: the hands feel nothing, and the window sees why nothing moves.
    void show_pause(bool on) {
        if (on) {
            calot_feedback nothing{};
            nothing.struct_size = sizeof nothing;
            nothing.tick = now.tick;
            nothing.stopped = 1;
            hand.send(nothing);
        }
        if (now.is_paused == on) return;
        now.is_paused = on;
        publish();
    }

    void publish() {
        Snapshot* slot = ring.begin();
        if (slot == nullptr) return;
        // Everything but the markers, whose copies are long and which seldom change, and unused contacts.
        const auto copy = [](auto& to, const auto& from) { to = from; };
        slot->tick = now.tick;
        copy(slot->position, now.position);
        copy(slot->velocity, now.velocity);
        copy(slot->frame, now.frame);
        copy(slot->angular_velocity, now.angular_velocity);
        slot->insertion = now.insertion;
        slot->rotation = now.rotation;
        std::copy_n(now.bending, 2, slot->bending);
        slot->bending_energy = now.bending_energy;
        slot->twist_energy = now.twist_energy;
        slot->kinetic_energy = now.kinetic_energy;
        slot->camera = now.camera;
        slot->camera_twist = now.camera_twist;
        slot->retractor = now.retractor;
        slot->controls = now.controls;
        slot->feedback = now.feedback;
        std::copy_n(now.hose_offset, 2, slot->hose_offset);
        std::copy_n(now.contact.begin(), now.contact_count, slot->contact.begin());
        slot->contact_count = now.contact_count;
        slot->contacts_left_out = now.contacts_left_out;
        slot->tissue_force = now.tissue_force;
        slot->self_force = now.self_force;
        if (slot->markers.generation != now.markers.generation) {
            slot->markers.generation = now.markers.generation;
            slot->markers.count = now.markers.count;
            std::copy_n(now.markers.marker.begin(), now.markers.count, slot->markers.marker.begin());
        }
        slot->task = now.task;
        slot->message = now.message;
        slot->fade = now.fade;
        slot->gravity = now.gravity;
        slot->is_paused = now.is_paused;
        slot->is_finished = now.is_finished;
        slot->penetration = now.penetration;
        slot->late = now.late;
        slot->cost = now.cost;
        ring.publish();
    }

    void end_case() {
        calot_feedback nothing{};
        nothing.struct_size = sizeof nothing;
        nothing.tick = now.tick;
        nothing.stopped = 1;
        hand.send(nothing);
    }

    Outcome outcome(double wall_seconds) const {
        Outcome o;
        o.end = end;
        o.ticks = now.tick;
        o.wall_seconds = wall_seconds;
        o.real_time_factor = wall_seconds > 0 ? now.seconds() / wall_seconds : 0;
        o.late = now.late;
        o.penetration = now.penetration;
        o.tasks = state.tasks();
        o.is_completed =
            setup.until.empty() ? state.are_required_completed() : state.is_completed(setup.until);
        return o;
    }
};

Simulation::Simulation(Setup setup) {
    if (!setup.world || !setup.rod) throw std::invalid_argument("a simulation needs a world and a rod");
    Shaft::Start start = drawn_start(*setup.world, setup.start, setup.seed);
    start.instruments = setup.instruments;
    impl_ = std::make_unique<Impl>(std::move(setup), start);
}

Simulation::~Simulation() = default;

void Simulation::add_observer(Observer& observer) {
    impl_->observers.push_back(&observer);
}

bool Simulation::step() {
    return impl_->tick() != Impl::Ticked::over;
}

Outcome Simulation::run(const RunOptions& options) {
    Impl& s = *impl_;
    const auto tell_end = [&] {
        for (Observer* o : s.observers) {
            if (s.now.tick % digest_period != 0) o->digested(s.digest());
            o->ended(s.now);
        }
    };
    // What the caller does after the run is ordinary again.
    struct FirstPlace {
        bool is_held = false;
        ~FirstPlace() {
            if (is_held) schedule_ordinarily(pthread_self());
        }
    } place;
    if (options.speed == Speed::realtime && schedule_first(pthread_self())) {
        place.is_held = s.now.late.is_first = true;
        s.shaft.schedule_first();
    }
    Pacer pacer(options.speed == Speed::realtime);
    double wall_seconds = 0;
    auto resumed = std::chrono::steady_clock::now();
    bool was_paused = false;
    try {
        for (;;) {
            if (s.is_stop_asked.load(std::memory_order_relaxed)) {
                s.end = End::stopped;
                break;
            }
            if (s.now.tick >= options.max_ticks) {
                s.end = End::time_limit;
                break;
            }
            if (!was_paused) pacer.wait();
            const auto ticked = s.tick();
            if (ticked == Impl::Ticked::over) break;
            if (ticked == Impl::Ticked::paused) {
                if (!was_paused) wall_seconds += seconds_since(resumed);
                was_paused = true;
                std::this_thread::sleep_for(std::chrono::milliseconds(1));
                continue;
            }
            if (was_paused) {
                was_paused = false;
                resumed = std::chrono::steady_clock::now();
                pacer.restart();
            }
            pacer.ended(s.now.late);
        }
        s.end_case();
    } catch (const host::PluginError& error) {
        tell_end();
        if (error.plugin != s.setup.device.id) s.end_case(); // the hands feel nothing any more
        throw;
    }
    if (!was_paused) wall_seconds += seconds_since(resumed);
    tell_end();
    return s.outcome(wall_seconds);
}

SnapshotRing::View Simulation::latest() const {
    return impl_->ring.latest();
}

InputQueue& Simulation::input() {
    return impl_->input;
}

void Simulation::pause(bool on) {
    impl_->is_pause_asked.store(on, std::memory_order_relaxed);
}

void Simulation::stop() {
    impl_->is_stop_asked.store(true, std::memory_order_relaxed);
}

const World& Simulation::world() const {
    return impl_->world;
}

const std::vector<TaskState>& Simulation::tasks() const {
    return impl_->state.tasks();
}

std::vector<std::pair<std::string, std::string>> Simulation::device_help() const {
    return impl_->hand.help();
}

Digest Simulation::digest() const {
    return impl_->digest();
}

} // namespace calot::simulation

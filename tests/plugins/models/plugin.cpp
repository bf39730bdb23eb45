// One tiny model of each kind: what a host is tried on where mechanics don't matter.
#include "../rigid_rod.hpp"

#include <calot/plugin.hpp>

#include <algorithm>
#include <string>
#include <vector>

namespace {

class RigidTissue final : public calot::Tissue {
  public:
    void configure(const calot_tissue_setup& setup) override {
        const auto p = calot::span(setup.position);
        position_.assign(p.begin(), p.end());
        const auto s = calot::span(setup.surface);
        surface_.assign(s.begin(), s.end());
        const auto r = calot::span(setup.surface_region);
        region_.assign(r.begin(), r.end());
    }
    void reset(std::uint64_t) override {}
    void save(calot::StateWriter& to) const override { to.values(position_); }
    void load(calot::StateReader& from) override { from.values(position_); }
    calot::Result step(const calot_tissue_input&, calot_tissue_output& output) override {
        return read(output);
    }
    calot::Result read(calot_tissue_output& output) override {
        copy(position_, calot::span(output.position));
        std::ranges::fill(calot::span(output.velocity), 0.0);
        std::ranges::fill(calot::span(output.anchor_force), 0.0);
        copy(surface_, calot::span(output.surface));
        copy(region_, calot::span(output.surface_region));
        for (calot_structs_out* list : {&output.dirty, &output.reactions, &output.events, &output.leaks,
                                        &output.removed, &output.added, &output.new_vertices})
            list->count = 0;
        output.vertex_count = static_cast<std::uint32_t>(position_.size() / 3);
        output.triangle_count = static_cast<std::uint32_t>(surface_.size() / 3);
        output.generation = 0;
        output.kinetic_energy = output.elastic_energy = output.gravity_energy = 0;
        return calot::Result::ok();
    }
    calot::Result answer(calot_structs_out& answers) override {
        for (std::size_t i = 0; i < answers.count; ++i) {
            auto& a = calot::item<calot_surface_answer>(answers, i);
            if (a.triangle >= surface_.size() / 3)
                return calot::Result::discard(CALOT_CODE_OUT_OF_RANGE, "answers.triangle", "is not there");
            calot::Vec3 point;
            for (int k = 0; k < 3; ++k)
                point += a.weight[k] * calot::vec3(&position_[3 * surface_[3 * a.triangle + k]]);
            calot::store(point, a.free_position);
            std::fill(std::begin(a.compliance), std::end(a.compliance), 0.0);
        }
        return calot::Result::ok();
    }
    calot::Result closest(const double point[3], std::uint32_t& triangle, double weight[3]) override {
        double best = -1;
        for (std::size_t i = 0; i < surface_.size(); ++i) {
            const double d = norm(calot::vec3(&position_[3 * surface_[i]]) - calot::vec3(point));
            if (best >= 0 && d >= best) continue;
            best = d;
            triangle = static_cast<std::uint32_t>(i / 3);
            for (std::size_t k = 0; k < 3; ++k)
                weight[k] = k == i % 3;
        }
        return calot::Result::ok();
    }

  private:
    template<class T>
    static void copy(const std::vector<T>& from, std::span<T> to) {
        std::copy_n(from.begin(), std::min(from.size(), to.size()), to.begin());
    }
    std::vector<double> position_;
    std::vector<std::uint32_t> surface_, region_;
};

class Probe final : public calot::Instrument {
  public:
    void sheet(calot_instrument_sheet& out) override {
        out.title = calot::string("Test: a straight probe");
        out.flags = 0;
        out.part_count = 1, out.shape_count = 1, out.reserved = 0;
        out.diameter = 0.002, out.max_insertion = max_insertion, out.max_opening = 0, out.max_speed = 0.1;
        out.stiffness = 0;
    }
    void part(std::uint32_t, calot_part& out) override {
        static constexpr double position[] = {0.001, 0, 0, -0.001, 0.001, 0, -0.001, -0.001, 0, 0, 0, -0.05};
        static constexpr std::uint32_t triangles[] = {0, 1, 2, 0, 3, 1, 1, 3, 2, 2, 3, 0};
        out.name = calot::string("rod"), out.material = calot::string("steel");
        out.position = calot::reals(position), out.triangles = calot::indices(triangles);
    }
    void configure(const calot_instrument_setup&) override {}
    void reset(std::uint64_t) override { insertion_ = 0; }
    void save(calot::StateWriter& to) const override { to.value(insertion_); }
    void load(calot::StateReader& from) override { from.value(insertion_); }
    calot::Result step(const calot_instrument_input& input, calot_instrument_output& output) override {
        if (output.shapes.capacity < 1 || output.parts.capacity < 1)
            return calot::Result::error(CALOT_CODE_CAPACITY, "output.shapes", "has no room");
        insertion_ = calot::clamp(input.insertion, -max_insertion, max_insertion);
        calot_capsule shape{};
        calot::store(calot::vec3(input.mount.position), shape.from);
        calot::store(calot::to_world(input.mount, {0, 0, std::max(insertion_, 0.0)}), shape.to);
        shape.radius = 0.001;
        output.shapes.count = output.parts.count = output.actions.count = 0;
        calot::append(output.shapes, shape);
        calot_pose part = input.mount;
        calot::store(calot::vec3(shape.to), part.position);
        calot::append(output.parts, part);
        std::ranges::fill(calot::span(output.contact_impulse), 0.0);
        output.mount = {};
        output.insertion = insertion_, output.opening = 0, output.rotation = 0, output.smoke = 0;
        return calot::Result::ok();
    }

  private:
    static constexpr double max_insertion = 0.05; // m
    double insertion_ = 0;
};

class Pusher final : public calot::Device {
  public:
    void sheet(calot_device_sheet& out) override {
        const auto size = out.struct_size;
        out = {};
        out.struct_size = size;
        out.title = calot::string("Test: pushes at a steady speed");
        out.in_lockstep = 1;
        out.rate = 1000;
    }
    void configure(const calot_controls& start) override { start_ = insertion_ = start.insertion; }
    void activate(const calot_activation& a) override {
        step_ = 1e-9 * static_cast<double>(a.step_nanoseconds);
    }
    void reset(std::uint64_t) override { insertion_ = start_; }
    void save(calot::StateWriter& to) const override { to.value(insertion_); }
    void load(calot::StateReader& from) override { from.value(insertion_); }
    std::span<const calot::Parameter> parameters() const override {
        static constexpr calot::Parameter table[] = {{.id = "speed",
                                                      .title = "Speed",
                                                      .unit = "m/s",
                                                      .minimum = -0.1,
                                                      .maximum = 0.1,
                                                      .initial = 0.01}};
        return table;
    }
    calot::Result poll(std::int64_t, calot_controls& out) override {
        insertion_ += parameter(0) * step_;
        out.insertion = insertion_;
        return calot::Result::ok();
    }
    calot::Result send(const calot_feedback&) override { return calot::Result::ok(); }

  private:
    double start_ = 0, insertion_ = 0, step_ = 0.001;
};

class PushIn final : public calot::Procedure {
  public:
    std::string scene() override {
        return "format = 1\n[start.default]\npath = \"path\"\ninsertion = 0.14\n";
    }
    std::span<const calot::TaskInfo> tasks() const override {
        static constexpr calot::TaskInfo table[] = {
            {"push", "Push in", "Push the endoscope in by 10 mm.", true}};
        return table;
    }
    std::span<const calot::MetricInfo> metrics() const override {
        static constexpr calot::MetricInfo table[] = {
            {"pushed", "Pushed", "m", "How far the shaft was pushed in when the task was completed.",
             "push"}};
        return table;
    }
    void configure(const calot_procedure_setup& setup) override { start_ = setup.start->controls.insertion; }
    void reset(std::uint64_t) override { is_begun_ = is_done_ = false; }
    void save(calot::StateWriter& to) const override { to.value(is_begun_), to.value(is_done_); }
    void load(calot::StateReader& from) override { from.value(is_begun_), from.value(is_done_); }
    calot::Result update(const calot_snapshot& snapshot, calot::Commands& commands) override {
        if (!is_begun_) is_begun_ = commands.begin_task("push");
        const double pushed = snapshot.controls.insertion - start_;
        if (is_done_ || pushed < 0.01) return calot::Result::ok();
        is_done_ =
            commands.metric("pushed", pushed, "push") && commands.complete_task("push") && commands.finish();
        return calot::Result::ok();
    }

  private:
    double start_ = 0;
    bool is_begun_ = false, is_done_ = false;
};

} // namespace

CALOT_PLUGIN(calot::export_rod<calot_test::RigidRod>("org.calot.test.rod", "Test: a rigid straight rod",
                                                     "0.1.0"),
             calot::export_tissue<RigidTissue>("org.calot.test.tissue", "Test: a body that never moves",
                                               "0.1.0"),
             calot::export_instrument<Probe>("org.calot.test.instrument", "Test: a straight probe", "0.1.0"),
             calot::export_device<Pusher>("org.calot.test.device", "Test: pushes at a steady speed", "0.1.0"),
             calot::export_procedure<PushIn>("org.calot.test.procedure", "Test: push in by 10 mm", "0.1.0"))

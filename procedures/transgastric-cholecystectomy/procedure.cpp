#include "procedure.hpp"

namespace calot::transgastric {
namespace {

constexpr std::string_view navigation = "navigation";

constexpr TaskInfo task_table[] = {
    {navigation, "Navigation",
     "Find the red ring on the anterior wall of the stomach and pass through it into the abdomen.", true},
};

constexpr MetricInfo metric_table[] = {
    {"time-to-stomach", "Time to the stomach", "s",
     "From the start of the case until the tip passes the lower end of the oesophagus.", navigation},
    {"time-to-incision", "Time to the incision", "s",
     "From then until the tip first passes through the ring.", navigation},
    {"path-deviation", "Deviation from the path", "m",
     "Mean distance of the tip from the marked path until the tip first passes through the ring.",
     navigation},
    {"incision-offset", "Offset in the incision", "m",
     "Distance between the ring's centre and the axis of the shaft in it, when the task is completed.",
     navigation},
};

calot_marker marker(std::string_view id, std::uint32_t kind, bool is_done) {
    // The rest (place, size, colour) comes from the scene's marker with this id.
    calot_marker m{};
    m.id = string(id);
    m.kind = kind;
    m.is_done = is_done;
    return m;
}

} // namespace

void TransgastricCholecystectomy::init() {
    scene_ = host().assets().text("scene.toml");
}

std::span<const TaskInfo> TransgastricCholecystectomy::tasks() const {
    return task_table;
}
std::span<const MetricInfo> TransgastricCholecystectomy::metrics() const {
    return metric_table;
}

void TransgastricCholecystectomy::configure(const calot_procedure_setup& setup) {
    navigation_.configure(SnapshotView(*setup.start));
    told_ = Told::nothing;
}

void TransgastricCholecystectomy::activate(const calot_activation& activation) {
    reset(activation.seed);
}

void TransgastricCholecystectomy::reset(std::uint64_t) {
    navigation_.reset();
    told_ = Told::nothing;
}

void TransgastricCholecystectomy::save(StateWriter& to) const {
    to.value(told_);
    navigation_.save(to);
}

void TransgastricCholecystectomy::load(StateReader& from) {
    from.value(told_);
    if (told_ > Told::finished) StateReader::corrupt("has an unknown stage");
    navigation_.load(from);
}

Result TransgastricCholecystectomy::update(const calot_snapshot& snapshot, Commands& commands) {
    navigation_.update(snapshot.tick, SnapshotView(snapshot));
    while (tell_next(commands)) {
    }
    return Result::ok();
}

// One step on, if its time has come and the queue takes it.
bool TransgastricCholecystectomy::tell_next(Commands& commands) {
    const auto next = static_cast<Told>(static_cast<std::uint32_t>(told_) + 1);
    bool is_told = false;
    switch (next) {
    case Told::task:
        is_told = commands.begin_task(navigation);
        break;
    case Told::way:
        is_told = commands.set_marker(marker("way", CALOT_MARKER_PATH, false));
        break;
    case Told::ring:
        is_told = commands.set_marker(marker("viscerotomy", CALOT_MARKER_RING, false));
        break;
    case Told::goal:
        is_told = commands.message(task_table[0].goal, 8);
        break;
    case Told::stomach:
        // A tip that is through has passed the stomach, wherever the anatomy says that it begins.
        if (navigation_.is_in_stomach())
            is_told = commands.message("You are in the stomach: steer to the red ring.", 5);
        else
            is_told = navigation_.is_tip_through();
        break;
    case Told::through:
        is_told = navigation_.is_tip_through() &&
                  commands.message("Through the incision: push on until the bending section is free.", 5);
        break;
    case Told::metrics:
        is_told = navigation_.is_done() &&
                  (!navigation_.is_in_stomach() ||
                   (commands.metric("time-to-stomach", navigation_.stomach_seconds(), navigation) &&
                    commands.metric("time-to-incision", navigation_.search_seconds(), navigation))) &&
                  commands.metric("path-deviation", navigation_.path_deviation(), navigation) &&
                  commands.metric("incision-offset", navigation_.ring_offset(), navigation);
        break;
    case Told::ring_done:
        is_told = commands.set_marker(marker("viscerotomy", CALOT_MARKER_RING, true));
        break;
    case Told::done:
        is_told = commands.complete_task(navigation);
        break;
    case Told::finished:
        is_told = commands.finish();
        break;
    default:
        return false;
    }
    if (is_told) told_ = next;
    return is_told;
}

} // namespace calot::transgastric

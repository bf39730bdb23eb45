#include "simulation/case_state.hpp"

#include "simulation/plugin_call.hpp"

#include <calot/math.hpp>

#include <algorithm>

namespace calot::simulation {

namespace {

constexpr std::uint32_t most_tasks = 64;
const char* const update_name = "procedure.update";

std::string text_of(calot_string s) {
    return std::string(view(s));
}

bool is_zero(std::span<const double> values) {
    return std::all_of(values.begin(), values.end(), [](double v) { return v == 0; });
}

} // namespace

CaseState::CaseState(const World& world, const Plugin& procedure, Snapshot& snapshot)
    : world_(world), procedure_(procedure), queue_(most_commands) {
    abi_ = {.struct_size = sizeof abi_, .self = this, .push = &CaseState::push};
    if (procedure) {
        const auto& f = functions<calot_procedure>(procedure);
        const std::uint32_t count = f.task_count(procedure.instance->self);
        if (count > most_tasks)
            fail(procedure, "procedure.task_count", CALOT_OK, CALOT_CODE_OUT_OF_RANGE, "",
                 "has more than " + std::to_string(most_tasks) + " tasks");
        for (std::uint32_t i = 0; i < count; ++i) {
            calot_task task{};
            task.struct_size = sizeof task;
            call(procedure, "procedure.task", f.task, i, &task);
            TaskState state;
            state.id = text_of(task.id);
            state.title = text_of(task.title);
            state.goal = text_of(task.goal);
            state.is_required = task.is_required != 0;
            tasks_.push_back(std::move(state));
        }
    }
    for (const SceneMarker& scene : world.scene.markers) {
        if (!scene.is_shown) continue;
        Marker marker;
        marker.id = scene.id;
        marker.kind = scene.kind;
        set_marker(marker, snapshot.markers);
    }
}

calot_status CaseState::push(void* self, const calot_command* command) {
    auto& state = *static_cast<CaseState*>(self);
    if (state.count_ == state.queue_.size() || command == nullptr) return CALOT_ERROR;
    Command& c = state.queue_[state.count_];
    c.kind = command->kind;
    c.id = view(command->id);
    c.text = view(command->text);
    c.value = command->value;
    std::copy_n(command->vector, 3, c.vector.begin());
    c.pose = command->pose;
    c.marker.points.clear();
    if (!std::isfinite(c.value) || !all_finite(c.vector) || !all_finite(c.pose.position) ||
        !all_finite(c.pose.quaternion))
        return CALOT_ERROR;
    if (c.kind == CALOT_COMMAND_MARKER_SET) {
        if (command->marker == nullptr) return CALOT_ERROR;
        const calot_marker& from = *command->marker;
        Marker& m = c.marker;
        m.id = view(from.id);
        m.kind = from.kind;
        m.is_done = from.is_done != 0;
        std::copy_n(from.position, 3, m.position.begin());
        std::copy_n(from.normal, 3, m.normal.begin());
        m.radius = from.radius;
        std::copy_n(from.colour, 4, m.colour.begin());
        const std::span points(from.polyline.data, from.polyline.size);
        if (points.size() % 3 != 0 || points.size() > 3 * Marker::most_points || !all_finite(points) ||
            !all_finite(m.position) || !all_finite(m.normal) || !all_finite(m.colour) ||
            !std::isfinite(m.radius))
            return CALOT_ERROR;
        m.points.assign(points.begin(), points.end());
    }
    ++state.count_;
    return CALOT_OK;
}

TaskState& CaseState::task(const Command& command) {
    for (TaskState& task : tasks_)
        if (task.id == command.id.view()) return task;
    fail(procedure_, update_name, CALOT_OK, CALOT_CODE_INVALID_ARGUMENT, "command.id",
         "\"" + std::string(command.id.view()) + "\" is none of the procedure's tasks");
}

void CaseState::apply(const Command& c, std::int64_t tick, Snapshot& s) {
    hash_.add(static_cast<std::uint64_t>(tick));
    hash_.add(static_cast<std::uint64_t>(c.kind));
    hash_.add(c.id.view());
    hash_.add(c.text.view());
    hash_.add(c.value);
    hash_.add(std::span<const double>(c.vector));
    switch (c.kind) {
    case CALOT_COMMAND_MARKER_SET:
        set_marker(c.marker, s.markers);
        break;
    case CALOT_COMMAND_MARKER_REMOVE: {
        // Swapped to the end rather than erased: every marker keeps the memory of its points.
        auto* begin = s.markers.marker.data();
        auto* end = begin + s.markers.count;
        auto* found = std::find_if(begin, end, [&](const Marker& m) { return m.id.view() == c.id.view(); });
        if (found == end) break;
        std::rotate(found, found + 1, end);
        --s.markers.count;
        ++s.markers.generation;
        break;
    }
    case CALOT_COMMAND_TASK_BEGIN: {
        TaskState& t = task(c);
        t.is_begun = true;
        t.begin_tick = tick;
        s.task = t.id;
        break;
    }
    case CALOT_COMMAND_TASK_COMPLETE: {
        TaskState& t = task(c);
        if (!t.is_begun) t.begin_tick = 0;
        t.is_begun = t.is_completed = true;
        t.end_tick = tick;
        if (s.task.view() == t.id) s.task = "";
        break;
    }
    case CALOT_COMMAND_MESSAGE:
        s.message = c.text.view();
        message_end_ = tick + static_cast<std::int64_t>(std::clamp(c.value, 0.0, 3600.0) * 1000);
        break;
    case CALOT_COMMAND_GRAVITY:
        s.gravity = c.vector;
        break;
    case CALOT_COMMAND_FADE:
        s.fade = std::clamp(c.value, 0.0, 1.0);
        break;
    case CALOT_COMMAND_FINISH:
        s.is_finished = true;
        break;
    case CALOT_COMMAND_METRIC:
    case CALOT_COMMAND_EVENT:
    case CALOT_COMMAND_ASSISTANT:
    case CALOT_COMMAND_FAILURE:
        break; // for the observers
    default:
        fail(procedure_, update_name, CALOT_OK, CALOT_CODE_INVALID_ARGUMENT, "command.kind",
             std::to_string(c.kind) + " is no command");
    }
}

// Fills what the procedure left at zero from the scene.
void CaseState::show(const SceneMarker& scene, Marker& m) const {
    const Landmark* landmark = world_.anatomy.find(scene.landmark);
    if (m.kind == 0) m.kind = scene.kind;
    if (is_zero(m.colour)) m.colour = scene.colour;
    if (landmark == nullptr) return;
    if (landmark->pose) {
        if (is_zero(m.position)) std::copy_n(landmark->pose->position, 3, m.position.begin());
        if (is_zero(m.normal)) {
            const Vec3 z = rotate(quat(landmark->pose->quaternion), {0, 0, 1});
            m.normal = {z.x, z.y, z.z};
        }
    }
    if (m.radius == 0) m.radius = landmark->radius;
    if (m.points.empty() && (m.kind == CALOT_MARKER_PATH || m.kind == CALOT_MARKER_LINE))
        for (const geometry::Vec3& p : landmark->points)
            m.points.insert(m.points.end(), {p.x, p.y, p.z});
}

void CaseState::set_marker(const Marker& marker, MarkerSet& markers) {
    auto* begin = markers.marker.data();
    auto* end = begin + markers.count;
    auto* found = std::find_if(begin, end, [&](const Marker& m) { return m.id.view() == marker.id.view(); });
    if (found == end) {
        if (markers.count == MarkerSet::most)
            fail(procedure_, update_name, CALOT_OK, CALOT_CODE_CAPACITY, "command.marker",
                 "there are " + std::to_string(MarkerSet::most) + " markers already; remove one first");
        ++markers.count;
    }
    *found = marker;
    for (const SceneMarker& scene : world_.scene.markers)
        if (scene.id == marker.id.view()) show(scene, *found);
    ++markers.generation;
}

bool CaseState::is_completed(std::string_view id) const {
    return std::any_of(tasks_.begin(), tasks_.end(),
                       [&](const TaskState& t) { return t.id == id && t.is_completed; });
}

bool CaseState::are_required_completed() const {
    return !tasks_.empty() && std::all_of(tasks_.begin(), tasks_.end(), [](const TaskState& t) {
        return t.is_completed || !t.is_required;
    });
}

} // namespace calot::simulation

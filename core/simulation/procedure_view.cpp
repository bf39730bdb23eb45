#include "simulation/procedure_view.hpp"

#include "simulation/plugin_call.hpp"

#include <calot/math.hpp>

#include <algorithm>

namespace calot::simulation {

namespace {

template<class Struct>
calot_structs none() {
    return {nullptr, 0, sizeof(Struct)};
}

} // namespace

ProcedureView::ProcedureView(const World& world) : world_(world) {
    for (const Landmark& l : world.anatomy.landmarks) {
        auto& line = polylines_.emplace_back();
        for (const geometry::Vec3& p : l.points)
            line.insert(line.end(), {p.x, p.y, p.z});
    }
    abi_.struct_size = sizeof abi_;
    abi_.self = this;
    abi_.clips = none<calot_clip>();
    abi_.leaks = none<calot_leak>();
    abi_.events = none<calot_tissue_event>();
    abi_.strands = none<calot_seen_strand>();
    abi_.instruments = none<calot_seen_instrument>();
    abi_.actions = none<calot_action>();
    abi_.pose = &ProcedureView::pose;
    abi_.landmark = &ProcedureView::landmark;
    abi_.organ = &ProcedureView::organ;
    abi_.quantity = &ProcedureView::quantity;
}

const calot_snapshot& ProcedureView::of(const Snapshot& s) {
    abi_.tick = s.tick;
    abi_.tip = s.camera;
    abi_.tip_twist = s.camera_twist;
    abi_.retractor = s.retractor;
    abi_.controls = s.controls;
    abi_.feedback = s.feedback;
    abi_.centreline = {s.position.data(), s.position.size()};
    abi_.velocity = {s.velocity.data(), s.velocity.size()};
    abi_.contacts = {s.contact.data(), s.contact_count, sizeof(calot_contact_report)};
    return abi_;
}

std::uint32_t ProcedureView::pose(void* self, calot_string id, calot_pose* out) {
    const Landmark* l = static_cast<ProcedureView*>(self)->world_.anatomy.find(view(id));
    if (l == nullptr || !l->pose) return 0;
    *out = *l->pose;
    return 1;
}

std::uint32_t ProcedureView::landmark(void* self, calot_string id, calot_marker* out) {
    const auto& v = *static_cast<ProcedureView*>(self);
    const Landmark* l = v.world_.anatomy.find(view(id));
    if (l == nullptr) return 0;
    const std::uint64_t size = out->struct_size;
    *out = {};
    out->struct_size = size;
    out->id = {l->id.data(), l->id.size()};
    if (l->pose) {
        std::copy_n(l->pose->position, 3, out->position);
        store(rotate(quat(l->pose->quaternion), {0, 0, 1}), out->normal);
    }
    out->radius = l->radius;
    const auto& line = v.polylines_[static_cast<std::size_t>(l - v.world_.anatomy.landmarks.data())];
    out->polyline = {line.data(), line.size()};
    return 1;
}

std::uint32_t ProcedureView::organ(void* self, calot_string id) {
    const auto& organs = static_cast<ProcedureView*>(self)->world_.anatomy.organs;
    for (std::size_t i = 0; i < organs.size(); ++i)
        if (organs[i].id == view(id)) return static_cast<std::uint32_t>(i);
    return UINT32_MAX;
}

// Blood, bile, smoke and gas come with the tissues that can be cut; there are none yet to ask for.
std::uint32_t ProcedureView::quantity(void*, calot_string, double*) {
    return 0;
}

} // namespace calot::simulation

#include "cases/step_codec.hpp"

#include "cases/journal.hpp"

#include <bit>
#include <cstring>

namespace calot::cases {

namespace {

// Visits every field of the controls in order; `Controls` may be const.
template<class Controls, class Visit>
void visit_fields(Controls& c, Visit visit) {
    visit(c.insertion), visit(c.rotation);
    visit(c.wheel[0]), visit(c.wheel[1]);
    visit(c.brake[0]), visit(c.brake[1]);
    for (auto& p : c.port)
        visit(p.instrument), visit(p.trigger), visit(p.insertion), visit(p.opening), visit(p.rotation);
    visit(c.pedals), visit(c.buttons);
    visit(c.suction), visit(c.air), visit(c.water);
    for (auto& v : c.retractor.position)
        visit(v);
    for (auto& v : c.retractor.quaternion)
        visit(v);
    visit(c.retractor_grip);
    visit(c.table_tilt[0]), visit(c.table_tilt[1]);
}

static_assert(std::endian::native == std::endian::little, "the journal is written as the processor has it");

} // namespace

ControlWords words_of(const calot_controls& controls) {
    ControlWords words{};
    std::size_t at = 0;
    visit_fields(controls, [&](const auto& field) {
        std::memcpy(&words[at++], &field, sizeof field); // 4 or 8 bytes
    });
    return words;
}

calot_controls controls_of(const ControlWords& words) {
    calot_controls controls{};
    controls.struct_size = sizeof controls;
    std::size_t at = 0;
    visit_fields(controls, [&](auto& field) { std::memcpy(&field, &words[at++], sizeof field); });
    return controls;
}

std::size_t append_step(const ControlWords& before, const ControlWords& now, std::uint32_t mark, char* out) {
    std::uint64_t changed = 0;
    for (std::size_t i = 0; i < control_fields; ++i)
        if (before[i] != now[i]) changed |= std::uint64_t{1} << i;
    char* at = out;
    std::uint64_t rest = changed;
    do {
        *at++ = static_cast<char>((rest & 0x7f) | (rest > 0x7f ? 0x80 : 0));
        rest >>= 7;
    } while (rest != 0);
    for (std::size_t i = 0; i < control_fields; ++i)
        if (changed >> i & 1) {
            std::memcpy(at, &now[i], 8);
            at += 8;
        }
    std::memcpy(at, &mark, 4);
    return static_cast<std::size_t>(at + 4 - out);
}

bool StepDecoder::next(calot_controls& controls, std::uint32_t& mark) {
    if (left_.empty() || is_broken_) return false;
    is_broken_ = true; // until all of the step was read
    std::uint64_t changed = 0;
    std::size_t at = 0;
    for (int shift = 0;; shift += 7) {
        if (at == left_.size() || shift > 35) return false;
        const auto byte = static_cast<unsigned char>(left_[at++]);
        changed |= std::uint64_t{byte & 0x7fu} << shift;
        if ((byte & 0x80) == 0) break;
    }
    if (changed >> control_fields != 0) return false;
    const std::size_t needed = 8 * static_cast<std::size_t>(std::popcount(changed)) + 4;
    if (left_.size() - at < needed) return false;
    for (std::size_t i = 0; i < control_fields; ++i)
        if (changed >> i & 1) {
            std::memcpy(&word_[i], left_.data() + at, 8);
            at += 8;
        }
    std::memcpy(&mark, left_.data() + at, 4);
    left_.remove_prefix(at + 4);
    controls = controls_of(word_);
    is_broken_ = false;
    return true;
}

} // namespace calot::cases

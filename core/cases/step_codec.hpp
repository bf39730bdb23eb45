// A tick's controls as the fields that changed: how the journal keeps them small.
#pragma once

#include <calot/abi/device.h>

#include <array>
#include <cstdint>

namespace calot::cases {

constexpr std::size_t control_fields = 36;
using ControlWords = std::array<std::uint64_t, control_fields>;

/// Every field of the controls as 64 bits, in the order in which calot_controls has them.
ControlWords words_of(const calot_controls& controls);
calot_controls controls_of(const ControlWords& words);

/// The most bytes that append_step writes.
constexpr std::size_t most_step_bytes = 6 + control_fields * 8 + 4;

/// Writes which fields differ from `before` (a varint of bits), these, and the mark. Returns the bytes'
/// count.
std::size_t append_step(const ControlWords& before, const ControlWords& now, std::uint32_t mark, char* out);

} // namespace calot::cases

// A 64-bit hash of bits, for comparing states: four lanes of multiply and fold. Not for security.
#pragma once

#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>

namespace calot::simulation {

class Hash {
  public:
    void add(std::uint64_t word) {
        std::uint64_t& lane = lane_[at_++ & 3];
        lane = (lane ^ word) * 0x9e3779b97f4a7c15ull; // 2^64 over the golden ratio, odd
        lane ^= lane >> 32;
    }
    void add(double value) {
        std::uint64_t word;
        std::memcpy(&word, &value, sizeof word);
        add(word);
    }
    void add(std::span<const double> values) {
        for (const double v : values)
            add(v);
    }
    void add(std::string_view text) {
        add(static_cast<std::uint64_t>(text.size()));
        for (const char c : text)
            add(static_cast<std::uint64_t>(static_cast<unsigned char>(c)));
    }
    std::uint64_t value() const {
        Hash end;
        for (const std::uint64_t lane : lane_) {
            end.lane_[0] = (end.lane_[0] ^ lane) * 0xff51afd7ed558ccdull; // as MurmurHash3's finaliser
            end.lane_[0] ^= end.lane_[0] >> 33;
        }
        return end.lane_[0] ^ at_;
    }

  private:
    std::uint64_t lane_[4] = {0x243f6a8885a308d3ull, 0x13198a2e03707344ull, 0xa4093822299f31d0ull,
                              0x082efa98ec4e6c89ull}; // the digits of pi
    std::uint64_t at_ = 0;
};

} // namespace calot::simulation

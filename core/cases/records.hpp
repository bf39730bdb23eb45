// How the journal's records lie in the file; see journal.hpp.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

namespace calot::cases {

inline constexpr std::string_view journal_magic = "CALOTCAS";
inline constexpr std::uint32_t journal_version = 1;
inline constexpr std::size_t preamble_bytes = 16, frame_bytes = 12;
inline constexpr std::size_t most_record_bytes = 1 << 20;

enum class RecordType : std::uint32_t {
    header = 1,  // u32 count, then key and value, each u32 length and bytes
    steps = 2,   // u64 first tick, u32 count, then the steps (step_codec.hpp)
    digest = 3,  // i64 tick, four u64
    command = 4, // i64 tick, u32 kind, f64 value, id and text, each u32 length and bytes
    end = 5      // i64 tick
};

/// CRC-32 of IEEE 802.3 (reflected, 0xedb88320), going on from `crc`; begin with 0.
inline std::uint32_t crc32(std::string_view bytes, std::uint32_t crc = 0) {
    static constexpr auto table = [] {
        std::array<std::uint32_t, 256> t{};
        for (std::uint32_t i = 0; i < 256; ++i) {
            std::uint32_t v = i;
            for (int k = 0; k < 8; ++k)
                v = v >> 1 ^ (v & 1 ? 0xedb88320u : 0u);
            t[i] = v;
        }
        return t;
    }();
    crc = ~crc;
    for (const char c : bytes)
        crc = table[(crc ^ static_cast<unsigned char>(c)) & 0xff] ^ crc >> 8;
    return ~crc;
}

template<class T>
void put(std::string& out, T value) {
    out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// Takes values off the front of bytes that may be hostile: past their end everything is zero, and is_short.
class Taker {
  public:
    explicit Taker(std::string_view bytes) : left_(bytes) {}
    template<class T>
    T take() {
        T value{};
        if (left_.size() < sizeof value) {
            is_short_ = true;
            left_ = {};
            return value;
        }
        std::memcpy(&value, left_.data(), sizeof value);
        left_.remove_prefix(sizeof value);
        return value;
    }
    std::string_view text() {
        const auto size = take<std::uint32_t>();
        if (size > left_.size()) {
            is_short_ = true;
            left_ = {};
            return {};
        }
        const std::string_view found = left_.substr(0, size);
        left_.remove_prefix(size);
        return found;
    }
    std::string_view rest() const { return left_; }
    bool is_short() const { return is_short_; }

  private:
    std::string_view left_;
    bool is_short_ = false;
};

} // namespace calot::cases

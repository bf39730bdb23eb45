// Saving and loading an instance's state as bytes.
//
// What the adapters write: a header of 40 bytes (magic, version of the model's state, the model's id hashed,
// length and FNV-1a of the payload), then the payload in the machine's byte order. Whatever is truncated,
// altered, of another model or of a newer version is refused with CALOT_CODE_CORRUPT_STATE.
#pragma once

#include <calot/abi/common.h>
#include <calot/error.hpp>
#include <calot/math.hpp>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>
#include <type_traits>
#include <vector>

namespace calot {

// FNV-1a, 64 bits (Fowler, Noll, Vo).
inline std::uint64_t fnv1a(std::span<const std::uint8_t> bytes, std::uint64_t hash = 0xcbf29ce484222325ull) {
    for (const std::uint8_t byte : bytes)
        hash = (hash ^ byte) * 0x100000001b3ull;
    return hash;
}
inline std::uint64_t fnv1a(std::string_view text) {
    return fnv1a({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

template<class T>
concept Scalar = std::is_arithmetic_v<T> || std::is_enum_v<T>;

class StateWriter {
  public:
    template<Scalar T>
    void value(T v) {
        append(&v, sizeof v);
    }
    void value(const Vec3& v) { value(v.x), value(v.y), value(v.z); }
    void value(const Quat& q) { value(q.w), value(q.x), value(q.y), value(q.z); }
    // Their count, then the values.
    template<Scalar T>
    void values(std::span<const T> v) {
        value<std::uint64_t>(v.size());
        append(v.data(), v.size_bytes());
    }
    template<Scalar T>
    void values(const std::vector<T>& v) {
        values(std::span<const T>(v));
    }

    std::span<const std::uint8_t> bytes() const { return bytes_; }

  private:
    void append(const void* data, std::size_t size) {
        if (size == 0) return;
        const auto* first = static_cast<const std::uint8_t*>(data);
        bytes_.insert(bytes_.end(), first, first + size);
    }
    std::vector<std::uint8_t> bytes_;
};

// Throws Error with CALOT_CODE_CORRUPT_STATE when the bytes are not what was asked for.
class StateReader {
  public:
    explicit StateReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

    template<Scalar T>
    T value() {
        T v;
        take(&v, sizeof v);
        return v;
    }
    template<Scalar T>
    void value(T& v) {
        v = value<T>();
    }
    void value(Vec3& v) { value(v.x), value(v.y), value(v.z); }
    void value(Quat& q) { value(q.w), value(q.x), value(q.y), value(q.z); }
    // As many as were written: the count must agree.
    template<Scalar T>
    void values(std::span<T> v) {
        if (value<std::uint64_t>() != v.size()) corrupt("holds another number of values than this instance");
        take(v.data(), v.size_bytes());
    }
    template<Scalar T>
    void values(std::vector<T>& v) {
        values(std::span<T>(v));
    }
    // However many were written, at most `most`.
    template<Scalar T>
    std::vector<T> read_values(std::size_t most) {
        const auto count = value<std::uint64_t>();
        if (count > most || count > bytes_.size() / sizeof(T)) corrupt("holds too many values");
        std::vector<T> v(count);
        take(v.data(), count * sizeof(T));
        return v;
    }
    bool at_end() const { return bytes_.empty(); }

    [[noreturn]] static void corrupt(const char* why) {
        throw Error(CALOT_CODE_CORRUPT_STATE, "state", std::string("the saved state ") + why);
    }

  private:
    void take(void* data, std::size_t size) {
        if (size > bytes_.size()) corrupt("ends too early");
        if (size == 0) return;
        std::memcpy(data, bytes_.data(), size);
        bytes_ = bytes_.subspan(size);
    }
    std::span<const std::uint8_t> bytes_;
};

namespace detail {

struct StateHeader {
    char magic[8];
    std::uint32_t version;
    std::uint32_t reserved;
    std::uint64_t model;
    std::uint64_t length;
    std::uint64_t checksum;
};
static_assert(sizeof(StateHeader) == 40);
inline constexpr std::string_view state_magic = "CALOTST1";
inline constexpr std::uint64_t max_state_bytes = 1ull << 31;

inline void write_state(const calot_sink& sink, std::uint64_t model, std::uint32_t version,
                        std::span<const std::uint8_t> payload) {
    StateHeader header{};
    std::memcpy(header.magic, state_magic.data(), sizeof header.magic);
    header.version = version;
    header.model = model;
    header.length = payload.size();
    header.checksum = fnv1a(payload);
    const auto put = [&](const void* data, std::size_t size) {
        if (size != 0 && sink.write(sink.self, {static_cast<const std::uint8_t*>(data), size}) != CALOT_OK)
            throw Error(CALOT_CODE_CAPACITY, "sink", "the sink did not take the state");
    };
    put(&header, sizeof header);
    put(payload.data(), payload.size());
}

inline std::vector<std::uint8_t> read_state(const calot_source& source, std::uint64_t model,
                                            std::uint32_t version) {
    const auto fill = [&](std::uint8_t* data, std::uint64_t size) {
        std::uint64_t got = 0;
        while (got < size) {
            const std::uint64_t n = source.read(source.self, {data + got, size - got});
            if (n == 0 || n > size - got) return got;
            got += n;
        }
        return got;
    };
    StateHeader header{};
    if (fill(reinterpret_cast<std::uint8_t*>(&header), sizeof header) != sizeof header)
        StateReader::corrupt("is shorter than its header");
    if (std::memcmp(header.magic, state_magic.data(), sizeof header.magic) != 0 || header.reserved != 0)
        StateReader::corrupt("does not begin as a state does");
    if (header.model != model) StateReader::corrupt("is another model's");
    if (header.version != version) StateReader::corrupt("has a version that this library does not read");
    if (header.length > max_state_bytes) StateReader::corrupt("claims to be longer than 2 GiB");
    // In pieces: a length that lies must not cost its memory.
    std::vector<std::uint8_t> payload;
    while (payload.size() < header.length) {
        const std::size_t before = payload.size();
        const std::uint64_t piece = std::min<std::uint64_t>(header.length - before, 1u << 20);
        payload.resize(before + piece);
        if (fill(payload.data() + before, piece) != piece) StateReader::corrupt("ends too early");
    }
    std::uint8_t extra = 0;
    if (fill(&extra, 1) != 0) StateReader::corrupt("goes on after its end");
    if (fnv1a(payload) != header.checksum) StateReader::corrupt("has been altered: its checksum is wrong");
    return payload;
}

} // namespace detail
} // namespace calot

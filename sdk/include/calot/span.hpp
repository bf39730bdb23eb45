// The contract's strings and spans as the standard library's.
#pragma once

#include <calot/abi/common.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace calot {

inline std::string_view view(calot_string s) {
    return s.data ? std::string_view(s.data, s.size) : "";
}
inline calot_string string(std::string_view s) {
    return {s.data(), s.size()};
}

inline std::span<const double> span(calot_reals s) {
    return {s.data, s.size};
}
inline std::span<double> span(calot_reals_out s) {
    return {s.data, s.size};
}
inline std::span<const std::uint32_t> span(calot_indices s) {
    return {s.data, s.size};
}
inline std::span<std::uint32_t> span(calot_indices_out s) {
    return {s.data, s.size};
}
inline std::span<const std::uint8_t> span(calot_bytes s) {
    return {s.data, s.size};
}
inline std::span<std::uint8_t> span(calot_bytes_out s) {
    return {s.data, s.size};
}

inline calot_reals reals(std::span<const double> s) {
    return {s.data(), s.size()};
}
inline calot_reals_out reals_out(std::span<double> s) {
    return {s.data(), s.size()};
}
inline calot_indices indices(std::span<const std::uint32_t> s) {
    return {s.data(), s.size()};
}
inline calot_indices_out indices_out(std::span<std::uint32_t> s) {
    return {s.data(), s.size()};
}
inline calot_bytes bytes(std::span<const std::uint8_t> s) {
    return {s.data(), s.size()};
}

// Structs of type T, `stride` bytes apart: a newer, longer struct is walked all the same.
template<class T>
class Structs {
  public:
    Structs() = default;
    explicit Structs(calot_structs s)
        : data_(static_cast<const std::byte*>(s.data)), count_(s.count), stride_(s.stride) {}

    std::size_t size() const { return count_; }
    bool empty() const { return count_ == 0; }
    const T& operator[](std::size_t i) const { return *reinterpret_cast<const T*>(data_ + i * stride_); }

    class Iterator {
      public:
        Iterator(const Structs* owner, std::size_t i) : owner_(owner), i_(i) {}
        const T& operator*() const { return (*owner_)[i_]; }
        Iterator& operator++() { return ++i_, *this; }
        bool operator!=(const Iterator& other) const { return i_ != other.i_; }

      private:
        const Structs* owner_;
        std::size_t i_;
    };
    Iterator begin() const { return {this, 0}; }
    Iterator end() const { return {this, count_}; }

  private:
    const std::byte* data_ = nullptr;
    std::size_t count_ = 0;
    std::size_t stride_ = sizeof(T);
};

template<class T>
Structs<T> items(calot_structs s) {
    return Structs<T>(s);
}

template<class T>
calot_structs structs(std::span<const T> s) {
    return {s.data(), s.size(), sizeof(T)};
}

// Element i of a span of structs that is to be filled; i < capacity.
template<class T>
T& item(calot_structs_out s, std::size_t i) {
    return *reinterpret_cast<T*>(static_cast<std::byte*>(s.data) + i * s.stride);
}

// Appends to a span that is to be filled: false, and nothing changed, when it is full.
template<class T>
bool append(calot_structs_out& s, const T& value) {
    if (s.count >= s.capacity) return false;
    item<T>(s, s.count++) = value;
    return true;
}

} // namespace calot

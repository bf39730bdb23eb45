// Checks of what comes in over the contract. Real-time: neither allocates nor throws.
#pragma once

#include <calot/abi/common.h>
#include <calot/error.hpp>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>

namespace calot::detail {

// No physical quantity in SI units that a plugin is given comes near this; its square is still finite.
inline constexpr double largest_input = 1e15;

// Collects the first thing that is wrong; whatever is checked after it is skipped.
class Checker {
  public:
    explicit Checker(calot_error* error) : error_(error) {}

    bool is_ok() const { return status_ == CALOT_OK; }
    calot_status status() const { return status_; }

    void refuse(std::int32_t code, const char* field, const char* message,
                calot_status status = CALOT_DISCARD) {
        if (is_ok()) status_ = fail(error_, status, code, field, message);
    }
    void require(bool condition, std::int32_t code, const char* field, const char* message) {
        if (!condition) refuse(code, field, message);
    }

    // A struct passed by pointer, as long as this version of the contract says.
    template<class T>
    bool whole(const T* s, const char* field) {
        if (s == nullptr || s->struct_size < sizeof(T))
            refuse(CALOT_CODE_INVALID_ARGUMENT, field, "is missing, or its struct_size is too small",
                   CALOT_ERROR);
        return is_ok();
    }
    template<class Span>
    bool present(Span s, const char* field) {
        if (s.size != 0 && s.data == nullptr)
            refuse(CALOT_CODE_INVALID_ARGUMENT, field, "has a size but no data", CALOT_ERROR);
        return is_ok();
    }
    // A span of a known size, or an empty one where that is allowed.
    template<class Span>
    void sized(Span s, std::uint64_t size, bool may_be_empty, const char* field) {
        if (!present(s, field)) return;
        if (s.size != size && !(may_be_empty && s.size == 0)) refuse_size(field, size, s.size);
    }
    template<class T>
    void list(calot_structs s, std::uint64_t most, const char* field) {
        if (s.count == 0 || !is_ok()) return;
        if (s.data == nullptr || s.stride < sizeof(T))
            refuse(CALOT_CODE_INVALID_ARGUMENT, field, "has no data, or its stride is too small",
                   CALOT_ERROR);
        else if (s.count > most)
            refuse(CALOT_CODE_CAPACITY, field, "is longer than declared at activate");
    }
    template<class T>
    void list_out(calot_structs_out s, const char* field) {
        if (s.capacity == 0 || !is_ok()) return;
        if (s.data == nullptr || s.stride < sizeof(T))
            refuse(CALOT_CODE_INVALID_ARGUMENT, field, "has no data, or its stride is too small",
                   CALOT_ERROR);
    }

    void reals(const char* field, const double* p, std::uint64_t n) {
        for (std::uint64_t i = 0; i < n && is_ok(); ++i)
            real(p[i], nullptr, 0, field, i, n > 1);
    }
    void reals(const char* field, calot_reals s) {
        if (present(s, field)) reals(field, s.data, s.size);
    }
    void real(const char* field, double v) { reals(field, &v, 1); }
    // As above, of element `index` of a list.
    void element(const char* list, std::uint64_t index, const char* field, const double* p, std::uint64_t n) {
        for (std::uint64_t i = 0; i < n && is_ok(); ++i)
            real(p[i], list, index, field, i, n > 1);
    }

    void at_least(const char* field, calot_reals s, double minimum, bool is_exclusive) {
        reals(field, s);
        for (std::uint64_t i = 0; i < s.size && is_ok(); ++i) {
            if (s.data[i] < minimum || (is_exclusive && s.data[i] == minimum))
                refuse_indexed(CALOT_CODE_OUT_OF_RANGE, field, i,
                               is_exclusive ? "must be greater" : "must not be less", minimum);
        }
    }
    void unit(const char* field, const double* p, std::uint64_t n) {
        reals(field, p, n);
        double square = 0;
        for (std::uint64_t i = 0; i < n && is_ok(); ++i)
            square += p[i] * p[i];
        // Callers may carry single-precision poses.
        if (is_ok() && std::abs(square - 1) > 1e-4)
            refuse(CALOT_CODE_OUT_OF_RANGE, field, "must have unit length");
    }
    void pose(const char* field, const calot_pose& p) {
        reals(field, p.position, 3);
        reals(field, p.quaternion, 4);
    }

  private:
    void real(double v, const char* list, std::uint64_t index, const char* field, std::uint64_t i,
              bool is_indexed) {
        if (std::abs(v) <= largest_input) return;
        char name[96];
        char place[24] = "";
        if (is_indexed) std::snprintf(place, sizeof place, "[%llu]", static_cast<unsigned long long>(i));
        if (list != nullptr)
            std::snprintf(name, sizeof name, "%s[%llu].%s%s", list, static_cast<unsigned long long>(index),
                          field, place);
        else
            std::snprintf(name, sizeof name, "%s%s", field, place);
        if (std::isfinite(v))
            refuse(CALOT_CODE_OUT_OF_RANGE, name, "is beyond 1e15 in SI units");
        else
            refuse(CALOT_CODE_NOT_FINITE, name, "is not a finite number");
    }
    void refuse_size(const char* field, std::uint64_t want, std::uint64_t got) {
        char message[128];
        std::snprintf(message, sizeof message, "must have %llu entries but has %llu",
                      static_cast<unsigned long long>(want), static_cast<unsigned long long>(got));
        refuse(CALOT_CODE_INVALID_ARGUMENT, field, message);
    }
    void refuse_indexed(std::int32_t code, const char* field, std::uint64_t i, const char* what,
                        double minimum) {
        char name[96];
        char message[128];
        std::snprintf(name, sizeof name, "%s[%llu]", field, static_cast<unsigned long long>(i));
        std::snprintf(message, sizeof message, "%s than %d", what, static_cast<int>(minimum));
        refuse(code, name, message);
    }

    calot_error* error_;
    calot_status status_ = CALOT_OK;
};

} // namespace calot::detail

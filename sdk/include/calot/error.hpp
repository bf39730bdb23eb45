// How a plugin says that something is wrong.
//
// Functions that may take their time throw Error or Discard. Real-time functions neither throw nor allocate:
// they return a Result. The adapters turn either into the contract's status, code, field and message.
#pragma once

#include <calot/abi/common.h>

#include <cstdint>
#include <cstdio>
#include <exception>
#include <new>
#include <string>
#include <utility>

namespace calot {

// This call failed; the instance is unchanged and usable.
class Error : public std::exception {
  public:
    // code: CALOT_CODE_...; field: as the caller knows it ("setup.bending_x[3]"); message: what is wrong with
    // it, and the remedy.
    Error(std::int32_t code, std::string field, std::string message)
        : Error(CALOT_ERROR, code, std::move(field), std::move(message)) {}

    const char* what() const noexcept override { return message_.c_str(); }
    calot_status status() const { return status_; }
    std::int32_t code() const { return code_; }
    const std::string& field() const { return field_; }
    const std::string& message() const { return message_; }

  protected:
    Error(calot_status status, std::int32_t code, std::string field, std::string message)
        : status_(status), code_(code), field_(std::move(field)), message_(std::move(message)) {}

  private:
    calot_status status_;
    std::int32_t code_;
    std::string field_;
    std::string message_;
};

// This input can't be used; nothing changed, try again with another.
class Discard : public Error {
  public:
    Discard(std::int32_t code, std::string field, std::string message)
        : Error(CALOT_DISCARD, code, std::move(field), std::move(message)) {}
};

// The library can't go on; it will be quarantined.
class Fatal : public Error {
  public:
    Fatal(std::int32_t code, std::string field, std::string message)
        : Error(CALOT_FATAL, code, std::move(field), std::move(message)) {}
};

// What a real-time function returns. The texts must outlive the call: use literals.
struct [[nodiscard]] Result {
    calot_status status = CALOT_OK;
    std::int32_t code = CALOT_CODE_NONE;
    const char* field = "";
    const char* message = "";

    static Result ok() { return {}; }
    static Result discard(std::int32_t code, const char* field, const char* message) {
        return {CALOT_DISCARD, code, field, message};
    }
    static Result error(std::int32_t code, const char* field, const char* message) {
        return {CALOT_ERROR, code, field, message};
    }
    static Result fatal(std::int32_t code, const char* field, const char* message) {
        return {CALOT_FATAL, code, field, message};
    }
    explicit operator bool() const { return status == CALOT_OK; }
};

namespace detail {

// Fills `error`, which may be null, and returns `status`; neither allocates nor throws.
inline calot_status fail(calot_error* error, calot_status status, std::int32_t code, const char* field,
                         const char* message) noexcept {
    if (error != nullptr && error->struct_size >= sizeof(calot_error)) {
        error->code = code;
        error->reserved = 0;
        std::snprintf(error->field, sizeof error->field, "%s", field);
        std::snprintf(error->message, sizeof error->message, "%s", message);
    }
    return status;
}

inline calot_status give(calot_error* error, const Result& result) noexcept {
    if (result) return CALOT_OK;
    return fail(error, result.status, result.code, result.field, result.message);
}

// Runs `body`, which returns a status, and lets no exception out.
template<class Body>
calot_status guarded(calot_error* error, Body&& body) noexcept {
    try {
        return body();
    } catch (const Error& e) {
        return fail(error, e.status(), e.code(), e.field().c_str(), e.message().c_str());
    } catch (const std::bad_alloc&) {
        return fail(error, CALOT_ERROR, CALOT_CODE_CAPACITY, "memory", "not enough memory");
    } catch (const std::exception& e) {
        return fail(error, CALOT_ERROR, CALOT_CODE_INTERNAL, "", e.what());
    } catch (...) {
        return fail(error, CALOT_ERROR, CALOT_CODE_INTERNAL, "", "an exception of unknown type");
    }
}

} // namespace detail
} // namespace calot

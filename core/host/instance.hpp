#pragma once

#include "host/error.hpp"

#include <calot/abi/common.h>

#include <memory>
#include <string>
#include <string_view>

namespace calot::host {

class Library;

/// An instance of a plugin's model, created and initialised; destroyed with its handle. After CALOT_FATAL the
/// library is quarantined: nothing of it is called any more, destroy included. [main thread]
class Instance {
  public:
    Instance() = default;
    Instance(Instance&& other) noexcept { *this = std::move(other); }
    Instance& operator=(Instance&& other) noexcept;
    Instance(const Instance&) = delete;
    Instance& operator=(const Instance&) = delete;
    ~Instance() { release(); }

    explicit operator bool() const { return held_ != nullptr; }
    const std::string& id() const { return held_->id; }
    const std::string& version() const { return held_->version; }
    /// SHA-256 of the library's file: with which code a case was run.
    const std::string& library_hash() const;
    /// Stays where it is for the life of the handle, moved or not.
    calot_instance* abi() const { return &held_->instance; }
    /// Nothing of the library may be called any more.
    void quarantine();

  private:
    friend class Plugins;
    struct Held {
        std::shared_ptr<Library> library;
        std::string id;
        std::string version;
        calot_instance instance{};
    };
    void release() noexcept;
    std::unique_ptr<Held> held_;
};

/// A text of the contract; a null pointer is the empty text.
std::string text(calot_string s);
std::string_view view(calot_string s);
/// Valid as long as `s`.
calot_string abi_string(std::string_view s);

} // namespace calot::host

#pragma once

#include "host/manifest.hpp"
#include "host/services.hpp"

#include <calot/abi/common.h>

#include <atomic>
#include <string>

namespace calot::host {

/// A plugin's library, loaded and checked against its manifest: exported symbols, provenance, descriptor,
/// negotiation, models. Once loaded it stays in the process.
class Library {
  public:
    /// Throws UserError. Marks its calls in blame(). [main]
    Library(const Manifest& manifest, Services& services);

    const calot_factory* factory(Kind kind) const { return factories_[static_cast<int>(kind)]; }
    const calot_host* host() const { return host_.abi(); }
    /// For blame: a zero-terminated text that stays.
    const char* name() const { return id_.c_str(); }
    /// SHA-256 of the file.
    const std::string& hash() const { return hash_; }

    bool is_quarantined() const { return is_quarantined_.load(); }
    void quarantine() { is_quarantined_.store(true); }

  private:
    void open();
    void negotiate();
    void compare_models(const Manifest& manifest);
    [[noreturn]] void refuse(const std::string& what, const std::string& remedy) const;

    std::string id_;
    std::string file_;
    PluginHost host_;
    std::string hash_;
    calot_library library_{};
    const calot_factory* factories_[5] = {};
    void* handle_ = nullptr;
    calot_entry entry_ = nullptr;
    std::atomic<bool> is_quarantined_{false};
};

} // namespace calot::host

// A recorded case as a device, and the comparison of what comes of it.
#pragma once

#include "cases/journal.hpp"

#include <optional>
#include <string>

namespace calot::cases {

/// The recorded controls, tick by tick. The journal must outlive it.
class JournalControls : public simulation::ControlSource {
  public:
    explicit JournalControls(const Journal& journal) : steps_(journal.steps) {}
    bool next(std::int64_t tick, calot_controls& out) override;

  private:
    StepDecoder steps_;
};

struct Difference {
    std::int64_t tick = 0;
    std::string part; // "rod", "contacts", "controls", "procedure", "length"
};

/// Compares a run with its record: add it to the simulation as an observer.
class Verifier : public simulation::Observer {
  public:
    explicit Verifier(const Journal& journal) : journal_(&journal) {}
    void marked(std::int64_t tick, std::uint32_t mark) override;
    void digested(const simulation::Digest& digest) override;
    void ended(const simulation::Snapshot&) override;
    /// The earliest difference; none: the same bits.
    const std::optional<Difference>& difference() const { return difference_; }
    std::int64_t compared_ticks() const { return compared_; }

  private:
    void differs(std::int64_t tick, const char* part);
    const Journal* journal_;
    std::size_t digest_at_ = 0;
    std::int64_t compared_ = 0;
    std::optional<Difference> difference_;
};

/// Names what is not as it was recorded (plugin, mesh, scene), one line each; empty if all is the same.
std::vector<std::string> changed_parts(const CaseHeader& recorded, const CaseHeader& now);

} // namespace calot::cases

// Writes a case as it runs: everything of the journal, from the simulation's thread.
#pragma once

#include "cases/journal.hpp"

namespace calot::cases {

class CaseRecorder : public simulation::Observer {
  public:
    explicit CaseRecorder(JournalWriter& journal) : journal_(&journal) {}
    void ticked(const simulation::Snapshot& s) override { controls_ = s.controls; }
    void commanded(std::int64_t tick, const simulation::Command& c) override { journal_->command(tick, c); }
    void marked(std::int64_t, std::uint32_t mark) override { journal_->step(controls_, mark); }
    void digested(const simulation::Digest& d) override { journal_->digest(d); }
    void ended(const simulation::Snapshot& s) override { journal_->end(s); }

  private:
    JournalWriter* journal_;
    calot_controls controls_{};
};

} // namespace calot::cases

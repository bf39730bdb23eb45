// Writes a case as it runs: everything of the journal, from the simulation's thread.
#pragma once

#include "cases/journal.hpp"

namespace calot::cases {

class CaseRecorder : public simulation::Observer {
  public:
    explicit CaseRecorder(JournalWriter& journal) : journal_(&journal) {}
    void ticked(const simulation::Snapshot& s) override { journal_->controls(s.tick, s.controls); }
    void commanded(std::int64_t tick, const simulation::Command& c) override { journal_->command(tick, c); }
    void marked(std::int64_t tick, std::uint32_t mark) override { journal_->mark(tick, mark); }
    void digested(const simulation::Digest& d) override { journal_->digest(d); }
    void ended(const simulation::Snapshot& s) override { journal_->end(s); }

  private:
    JournalWriter* journal_;
};

} // namespace calot::cases

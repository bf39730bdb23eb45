#include "cases/replay.hpp"

#include <algorithm>

namespace calot::cases {

bool JournalControls::next(std::int64_t, calot_controls& out) {
    std::uint32_t mark = 0;
    return steps_.next(out, mark);
}

void Verifier::differs(std::int64_t tick, const char* part) {
    if (!difference_ || tick < difference_->tick) difference_ = Difference{tick, part};
}

void Verifier::marked(std::int64_t tick, std::uint32_t mark) {
    const auto at = static_cast<std::size_t>(tick - 1);
    if (at >= journal_->marks.size())
        differs(tick, "length");
    else if (journal_->marks[at] != mark)
        differs(tick, "rod");
    compared_ = tick;
}

void Verifier::digested(const simulation::Digest& d) {
    // The record may lack the last, of a case that was cut off.
    while (digest_at_ < journal_->digests.size() && journal_->digests[digest_at_].tick < d.tick)
        ++digest_at_;
    if (digest_at_ == journal_->digests.size() || journal_->digests[digest_at_].tick != d.tick) return;
    const simulation::Digest& recorded = journal_->digests[digest_at_++];
    // In the order in which one part steers the next.
    if (recorded.controls != d.controls) differs(d.tick, "controls");
    if (recorded.contacts != d.contacts) differs(d.tick, "contacts");
    if (recorded.rod != d.rod) differs(d.tick, "rod");
    if (recorded.procedure != d.procedure) differs(d.tick, "procedure");
}

void Verifier::ended(const simulation::Snapshot& last) {
    if (last.tick < journal_->ticks) differs(last.tick + 1, "length");
}

std::vector<std::string> changed_parts(const CaseHeader& recorded, const CaseHeader& now) {
    std::vector<std::string> lines;
    for (const auto& [name, hash] : recorded.hashes) {
        if (name == "plugin/" + recorded.device) continue; // the record stands in for it
        const auto found = now.hashes.find(name);
        if (found == now.hashes.end())
            lines.push_back(name + ": was part of the case and is not here");
        else if (found->second != hash)
            lines.push_back(name + ": is not the one that the case was run with");
    }
    for (const auto& [name, hash] : now.hashes)
        if (!recorded.hashes.contains(name) && name != "plugin/" + recorded.device)
            lines.push_back(name + ": was no part of the case");
    if (recorded.version != now.version)
        lines.push_back("calot: the case was run with version " + recorded.version + ", this is " +
                        now.version);
    return lines;
}

} // namespace calot::cases

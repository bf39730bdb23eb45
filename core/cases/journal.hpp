// The record of a case: case.calot in its folder. Append-only; what a crash leaves is a valid, shorter
// record.
//
//   "CALOTCAS" u32 version, u32 0                                 16 bytes
//   records: u32 type, u32 length, payload, u32 CRC-32 over type, length and payload
//
// Little-endian. A reader stops at the first record that is cut off or whose CRC differs, and says so.
#pragma once

#include "simulation/simulation.hpp"

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace calot::cases {

/// What is needed to run the case again, and to know whether it is run with the same parts.
struct CaseHeader {
    std::string id;                     // of the case: unique in its results
    std::string version;                // of calot
    std::string created;                // ISO 8601, UTC
    std::string procedure, rod, device; // plugin ids
    std::string operator_code;
    std::string start = "default"; // start pose
    std::string until;             // task id or empty
    std::string anatomy;           // name, as run
    std::string endoscope;         // datasheet's file, as run
    std::uint64_t seed = 0;
    std::uint32_t nodes = 100;
    std::uint32_t threads = 1;
    std::map<std::string, std::string> options; // others, by name
    std::map<std::string, std::string> hashes; // "scene", "endoscope", "mesh/<organ>", "plugin/<id>": SHA-256
};

/// Appends records; a thread of its own writes and syncs them at least once a second. The append functions
/// neither allocate nor block; a buffer that the disk cannot drain ends the record (failed()).
class JournalWriter {
  public:
    /// Creates `folder` (mode 0700) and case.calot in it (0600). Throws host::UserError when it exists or
    /// cannot be written.
    JournalWriter(const std::filesystem::path& folder, const CaseHeader& header);
    ~JournalWriter(); // flushes
    JournalWriter(const JournalWriter&) = delete;
    JournalWriter& operator=(const JournalWriter&) = delete;

    /// Of one tick, in order: what was latched at its begin, and the mark of the state after it.
    void step(const calot_controls& controls, std::uint32_t mark);
    void digest(const simulation::Digest& digest);
    void command(std::int64_t tick, const simulation::Command& command);
    void end(const simulation::Snapshot& last);
    void flush(); // blocks until all is on disk
    bool failed() const;
    const std::filesystem::path& file() const;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

struct JournalCommand {
    std::int64_t tick = 0;
    std::uint32_t kind = 0;
    std::string id, text;
    double value = 0;
};

/// A whole record in memory.
struct Journal {
    CaseHeader header;
    std::string steps;                // every tick's controls and mark, as written; StepDecoder reads them
    std::vector<std::uint32_t> marks; // of ticks 1, 2, ...
    std::vector<simulation::Digest> digests;
    std::vector<JournalCommand> commands;
    std::int64_t ticks = 0;   // complete ticks
    bool is_complete = false; // the case was ended in order
    std::string damage;       // where and why reading stopped early; empty if it did not
};

/// Walks the recorded ticks from the first.
class StepDecoder {
  public:
    explicit StepDecoder(std::string_view steps) : left_(steps) {}
    /// The controls latched at the next tick, and the mark of the state after it; false at the end, or where
    /// the bytes make no sense (is_broken).
    bool next(calot_controls& controls, std::uint32_t& mark);
    bool is_broken() const { return is_broken_; }

  private:
    std::string_view left_;
    std::array<std::uint64_t, 36> word_{}; // the controls' fields, as bits
    bool is_broken_ = false;
};

/// Reads a case's folder, or its case.calot. Damage after the header is no error (Journal::damage); an
/// unreadable file or header is: host::UserError, one line.
Journal read_journal(const std::filesystem::path& case_or_file);
Journal parse_journal(std::string_view bytes, const std::string& name);

} // namespace calot::cases

#include "cases/journal.hpp"
#include "cases/records.hpp"
#include "host/error.hpp"

#include <charconv>
#include <fstream>

namespace calot::cases {

namespace {

constexpr std::uintmax_t most_journal_bytes = std::uintmax_t{2} << 30;
constexpr std::uint32_t most_pairs = 4096;

template<class Number>
bool read_number(std::string_view text, Number& out) {
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), out);
    return error == std::errc() && end == text.data() + text.size();
}

bool read_header(std::string_view payload, CaseHeader& h) {
    Taker from(payload);
    const auto count = from.take<std::uint32_t>();
    if (count > most_pairs) return false;
    bool are_numbers_good = true;
    for (std::uint32_t i = 0; i < count && !from.is_short(); ++i) {
        const std::string_view key = from.text();
        const std::string value(from.text());
        const std::pair<std::string_view, std::string*> texts[] = {{"id", &h.id},
                                                                   {"version", &h.version},
                                                                   {"created", &h.created},
                                                                   {"procedure", &h.procedure},
                                                                   {"rod", &h.rod},
                                                                   {"device", &h.device},
                                                                   {"operator", &h.operator_code},
                                                                   {"start", &h.start},
                                                                   {"until", &h.until},
                                                                   {"anatomy", &h.anatomy},
                                                                   {"endoscope", &h.endoscope}};
        for (const auto& [name, to] : texts)
            if (key == name) *to = value;
        if (key == "seed") are_numbers_good &= read_number(value, h.seed);
        if (key == "nodes") are_numbers_good &= read_number(value, h.nodes);
        if (key == "threads") are_numbers_good &= read_number(value, h.threads);
        if (key.starts_with("option/")) h.options[std::string(key.substr(7))] = value;
        if (key.starts_with("hash/")) h.hashes[std::string(key.substr(5))] = value;
    }
    return are_numbers_good && !from.is_short() && from.rest().empty();
}

// Empty: the record was understood; else what is wrong with it.
std::string take_record(RecordType type, std::string_view payload, Journal& journal) {
    Taker from(payload);
    switch (type) {
    case RecordType::header:
        return "a second header";
    case RecordType::steps: {
        const auto first = from.take<std::uint64_t>();
        const auto count = from.take<std::uint32_t>();
        if (from.is_short() || first != static_cast<std::uint64_t>(journal.ticks))
            return "steps out of order";
        // Each step is at least five bytes long, so that the count is bounded by the file.
        StepDecoder steps(from.rest());
        calot_controls controls;
        std::uint32_t mark = 0;
        const std::size_t known = journal.marks.size();
        while (steps.next(controls, mark))
            journal.marks.push_back(mark);
        if (steps.is_broken() || journal.marks.size() - known != count) {
            journal.marks.resize(known);
            return "steps that make no sense";
        }
        journal.steps += from.rest();
        journal.ticks += count;
        break;
    }
    case RecordType::digest: {
        simulation::Digest d;
        d.tick = from.take<std::int64_t>();
        d.rod = from.take<std::uint64_t>();
        d.contacts = from.take<std::uint64_t>();
        d.controls = from.take<std::uint64_t>();
        d.procedure = from.take<std::uint64_t>();
        if (from.is_short() || !from.rest().empty()) return "a digest of wrong size";
        journal.digests.push_back(d);
        break;
    }
    case RecordType::command: {
        JournalCommand c;
        c.tick = from.take<std::int64_t>();
        c.kind = from.take<std::uint32_t>();
        c.value = from.take<double>();
        c.id = from.text();
        c.text = from.text();
        if (from.is_short() || !from.rest().empty()) return "a command of wrong size";
        journal.commands.push_back(std::move(c));
        break;
    }
    case RecordType::end: {
        const auto tick = from.take<std::int64_t>();
        if (from.is_short() || tick != journal.ticks) return "an end that is not where the steps end";
        journal.is_complete = true;
        break;
    }
    default:
        return "a record of unknown type " + std::to_string(static_cast<std::uint32_t>(type));
    }
    return {};
}

} // namespace

Journal parse_journal(std::string_view bytes, const std::string& name) {
    const auto refuse = [&](const std::string& what) -> void {
        throw host::UserError(name, "", what + "; give the folder of a case, or its case.calot");
    };
    if (bytes.size() < preamble_bytes || !bytes.starts_with(journal_magic)) refuse("is no record of a case");
    Taker preamble(bytes.substr(journal_magic.size()));
    const auto version = preamble.take<std::uint32_t>();
    if (version != journal_version)
        refuse("is of version " + std::to_string(version) + ", this program reads " +
               std::to_string(journal_version));
    Journal journal;
    bool has_header = false;
    std::size_t at = preamble_bytes;
    while (at < bytes.size()) {
        const auto damaged = [&](const std::string& what) {
            journal.damage = name + ": byte " + std::to_string(at) + ": " + what + "; what follows is lost";
        };
        if (journal.is_complete) {
            damaged("something after the end");
            break;
        }
        if (bytes.size() - at < frame_bytes) {
            damaged("a record is cut off");
            break;
        }
        Taker frame(bytes.substr(at));
        const auto type = static_cast<RecordType>(frame.take<std::uint32_t>());
        const std::size_t size = frame.take<std::uint32_t>();
        if (size > most_record_bytes || size > bytes.size() - at - frame_bytes) {
            damaged("a record is cut off");
            break;
        }
        const std::string_view payload = bytes.substr(at + 8, size);
        Taker end(bytes.substr(at + 8 + size));
        if (end.take<std::uint32_t>() != crc32(payload, crc32(bytes.substr(at, 8)))) {
            damaged("a record's checksum differs");
            break;
        }
        if (!has_header) {
            if (type != RecordType::header || !read_header(payload, journal.header)) break;
            has_header = true;
        } else if (const std::string what = take_record(type, payload, journal); !what.empty()) {
            damaged(what);
            break;
        }
        at += frame_bytes + size;
    }
    if (!has_header) refuse("has no readable header");
    return journal;
}

Journal read_journal(const std::filesystem::path& case_or_file) {
    std::error_code problem;
    const std::filesystem::path file =
        std::filesystem::is_directory(case_or_file, problem) ? case_or_file / "case.calot" : case_or_file;
    const std::uintmax_t size = std::filesystem::file_size(file, problem);
    if (problem)
        throw host::UserError(file.string(), "",
                              "can't be read (" + problem.message() + "); give the folder of a case");
    if (size > most_journal_bytes)
        throw host::UserError(file.string(), "", "is larger than 2 GiB; it is no case");
    std::ifstream in(file, std::ios::binary);
    std::string bytes(static_cast<std::size_t>(size), '\0');
    in.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    if (!in) throw host::UserError(file.string(), "", "can't be read; check its permissions");
    return parse_journal(bytes, file.string());
}

} // namespace calot::cases

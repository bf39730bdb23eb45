#include "cases/journal.hpp"
#include "cases/records.hpp"
#include "cases/step_codec.hpp"
#include "host/error.hpp"

#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <fcntl.h>
#include <sys/stat.h>
#include <thread>
#include <unistd.h>

namespace calot::cases {

namespace {

constexpr std::size_t ring_bytes = 8u << 20; // seconds of the busiest case at ten times real time
constexpr std::uint32_t steps_in_record =
    100; // what a kill can take at most, with the writer's period: 0.2 s
constexpr auto writer_period = std::chrono::milliseconds(100);

std::string header_payload(const CaseHeader& h) {
    std::vector<std::pair<std::string, std::string>> pairs{
        {"id", h.id},
        {"version", h.version},
        {"created", h.created},
        {"procedure", h.procedure},
        {"rod", h.rod},
        {"device", h.device},
        {"operator", h.operator_code},
        {"start", h.start},
        {"until", h.until},
        {"anatomy", h.anatomy},
        {"endoscope", h.endoscope},
        {"seed", std::to_string(h.seed)},
        {"nodes", std::to_string(h.nodes)},
        {"threads", std::to_string(h.threads)},
    };
    for (const auto& [key, value] : h.options)
        pairs.emplace_back("option/" + key, value);
    for (const auto& [key, value] : h.hashes)
        pairs.emplace_back("hash/" + key, value);
    std::string out;
    put(out, static_cast<std::uint32_t>(pairs.size()));
    for (const auto& [key, value] : pairs)
        for (const std::string& text : {key, value}) {
            put(out, static_cast<std::uint32_t>(text.size()));
            out += text;
        }
    return out;
}

} // namespace

struct JournalWriter::Impl {
    std::filesystem::path path;
    int file = -1;

    // Bytes on their way to the writer's thread: one producer, one consumer.
    std::vector<char> ring = std::vector<char>(ring_bytes);
    std::atomic<std::uint64_t> head{0}, tail{0}, synced{0};
    std::atomic<bool> is_failed{false}, is_over{false};
    std::thread writer;

    // The record of steps that is being filled.
    ControlWords before{};
    std::uint64_t first_tick = 0;
    std::uint32_t step_count = 0;
    std::string steps, payload;

    void append(RecordType type, std::string_view bytes) {
        char frame[8];
        const auto number = static_cast<std::uint32_t>(type), size = static_cast<std::uint32_t>(bytes.size());
        std::memcpy(frame, &number, 4);
        std::memcpy(frame + 4, &size, 4);
        const std::uint32_t crc = crc32(bytes, crc32({frame, 8}));
        char end[4];
        std::memcpy(end, &crc, 4);
        const std::uint64_t at = head.load(std::memory_order_relaxed);
        if (at + bytes.size() + frame_bytes - tail.load(std::memory_order_acquire) > ring.size())
            is_failed.store(true);
        if (is_failed.load(std::memory_order_relaxed)) return; // a gap would void what follows
        std::uint64_t to = at;
        for (const std::string_view part : {std::string_view(frame, 8), bytes, std::string_view(end, 4)})
            for (const char c : part)
                ring[to++ % ring.size()] = c;
        head.store(to, std::memory_order_release);
    }

    void close_steps() {
        if (step_count == 0) return;
        payload.clear();
        put(payload, first_tick);
        put(payload, step_count);
        payload += steps;
        append(RecordType::steps, payload);
        first_tick += step_count;
        step_count = 0;
        steps.clear();
    }

    // Everything that has been appended so far, to the disk. [writer's thread]
    void drain() {
        const std::uint64_t until = head.load(std::memory_order_acquire);
        std::uint64_t from = tail.load(std::memory_order_relaxed);
        while (from < until && !is_failed.load()) {
            const std::size_t at = from % ring.size();
            const std::size_t size = std::min<std::uint64_t>(until - from, ring.size() - at);
            const ssize_t written = ::write(file, ring.data() + at, size);
            if (written < 0 && errno == EINTR) continue;
            if (written <= 0) {
                is_failed.store(true);
                break;
            }
            from += static_cast<std::uint64_t>(written);
            tail.store(from, std::memory_order_release);
        }
        if (synced.load() < from && ::fdatasync(file) != 0 && errno != EINVAL) is_failed.store(true);
        synced.store(from);
    }

    void work() {
        auto due = std::chrono::steady_clock::now();
        while (!is_over.load()) {
            due += writer_period;
            drain();
            std::this_thread::sleep_until(due);
        }
        drain();
    }
};

JournalWriter::JournalWriter(const std::filesystem::path& folder, const CaseHeader& header)
    : impl_(std::make_unique<Impl>()) {
    Impl& j = *impl_;
    std::error_code problem;
    if (folder.has_parent_path()) std::filesystem::create_directories(folder.parent_path(), problem);
    if (::mkdir(folder.c_str(), 0700) != 0 && errno != EEXIST)
        throw host::UserError(folder.string(), "",
                              std::string("can't be made (") + std::strerror(errno) +
                                  "); choose another with --out");
    j.path = folder / "case.calot";
    j.file = ::open(j.path.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0600);
    if (j.file < 0)
        throw host::UserError(j.path.string(), "",
                              errno == EEXIST
                                  ? std::string("is there already, and a record is never overwritten; choose "
                                                "another folder with --out")
                                  : std::string("can't be written (") + std::strerror(errno) +
                                        "); choose another folder with --out");
    std::string preamble(journal_magic);
    put(preamble, journal_version);
    put(preamble, std::uint32_t{0});
    std::copy(preamble.begin(), preamble.end(), j.ring.begin());
    j.head.store(preamble.size());
    j.steps.reserve(steps_in_record * most_step_bytes);
    j.payload.reserve(steps_in_record * most_step_bytes + 64);
    j.append(RecordType::header, header_payload(header));
    j.writer = std::thread([&j] { j.work(); });
}

JournalWriter::~JournalWriter() {
    Impl& j = *impl_;
    j.close_steps();
    j.is_over.store(true);
    j.writer.join();
    ::close(j.file);
}

void JournalWriter::step(const calot_controls& controls, std::uint32_t mark) {
    Impl& j = *impl_;
    const ControlWords words = words_of(controls);
    char bytes[most_step_bytes];
    j.steps.append(bytes, append_step(j.before, words, mark, bytes));
    j.before = words;
    if (++j.step_count == steps_in_record) j.close_steps();
}

void JournalWriter::digest(const simulation::Digest& d) {
    impl_->close_steps();
    std::string& out = impl_->payload;
    out.clear();
    put(out, d.tick);
    for (const std::uint64_t part : {d.rod, d.contacts, d.controls, d.procedure})
        put(out, part);
    impl_->append(RecordType::digest, out);
}

void JournalWriter::command(std::int64_t tick, const simulation::Command& c) {
    std::string& out = impl_->payload;
    out.clear();
    put(out, tick);
    put(out, c.kind);
    put(out, c.value);
    for (const std::string_view text : {c.id.view(), c.text.view()}) {
        put(out, static_cast<std::uint32_t>(text.size()));
        out += text;
    }
    impl_->append(RecordType::command, out);
}

void JournalWriter::end(const simulation::Snapshot& last) {
    impl_->close_steps();
    std::string& out = impl_->payload;
    out.clear();
    put(out, last.tick);
    impl_->append(RecordType::end, out);
    flush();
}

void JournalWriter::flush() {
    Impl& j = *impl_;
    const std::uint64_t wanted = j.head.load();
    for (std::uint64_t seen = j.synced.load(); seen < wanted && !j.is_failed.load(); seen = j.synced.load())
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

bool JournalWriter::failed() const {
    return impl_->is_failed.load();
}

const std::filesystem::path& JournalWriter::file() const {
    return impl_->path;
}

} // namespace calot::cases

#include "cases/journal.hpp"
#include "cases/recorder.hpp"
#include "cases/records.hpp"
#include "cases/replay.hpp"
#include "host/error.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <sys/stat.h>
#include <unistd.h>

namespace calot::cases {

namespace {

class Folder {
  public:
    Folder() {
        static int count = 0;
        path_ = std::filesystem::temp_directory_path() /
                ("calot-cases-" + std::to_string(::getpid()) + "-" + std::to_string(count++));
        std::filesystem::remove_all(path_);
    }
    ~Folder() { std::filesystem::remove_all(path_); }
    const std::filesystem::path& path() const { return path_; }

  private:
    std::filesystem::path path_;
};

CaseHeader header() {
    CaseHeader h;
    h.id = "p07-1";
    h.version = "0.1.0";
    h.procedure = "org.calot.transgastric-cholecystectomy";
    h.rod = "org.calot.rod-cosserat";
    h.device = "org.calot.virtual-operator";
    h.seed = 18446744073709551615ull;
    h.hashes = {{"scene", "aa"},
                {"plugin/org.calot.rod-cosserat", "bb"},
                {"plugin/org.calot.virtual-operator", "ee"}};
    h.options = {{"skill", "expert"}};
    return h;
}

calot_controls controls_at(std::int64_t tick) {
    calot_controls c{};
    c.struct_size = sizeof c;
    c.insertion = 1e-4 * static_cast<double>(tick - tick % 3) / 3; // changes at every third tick
    c.wheel[1] = tick > 120 ? -0.25 : 0.5;
    c.port[2].rotation = 0.125;
    c.table_tilt[1] = 7;
    c.buttons = tick == 77 ? 1u : 0u;
    c.retractor.quaternion[0] = 1;
    return c;
}

constexpr std::int64_t recorded_ticks = 250;

std::string bytes_of(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

// A case of 250 ticks with a digest, a command and an end.
std::string recorded() {
    const Folder folder;
    JournalWriter writer(folder.path(), header());
    for (std::int64_t tick = 0; tick < recorded_ticks; ++tick)
        writer.step(controls_at(tick), static_cast<std::uint32_t>(tick) * 2654435761u);
    writer.digest({.tick = recorded_ticks, .rod = 1, .contacts = 2, .controls = 3, .procedure = 4});
    simulation::Command command;
    command.kind = CALOT_COMMAND_TASK_BEGIN;
    command.id = "navigation";
    command.text = "an incision, \"red\"";
    command.value = 0.5;
    writer.command(16, command);
    simulation::Snapshot last;
    last.tick = recorded_ticks;
    writer.end(last);
    EXPECT_FALSE(writer.failed());
    return bytes_of(writer.file());
}

} // namespace

TEST(Journal, gives_back_what_was_written) {
    const Journal journal = parse_journal(recorded(), "case.calot");
    EXPECT_EQ(journal.damage, "");
    EXPECT_TRUE(journal.is_complete);
    EXPECT_EQ(journal.ticks, recorded_ticks);
    EXPECT_EQ(journal.header.seed, 18446744073709551615ull);
    EXPECT_EQ(journal.header.hashes, header().hashes);
    EXPECT_EQ(journal.header.options, header().options);
    JournalControls controls(journal);
    for (std::int64_t tick = 0; tick < recorded_ticks; ++tick) {
        calot_controls c{};
        ASSERT_TRUE(controls.next(tick, c));
        const calot_controls expected = controls_at(tick);
        EXPECT_EQ(c.insertion, expected.insertion) << tick;
        EXPECT_EQ(c.wheel[1], expected.wheel[1]);
        EXPECT_EQ(c.port[2].rotation, 0.125);
        EXPECT_EQ(c.table_tilt[1], 7);
        EXPECT_EQ(c.buttons, expected.buttons);
        EXPECT_EQ(journal.marks[static_cast<std::size_t>(tick)],
                  static_cast<std::uint32_t>(tick) * 2654435761u);
    }
    calot_controls past{};
    EXPECT_FALSE(controls.next(recorded_ticks, past));
    ASSERT_EQ(journal.digests.size(), 1u);
    EXPECT_EQ(journal.digests[0].procedure, 4u);
    ASSERT_EQ(journal.commands.size(), 1u);
    EXPECT_EQ(journal.commands[0].id, "navigation");
    EXPECT_EQ(journal.commands[0].text, "an incision, \"red\"");
}

TEST(Journal, is_small_where_little_changes_and_private) {
    const Folder folder;
    JournalWriter writer(folder.path(), header());
    for (std::int64_t tick = 0; tick < 10000; ++tick)
        writer.step(controls_at(tick), 0);
    writer.flush();
    writer.digest({});
    writer.flush();
    EXPECT_LT(std::filesystem::file_size(writer.file()), 10000u * 10) << "bytes for each tick";
    struct stat about {};
    ASSERT_EQ(::stat(writer.file().c_str(), &about), 0);
    EXPECT_EQ(about.st_mode & 0777, 0600u);
    ASSERT_EQ(::stat(folder.path().c_str(), &about), 0);
    EXPECT_EQ(about.st_mode & 0777, 0700u);
}

TEST(Journal, is_never_overwritten) {
    const Folder folder;
    { JournalWriter writer(folder.path(), header()); }
    try {
        JournalWriter again(folder.path(), header());
        FAIL() << "a second record was begun";
    } catch (const host::UserError& error) {
        EXPECT_NE(std::string(error.what()).find("never overwritten"), std::string::npos) << error.what();
    }
}

TEST(Journal, cut_at_every_byte_gives_a_shorter_record_or_a_refusal) {
    const std::string bytes = recorded();
    std::int64_t ticks = 0;
    std::size_t refused = 0, complete = 0;
    for (std::size_t size = 0; size <= bytes.size(); ++size) {
        try {
            const Journal journal = parse_journal(std::string_view(bytes).substr(0, size), "case.calot");
            EXPECT_GE(journal.ticks, ticks) << "at " << size << " bytes";
            ticks = journal.ticks;
            complete += journal.is_complete;
            EXPECT_EQ(static_cast<std::int64_t>(journal.marks.size()), journal.ticks);
        } catch (const host::UserError&) {
            ++refused;
            EXPECT_EQ(ticks, 0) << "refused at " << size << " bytes, after fewer were read";
        }
    }
    EXPECT_EQ(ticks, recorded_ticks);
    EXPECT_EQ(complete, 1u) << "only the whole record is complete";
    EXPECT_GT(refused, 16u);
}

TEST(Journal, a_changed_byte_never_passes_for_the_whole_record) {
    const std::string bytes = recorded();
    for (std::size_t at = 0; at < bytes.size(); ++at)
        for (const int flip : {0x01, 0x80, 0xff}) {
            std::string broken = bytes;
            broken[at] = static_cast<char>(broken[at] ^ flip);
            try {
                const Journal journal = parse_journal(broken, "case.calot");
                // The four bytes after the version are not used.
                EXPECT_TRUE(!journal.damage.empty() || (at >= 12 && at < 16))
                    << "byte " << at << " ^ " << flip;
                EXPECT_LE(journal.ticks, recorded_ticks);
            } catch (const host::UserError& error) {
                EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
            }
        }
}

TEST(Journal, sound_checksums_over_nonsense_are_refused_too) {
    const std::string bytes = recorded();
    const std::size_t header_end = preamble_bytes + frame_bytes + [&] {
        std::uint32_t size = 0;
        std::memcpy(&size, bytes.data() + preamble_bytes + 4, 4);
        return size;
    }();
    const auto with = [&](RecordType type, const std::string& payload) {
        std::string record;
        put(record, static_cast<std::uint32_t>(type));
        put(record, static_cast<std::uint32_t>(payload.size()));
        record += payload;
        put(record, crc32(record));
        return parse_journal(bytes.substr(0, header_end) + record, "case.calot");
    };
    std::string steps;
    put(steps, std::uint64_t{0});
    put(steps, std::uint32_t{0xffffffff});
    EXPECT_NE(with(RecordType::steps, steps).damage.find("make no sense"), std::string::npos);
    EXPECT_NE(with(RecordType::steps, steps + std::string(12, '\xff')).damage, "");
    EXPECT_NE(with(RecordType::steps, "").damage.find("out of order"), std::string::npos);
    EXPECT_NE(with(RecordType::command, std::string(20, '\xff')).damage, "");
    EXPECT_NE(with(RecordType::digest, "short").damage, "");
    EXPECT_NE(with(RecordType::end, std::string(8, '\x7f')).damage, "");
    EXPECT_NE(with(static_cast<RecordType>(99), "").damage.find("unknown type 99"), std::string::npos);
    std::string huge = bytes.substr(0, header_end);
    put(huge, std::uint32_t{2});
    put(huge, std::uint32_t{0xfffffff0});
    huge.resize(huge.size() + 64);
    EXPECT_NE(parse_journal(huge, "case.calot").damage.find("cut off"), std::string::npos);
}

TEST(Journal, checksums_are_those_of_the_standard) {
    EXPECT_EQ(crc32("123456789"), 0xcbf43926u); // the check value of CRC-32
}

TEST(Verifier, names_the_first_tick_and_part_that_differ) {
    const Journal journal = parse_journal(recorded(), "case.calot");
    const auto play = [&](std::int64_t ticks, std::int64_t wrong_mark, std::uint64_t contacts) {
        Verifier verifier(journal);
        for (std::int64_t tick = 1; tick <= ticks; ++tick) {
            const auto mark = static_cast<std::uint32_t>(tick - 1) * 2654435761u;
            verifier.marked(tick, tick == wrong_mark ? mark + 1 : mark);
        }
        verifier.digested(
            {.tick = recorded_ticks, .rod = 1, .contacts = contacts, .controls = 3, .procedure = 4});
        simulation::Snapshot last;
        last.tick = ticks;
        verifier.ended(last);
        return verifier.difference();
    };
    EXPECT_FALSE(play(recorded_ticks, -1, 2));
    const auto rod = play(recorded_ticks, 123, 2);
    ASSERT_TRUE(rod);
    EXPECT_EQ(rod->tick, 123);
    EXPECT_EQ(rod->part, "rod");
    const auto contacts = play(recorded_ticks, -1, 9);
    ASSERT_TRUE(contacts);
    EXPECT_EQ(contacts->tick, recorded_ticks);
    EXPECT_EQ(contacts->part, "contacts");
    const auto shorter = play(200, -1, 2);
    ASSERT_TRUE(shorter);
    EXPECT_EQ(shorter->tick, 201);
    EXPECT_EQ(shorter->part, "length");
}

TEST(Verifier, names_parts_that_were_exchanged) {
    CaseHeader now = header();
    EXPECT_TRUE(changed_parts(header(), now).empty());
    now.hashes.erase("plugin/org.calot.virtual-operator");
    EXPECT_TRUE(changed_parts(header(), now).empty()) << "the record stands in for the device";
    now.hashes["scene"] = "cc";
    now.hashes["mesh/liver"] = "dd";
    now.hashes.erase("plugin/org.calot.rod-cosserat");
    const auto lines = changed_parts(header(), now);
    ASSERT_EQ(lines.size(), 3u);
    EXPECT_EQ(lines[1], "scene: is not the one that the case was run with");
}

} // namespace calot::cases

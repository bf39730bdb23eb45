#include "host/manifest.hpp"
#include "host/toml.hpp"

#include <calot/abi/common.h>

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <unistd.h>

using namespace calot::host;
namespace fs = std::filesystem;

namespace {

const std::string good = R"(id = "org.example.rod"
title = "Elastic rod"
version = "1.0.0"
library = "rod.so"
platform = "linux-x86_64"

[contract]
major = 0
minor = 1
fingerprint = "0x1234"

[extensions]
optional = ["calot.cost/1"]

[[model]]
kind = "rod"
budget_microseconds = 147
claims = ["rest"]

[[model]]
kind = "procedure"
id = "org.example.procedure"
title = "Push"

[model.procedure]
specialty = "Surgery"
level = "basic"
minutes = 1.5
picture = "pictures/push.png"
description = "Push."
demonstration = { device = "org.example.device", seed = 3, skill = "novice" }

[[asset]]
path = "pictures/push.png"
sha256 = "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef"
)";

class ManifestFile : public testing::Test {
  protected:
    fs::path folder = fs::temp_directory_path() / ("calot-manifest-" + std::to_string(getpid()));
    fs::path file = folder / "plugin.toml";
    void SetUp() override { fs::create_directories(folder); }
    void TearDown() override { fs::remove_all(folder); }

    ManifestReading read(const std::string& text) {
        std::ofstream(file, std::ios::binary) << text;
        return read_manifest(file);
    }
    static std::string with(const std::string& from, const std::string& to) {
        const std::size_t at = good.find(from);
        if (at == std::string::npos) throw std::logic_error("the good manifest lacks " + from);
        return std::string(good).replace(at, from.size(), to);
    }
};

TEST(Toml, characters_outside_ascii_are_found_where_toml_allows_none) {
    EXPECT_EQ(line_of_stray_byte("a = 1\n# \xC3\xA9\nb = \"\xC3\xA9\"\n"), 0u)
        << "texts and comments may have them";
    EXPECT_EQ(line_of_stray_byte("\xEF\xBB\xBF"
                                 "a = 1"),
              0u)
        << "a byte order mark";
    EXPECT_EQ(line_of_stray_byte("a = 1\n\xCD\x99 = 2"), 2u);
    EXPECT_EQ(line_of_stray_byte("a = \"\"\"x\n\"\" \xC3\xA9\"\"\"\"\nb = 1\n"), 0u)
        << "quotes in a long text";
    EXPECT_EQ(line_of_stray_byte("a = '\xC3\xA9'\nb = '''\n\xC3\xA9'''\n\xC3\xA9"), 4u);
    EXPECT_EQ(line_of_stray_byte("a = \"\\\"\xC3\xA9\"\n\n\xC3\xA9"), 3u) << "an escaped quote ends no text";
}

} // namespace

TEST_F(ManifestFile, is_read_with_every_field) {
    const ManifestReading reading = read(good);
    ASSERT_TRUE(reading.manifest) << reading.refusal;
    const Manifest& m = *reading.manifest;
    EXPECT_EQ(m.id, "org.example.rod");
    EXPECT_EQ(m.contract_fingerprint, 0x1234u);
    EXPECT_TRUE(m.has_extension("calot.cost/1"));
    ASSERT_EQ(m.models.size(), 2u);
    EXPECT_EQ(m.models[0].id, "org.example.rod");
    EXPECT_EQ(m.models[0].title, "Elastic rod");
    EXPECT_EQ(m.models[0].claims, std::vector<std::string>{"rest"});
    EXPECT_EQ(m.models[1].id, "org.example.procedure");
    ASSERT_TRUE(m.models[1].procedure);
    EXPECT_EQ(m.models[1].procedure->minutes, 1.5);
    ASSERT_TRUE(m.models[1].procedure->demonstration);
    EXPECT_EQ(m.models[1].procedure->demonstration->seed, 3u);
    EXPECT_EQ(m.assets.at(0).path, "pictures/push.png");
    EXPECT_EQ(reading.ids, (std::vector<std::string>{"org.example.rod", "org.example.procedure"}));
}

TEST_F(ManifestFile, that_is_malformed_names_file_and_field) {
    const struct {
        std::string from, to, field;
    } cases[] = {
        {"id = \"org.example.rod\"\n", "", "id"},
        {"\"org.example.rod\"", "\"Org Example\"", "id"},
        {"\"org.example.rod\"", "\"rod\"", "id"},
        {"\"Elastic rod\"", "7", "title"},
        {"\"Elastic rod\"", "\"" + std::string(101, 'x') + "\"", "title"},
        {"\"Elastic rod\"", "\"two\\nlines\"", "title"},
        {"\"1.0.0\"", "\"1.0\"", "version"},
        {"\"rod.so\"", "\"../rod.so\"", "library"},
        {"\"rod.so\"", "\"/lib/rod.so\"", "library"},
        {"major = 0", "major = \"0\"", "contract.major"},
        {"minor = 1", "minor = -1", "contract.minor"},
        {"minor = 1", "minor = 1.5", "contract.minor"},
        {"\"0x1234\"", "\"1234\"", "contract.fingerprint"},
        {"\"0x1234\"", "\"0xghij\"", "contract.fingerprint"},
        {"[contract]", "[kontract]", "contract"},
        {"optional = [", "wished = [", "extensions.wished"},
        {"kind = \"rod\"", "kind = \"rope\"", "model[0].kind"},
        {"budget_microseconds = 147", "budget_microseconds = 0", "model[0].budget_microseconds"},
        {"budget_microseconds = 147", "budget_microseconds = nan", "model[0].budget_microseconds"},
        {"budget_microseconds = 147\n", "", "model[0].budget_microseconds"},
        {"claims = [\"rest\"]", "claims = \"rest\"", "model[0].claims"},
        {"claims = [\"rest\"]", "claims = [1]", "model[0].claims[0]"},
        {"id = \"org.example.procedure\"", "id = \"org.example.rod\"", "model[1].id"},
        {"level = \"basic\"", "level = \"easy\"", "model[1].procedure.level"},
        {"minutes = 1.5", "minutes = -1", "model[1].procedure.minutes"},
        {"picture = \"pictures/push.png\"", "picture = \"other.png\"", "model[1].procedure.picture"},
        {"seed = 3", "seed = -3", "model[1].procedure.demonstration.seed"},
        {"skill = \"novice\"", "skill = \"master\"", "model[1].procedure.demonstration.skill"},
        {"path = \"pictures/push.png\"", "path = \"../push.png\"", "asset[0].path"},
        {"path = \"pictures/push.png\"", "path = \"/etc/passwd\"", "asset[0].path"},
        {"path = \"pictures/push.png\"", "path = \"a//b.png\"", "asset[0].path"},
        {"0123456789abcdef0123", "0123", "asset[0].sha256"},
        {"version = \"1.0.0\"", "version = \"1.0.0\"\nauthor = \"me\"", "author"},
        {"\"Elastic rod\"", "\"Elastic \xff rod\"", "line 2"},
        {"\"Elastic rod\"", "\"Elastic rod", "line 2"},
    };
    for (const auto& c : cases) {
        const ManifestReading reading = read(with(c.from, c.to));
        EXPECT_FALSE(reading.manifest) << "accepted: " << c.to;
        EXPECT_TRUE(reading.refusal.starts_with(file.string() + ": " + c.field + ": "))
            << "wanted field " << c.field << ", got: " << reading.refusal;
        EXPECT_EQ(reading.refusal.find('\n'), std::string::npos) << "more than one line: " << reading.refusal;
    }
}

TEST_F(ManifestFile, that_is_refused_still_gives_the_ids_it_holds) {
    const ManifestReading reading = read(with("level = \"basic\"", "level = 5"));
    EXPECT_FALSE(reading.manifest);
    EXPECT_EQ(reading.ids, (std::vector<std::string>{"org.example.rod", "org.example.procedure"}));
}

TEST_F(ManifestFile, that_is_too_long_or_no_file_is_refused) {
    EXPECT_NE(read(good + "# " + std::string(70000, 'x')).refusal.find("64 KiB"), std::string::npos);
    EXPECT_NE(read_manifest(folder).refusal.find("regular file"), std::string::npos);
    EXPECT_NE(read_manifest(folder / "none").refusal, "");
    std::string deep = good + "x = ";
    for (int i = 0; i < 20000; ++i)
        deep += "[";
    EXPECT_FALSE(read(deep).manifest);
}

TEST_F(ManifestFile, for_another_contract_or_platform_does_not_fit) {
    ManifestReading reading = read(good);
    ASSERT_TRUE(reading.manifest);
    Manifest& m = *reading.manifest;
    m.contract_major = CALOT_ABI_MAJOR, m.contract_minor = CALOT_ABI_MINOR;
    m.contract_fingerprint = CALOT_ABI_FINGERPRINT;
    const Manifest fitting = m;
    EXPECT_EQ(misfit(fitting), "");
    m.contract_minor += 1;
    EXPECT_NE(misfit(m).find("contract.minor"), std::string::npos) << misfit(m);
    m = fitting;
    m.contract_fingerprint ^= 1;
    EXPECT_NE(misfit(m).find("contract.fingerprint"), std::string::npos) << misfit(m);
    m = fitting;
    m.platform = "beos-m68k";
    EXPECT_NE(misfit(m).find("platform"), std::string::npos) << misfit(m);
    m = fitting;
    m.required_extensions = {"calot.time-machine/1"};
    EXPECT_NE(misfit(m).find("time-machine"), std::string::npos) << misfit(m);
}

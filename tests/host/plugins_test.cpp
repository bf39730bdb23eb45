// The host against the small good and bad plugins of tests/plugins.
#include "host/blame.hpp"
#include "host/error.hpp"
#include "host/plugins.hpp"
#include "host/services.hpp"

#include <calot/abi/plugin.h>

#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>
#include <unistd.h>

using namespace calot::host;
namespace fs = std::filesystem;

namespace {

const fs::path binaries = CALOT_BINARY_DIR;
const fs::path good = binaries / "lib/calot/test-plugins/good";
const fs::path bad = binaries / "lib/calot/test-plugins/bad";

Plugins::Options in(std::vector<fs::path> folders) {
    Plugins::Options options;
    options.probe_program = binaries / "bin/calot-probe";
    for (const fs::path& folder : folders)
        options.places.push_back({folder, "test", false, 0});
    return options;
}

std::string refusal_of(Plugins& plugins, const std::string& id) {
    for (const Candidate& candidate : plugins.candidates())
        if (candidate.holds(id)) return plugins.probe(candidate);
    return "not found";
}

// A copy of a good plugin's folder that a test may spoil.
class SpoiltPlugin : public testing::Test {
  protected:
    fs::path place = fs::temp_directory_path() / ("calot-spoilt-" + std::to_string(getpid()));
    fs::path folder = place / "models";
    Services services;

    void SetUp() override {
        fs::create_directories(place);
        fs::copy(good / "test-models", folder, fs::copy_options::recursive);
    }
    void TearDown() override { fs::remove_all(place); }
    void rewrite(const std::string& from, const std::string& to) {
        std::stringstream text;
        text << std::ifstream(folder / "plugin.toml").rdbuf();
        const std::string before = text.str();
        const std::string after = std::regex_replace(before, std::regex(from), to);
        ASSERT_NE(before, after) << "the manifest lacks " << from;
        std::ofstream(folder / "plugin.toml") << after;
    }
    std::string refusal() {
        Plugins plugins(services, in({place}));
        EXPECT_EQ(plugins.candidates().size(), 1u);
        return plugins.candidates().empty() ? "nothing found" : plugins.probe(plugins.candidates()[0]);
    }
};

} // namespace

TEST(Plugins, that_are_sound_are_found_probed_and_made) {
    Services services;
    Plugins plugins(services, in({good}));
    for (const Candidate& candidate : plugins.candidates())
        EXPECT_EQ(plugins.probe(candidate), "");
    EXPECT_EQ(plugins.models(Kind::tissue).size(), 1u);
    EXPECT_EQ(plugins.models(Kind::device).size(), 2u) << "one in C++, one in C";
    for (const auto& [kind, id] : {std::pair{Kind::rod, "org.calot.test.rod"},
                                   {Kind::tissue, "org.calot.test.tissue"},
                                   {Kind::instrument, "org.calot.test.instrument"},
                                   {Kind::device, "org.calot.test.device"},
                                   {Kind::procedure, "org.calot.test.procedure"},
                                   {Kind::device, "org.calot.test.c-device"}}) {
        Instance instance = plugins.make(kind, id);
        ASSERT_TRUE(instance) << id;
        EXPECT_EQ(instance.id(), id);
        EXPECT_EQ(instance.library_hash().size(), 64u);
        calot_instance* const before = instance.abi();
        const Instance moved = std::move(instance);
        EXPECT_EQ(moved.abi(), before) << "an instance must stay where it is when its handle moves";
    }
    EXPECT_EQ(culprit_of(blame(), present_call()).plugin, "") << "a call was marked and never left";
}

TEST(Plugins, that_crash_or_hang_while_loading_are_refused_and_the_host_lives) {
    Services services;
    Plugins plugins(services, in({bad}));
    EXPECT_NE(refusal_of(plugins, "org.calot.test.bad-abort").find("crashes while it is loaded"),
              std::string::npos)
        << refusal_of(plugins, "org.calot.test.bad-abort");
    const auto begin = std::chrono::steady_clock::now();
    EXPECT_NE(refusal_of(plugins, "org.calot.test.bad-hang").find("hangs while it is loaded"),
              std::string::npos);
    EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(10));
    EXPECT_NE(refusal_of(plugins, "org.calot.test.bad-no-entry").find(CALOT_ENTRY_SYMBOL), std::string::npos);
    EXPECT_NE(refusal_of(plugins, "org.calot.test.bad-version").find("of the contract"), std::string::npos)
        << refusal_of(plugins, "org.calot.test.bad-version");
    EXPECT_THROW(plugins.make(Kind::device, "org.calot.test.bad-abort"), UserError);
}

TEST(Plugins, that_are_not_there_or_of_another_kind_are_named) {
    Services services;
    Plugins plugins(services, in({good, "/nowhere"}));
    EXPECT_FALSE(plugins.places()[1].exists);
    try {
        plugins.find(Kind::rod, "org.calot.test.rood");
        FAIL() << "found";
    } catch (const UserError& e) {
        EXPECT_NE(std::string(e.what()).find("calot why org.calot.test.rood"), std::string::npos) << e.what();
    }
    try {
        plugins.find(Kind::rod, "org.calot.test.device");
        FAIL() << "found";
    } catch (const UserError& e) {
        EXPECT_NE(std::string(e.what()).find("is a device, a rod is needed"), std::string::npos) << e.what();
    }
}

TEST(Plugins, with_an_id_that_is_taken_are_refused_and_the_first_stays) {
    Services services;
    Plugins plugins(services, in({good, good}));
    EXPECT_EQ(plugins.models(Kind::rod).size(), 1u);
    std::size_t refused = 0;
    for (const Candidate& candidate : plugins.candidates())
        refused += candidate.refusal.find("is already given by") != std::string::npos;
    EXPECT_EQ(refused, plugins.candidates().size() / 2);
}

TEST_F(SpoiltPlugin, whose_library_is_missing_names_the_field) {
    fs::remove(folder / "test-models.so");
    EXPECT_NE(refusal().find("plugin.toml: library: \"test-models.so\" is not there"), std::string::npos)
        << refusal();
}

TEST_F(SpoiltPlugin, whose_library_is_truncated_is_refused) {
    fs::resize_file(folder / "test-models.so", fs::file_size(folder / "test-models.so") / 2);
    EXPECT_NE(refusal().find("test-models.so: "), std::string::npos) << refusal();
    fs::resize_file(folder / "test-models.so", 10);
    EXPECT_NE(refusal().find("truncated"), std::string::npos) << refusal();
}

TEST_F(SpoiltPlugin, whose_manifest_says_other_than_the_library_is_refused) {
    rewrite("Test: a rigid straight rod", "Another title");
    EXPECT_NE(refusal().find("Another title"), std::string::npos) << refusal();
}

TEST_F(SpoiltPlugin, whose_manifest_names_other_models_is_refused) {
    rewrite("org\\.calot\\.test\\.tissue", "org.calot.test.other");
    EXPECT_NE(refusal().find("org.calot.test.tissue"), std::string::npos) << refusal();
}

TEST_F(SpoiltPlugin, for_another_version_of_the_contract_names_the_field) {
    rewrite("major = \\d+", "major = 9");
    EXPECT_NE(refusal().find("plugin.toml: contract.major: "), std::string::npos) << refusal();
}

TEST_F(SpoiltPlugin, whose_asset_is_truncated_names_the_file_when_it_is_read) {
    Plugins plugins(services, in({place}));
    const Manifest& manifest = *plugins.candidates().at(0).reading.manifest;
    ASSERT_FALSE(manifest.assets.empty());
    const auto read = [&](const std::string& path) {
        const PluginHost host(services, manifest);
        const auto* assets = static_cast<const calot_assets*>(
            host.abi()->service(host.abi(), abi_string(CALOT_SERVICE_ASSETS)));
        calot_bytes bytes{};
        calot_error error{};
        error.struct_size = sizeof error;
        const calot_status status = assets->read(assets->self, abi_string(path), &bytes, &error);
        return status == CALOT_OK ? std::string("ok") : std::string(error.field) + ": " + error.message;
    };
    EXPECT_EQ(read("picture.png"), "ok");
    EXPECT_NE(read("../models/picture.png").find("not among the manifest's assets"), std::string::npos);
    fs::resize_file(folder / "picture.png", 10);
    EXPECT_NE(read("picture.png").find("truncated or changed"), std::string::npos) << read("picture.png");
    fs::remove(folder / "picture.png");
    EXPECT_NE(read("picture.png").find("is missing"), std::string::npos) << read("picture.png");
}

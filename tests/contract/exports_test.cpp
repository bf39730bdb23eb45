// What a built plugin shows to the outside: two symbols, and through them the models that it holds.
#include <calot/abi/plugin.h>
#include <calot/span.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstring>
#include <dlfcn.h>
#include <memory>
#include <string>
#include <vector>

namespace {

const std::string folder = CALOT_BINARY_DIR "/lib/calot/test-plugins/good/";

std::vector<std::string> exported(const std::string& library) {
    const std::string command = "nm -D --defined-only --format=posix '" + library + "'";
    const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), &pclose);
    std::vector<std::string> names;
    std::array<char, 512> line;
    while (pipe && std::fgets(line.data(), line.size(), pipe.get()) != nullptr)
        names.push_back(std::string(line.data()).substr(0, std::strcspn(line.data(), " ")));
    std::sort(names.begin(), names.end());
    return names;
}

class Plugin : public testing::TestWithParam<const char*> {
  protected:
    std::string library() const { return folder + GetParam() + "/" + GetParam() + ".so"; }
};

TEST_P(Plugin, exports_exactly_two_symbols) {
    EXPECT_EQ(exported(library()), (std::vector<std::string>{CALOT_DESCRIPTOR_SYMBOL, CALOT_ENTRY_SYMBOL}))
        << library();
}

TEST_P(Plugin, offers_models_that_can_be_made_and_refuses_other_ids_and_hosts) {
    void* handle = dlopen(library().c_str(), RTLD_NOW | RTLD_LOCAL);
    ASSERT_NE(handle, nullptr) << dlerror();
    const auto* descriptor = static_cast<const calot_descriptor*>(dlsym(handle, CALOT_DESCRIPTOR_SYMBOL));
    ASSERT_NE(descriptor, nullptr);
    EXPECT_EQ(std::string_view(descriptor->magic, 8), CALOT_MAGIC);
    EXPECT_EQ(descriptor->abi_fingerprint, CALOT_ABI_FINGERPRINT);
    const auto entry = reinterpret_cast<calot_entry>(dlsym(handle, CALOT_ENTRY_SYMBOL));
    ASSERT_NE(entry, nullptr);

    calot_host host{};
    host.struct_size = sizeof host;
    host.abi_major = CALOT_ABI_MAJOR, host.abi_minor = CALOT_ABI_MINOR + 1;
    host.abi_fingerprint = CALOT_ABI_FINGERPRINT;
    host.service = [](const calot_host*, calot_string) -> const void* { return nullptr; };
    calot_library plugin{};
    plugin.struct_size = sizeof plugin;
    calot_error error{};
    error.struct_size = sizeof error;
    EXPECT_EQ(entry(&host, &plugin, &error), CALOT_ERROR);
    EXPECT_EQ(error.code, CALOT_CODE_VERSION) << error.message;

    host.abi_minor = CALOT_ABI_MINOR;
    ASSERT_EQ(entry(&host, &plugin, &error), CALOT_OK) << error.message;
    EXPECT_EQ(plugin.factory(plugin.self, calot::string("rodeo")), nullptr);
    int models = 0;
    for (const char* kind : {"rod", "tissue", "instrument", "device", "procedure"}) {
        const calot_factory* factory = plugin.factory(plugin.self, calot::string(kind));
        if (factory == nullptr) continue;
        for (std::uint32_t i = 0; i < factory->count(factory->self); ++i, ++models) {
            calot_model_info info{};
            info.struct_size = sizeof info;
            ASSERT_EQ(factory->info(factory->self, i, &info, &error), CALOT_OK);
            calot_instance instance{};
            instance.struct_size = sizeof instance;
            ASSERT_EQ(factory->create(factory->self, info.id, &host, &instance, &error), CALOT_OK)
                << error.message;
            EXPECT_EQ(instance.init(instance.self, &error), CALOT_OK) << error.message;
            instance.destroy(instance.self);
            const std::string rubbish = std::string(calot::view(info.id)) + "x";
            EXPECT_EQ(factory->create(factory->self, calot::string(rubbish), &host, &instance, &error),
                      CALOT_ERROR);
        }
        EXPECT_EQ(factory->info(factory->self, factory->count(factory->self), nullptr, &error), CALOT_ERROR);
    }
    EXPECT_GT(models, 0);
}

INSTANTIATE_TEST_SUITE_P(Good, Plugin, testing::Values("test-models", "test-c-device"),
                         [](const auto& info) { return info.index == 0 ? "in_cpp" : "in_c"; });

} // namespace

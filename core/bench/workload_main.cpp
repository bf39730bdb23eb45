// calot-workload PLUGINS WHAT [MODEL] REPEATS: one workload and nothing else, for counters of instructions.
// What is to be counted happens within calot_counted_work.
#include "bench/workloads.hpp"
#include "host/error.hpp"
#include "host/plugins.hpp"
#include "host/services.hpp"

#include <cstdio>
#include <cstdlib>
#include <filesystem>

namespace {

extern "C" [[gnu::noinline]] void calot_counted_work(calot::bench::Workload& work) {
    work.run();
    asm volatile(""); // no tail call: the counter sees the return
}

} // namespace

int main(int count, char** words) {
    using namespace calot;
    if (count != 4 && count != 5) {
        std::fprintf(stderr, "usage: calot-workload PLUGINS-FOLDER WHAT [MODEL] REPEATS\n");
        return 2;
    }
    const int repeats = std::atoi(words[count - 1]);
    try {
        host::Services services;
        host::Plugins::Options options = host::Plugins::defaults();
        options.places = {{.folder = words[1], .origin = "the command line"}};
        options.probe_program = std::filesystem::read_symlink("/proc/self/exe").parent_path() / "calot-probe";
        host::Plugins plugins(services, options);
        std::unique_ptr<bench::Workload> work;
        if (count == 5)
            work = bench::rod_workload(words[2], [&] { return plugins.make(host::Kind::rod, words[3]); });
        else
            work = bench::plain_workload(words[2]);
        if (work == nullptr || repeats < 1) {
            std::fprintf(stderr, "calot-workload: nothing is called %s, or no repeats are asked for\n",
                         words[2]);
            return 2;
        }
        for (int k = 0; k < 500; ++k) // what it needs is at hand, and the start is over
            work->prepare(), work->run();
        for (int k = 0; k < repeats; ++k) {
            work->prepare();
            calot_counted_work(*work);
        }
    } catch (const std::exception& e) {
        std::fprintf(stderr, "calot-workload: %s\n", e.what());
        return 1;
    }
    return 0;
}

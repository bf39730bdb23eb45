// What the program calot-probe does: loads one library and looks whether the process is still as it was.
#include "host/error.hpp"
#include "host/library.hpp"
#include "host/manifest.hpp"
#include "host/probe.hpp"
#include "host/services.hpp"

#include <cfenv>
#include <clocale>
#include <cstring>
#include <dirent.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#if defined(__x86_64__)
#include <xmmintrin.h>
#endif

extern char** environ;

namespace calot::host {
namespace {

struct Surroundings {
    unsigned floating_point = 0;
    int rounding = 0;
    std::string locale, folder, environment, signals;
    int threads = 0;

    static Surroundings now() {
        Surroundings s;
#if defined(__x86_64__)
        s.floating_point = _mm_getcsr() & ~0x3fu; // without the flags that any operation sets
#endif
        s.rounding = std::fegetround();
        s.locale = std::setlocale(LC_ALL, nullptr);
        char buffer[4096];
        s.folder = getcwd(buffer, sizeof buffer) == nullptr ? "" : buffer;
        for (char** e = environ; e != nullptr && *e != nullptr; ++e)
            s.environment += *e, s.environment += '\n';
        for (int number = 1; number < NSIG; ++number) {
            struct sigaction action {};
            if (sigaction(number, nullptr, &action) != 0) continue;
            s.signals.append(reinterpret_cast<const char*>(&action.sa_handler), sizeof action.sa_handler);
        }
        if (DIR* tasks = opendir("/proc/self/task")) {
            while (const dirent* entry = readdir(tasks))
                s.threads += entry->d_name[0] != '.';
            closedir(tasks);
        }
        return s;
    }

    // What differs, in words; empty if nothing does.
    std::string difference(const Surroundings& after) const {
        if (floating_point != after.floating_point || rounding != after.rounding)
            return "the floating-point mode (is it, or a library it uses, linked with -ffast-math?)";
        if (locale != after.locale) return "the locale";
        if (folder != after.folder) return "the working directory";
        if (environment != after.environment) return "the environment";
        if (signals != after.signals) return "signal handlers";
        if (threads != after.threads) return "the number of threads";
        return "";
    }
};

} // namespace

int answer_probe(const std::filesystem::path& manifest_file, int answer) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    const rlimit none{0, 0};
    setrlimit(RLIMIT_CORE, &none);
    std::string result = "ok";
    const ManifestReading reading = read_manifest(manifest_file);
    if (!reading.manifest) {
        result = reading.refusal;
    } else {
        Services services(1);
        const Surroundings before = Surroundings::now();
        try {
            const Library library(*reading.manifest, services);
            const std::string changed = before.difference(Surroundings::now());
            if (!changed.empty())
                throw UserError(reading.manifest->library_file().string(), "",
                                "changes " + changed +
                                    " when it is loaded; repair the plugin or remove its folder");
        } catch (const std::exception& e) {
            result = e.what();
        }
    }
    result += '\n';
    const bool is_told = write(answer, result.data(), result.size()) == static_cast<ssize_t>(result.size());
    // Without static destructors: the library was only looked at.
    _exit(is_told ? 0 : 1);
}

} // namespace calot::host

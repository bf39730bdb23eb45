// The plugins of the build tree, for this folder's tests.
#pragma once

#include "host/plugins.hpp"
#include "host/services.hpp"

namespace calot::bench {

/// Looked for once. CALOT_BINARY_DIR is the test's own definition.
inline host::Plugins& plugins() {
    static host::Services services;
    static host::Plugins all(services, [] {
        host::Plugins::Options options = host::Plugins::defaults();
        options.places = {{.folder = CALOT_BINARY_DIR "/lib/calot/plugins", .origin = "the build"}};
        options.probe_program = CALOT_BINARY_DIR "/bin/calot-probe";
        return options;
    }());
    return all;
}

} // namespace calot::bench

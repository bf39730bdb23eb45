/* Never comes back from being loaded. */
#include <calot/abi/plugin.h>

#include <unistd.h>

CALOT_EXPORT const calot_descriptor calot_plugin_descriptor = {
    {'C', 'A', 'L', 'O', 'T', 'P', 'L', 'G'}, CALOT_ABI_MAJOR, CALOT_ABI_MINOR, CALOT_ABI_FINGERPRINT};

CALOT_EXPORT calot_status calot_plugin_entry(const calot_host* host, calot_library* out, calot_error* error) {
    (void)host, (void)out, (void)error;
    return CALOT_ERROR;
}

__attribute__((constructor)) static void on_load(void) {
    for (;;)
        pause();
}

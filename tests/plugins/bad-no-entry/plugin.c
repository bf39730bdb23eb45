/* Has the descriptor, but no entry. */
#include <calot/abi/plugin.h>

CALOT_EXPORT const calot_descriptor calot_plugin_descriptor = {
    {'C', 'A', 'L', 'O', 'T', 'P', 'L', 'G'}, CALOT_ABI_MAJOR, CALOT_ABI_MINOR, CALOT_ABI_FINGERPRINT};

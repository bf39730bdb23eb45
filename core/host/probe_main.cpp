// calot-probe MANIFEST: loads a plugin's library and answers on descriptor 3. The host starts it; see
// probe.hpp.
#include "host/probe.hpp"

#include <cstdio>

int main(int count, char** arguments) {
    if (count != 2) {
        std::fputs("calot-probe: started by calot to try a plugin's library; use `calot why ID`\n", stderr);
        return 2;
    }
    return calot::host::answer_probe(arguments[1], 3);
}

#include "keyboard.hpp"

#include <calot/plugin.hpp>

CALOT_PLUGIN(calot::export_device<calot::keyboard::Keyboard>("org.calot.keyboard", "Keyboard and mouse",
                                                             "0.1.0"))

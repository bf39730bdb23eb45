#include "virtual_operator.hpp"

#include <calot/plugin.hpp>

CALOT_PLUGIN(calot::export_device<calot::virtual_operator::VirtualOperator>("org.calot.virtual-operator",
                                                                            "Virtual operator", "0.1.0"))

#include "procedure.hpp"

#include <calot/plugin.hpp>

CALOT_PLUGIN(calot::export_procedure<calot::transgastric::TransgastricCholecystectomy>(
    "org.calot.transgastric-cholecystectomy", "Hybrid trans-gastric cholecystectomy", "0.1.0"))

/* Calot plugin contract: everything. */
#ifndef CALOT_ABI_PLUGIN_H
#define CALOT_ABI_PLUGIN_H

#include "common.h"
#include "contact.h"
#include "device.h"
#include "instrument.h"
#include "procedure.h"
#include "rod.h"
#include "tissue.h"

#endif

#ifndef ONCENTER_VEHICLE_H
#define ONCENTER_VEHICLE_H
/* The truck of oncenter_vehicle.c, which `oncenter export c --vehicle` writes. */

#include "monitor.h"

/* Changes the values that the vehicle file gives. */
void oncenter_vehicle_set(oc_vehicle *vehicle, oc_params *params);

#endif

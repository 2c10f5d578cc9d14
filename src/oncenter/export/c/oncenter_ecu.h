#ifndef ONCENTER_ECU_H
#define ONCENTER_ECU_H
/* One truck's monitor as an ECU project holds it, in static memory and by the names that oncenter.a2l describes. */

#include "monitor.h"

enum { ONCENTER_RATE_HZ = 100 }; /* of oncenter_ecu_tick */

/* Calibration: set or load them after oncenter_ecu_defaults; they hold from the next oncenter_ecu_start. */
extern oc_vehicle oncenter_vehicle;
extern oc_params oncenter_params;

/* Measurements: the tick that goes in, what it gave, what all ticks give. */
extern oc_signals oncenter_tick;
extern oc_output oncenter_output;
extern oc_answer oncenter_answer;

/* Once after power-up. The vehicle is left to calibration. */
void oncenter_ecu_defaults(void);

/* At each ignition. Says which part of calibration is wrong, or OC_OK; no tick is taken before that. What was learned
 * with another calibration is forgotten. */
oc_error oncenter_ecu_start(void);

/* At ONCENTER_RATE_HZ, once oncenter_tick is filled. */
void oncenter_ecu_tick(void);

/* As often as someone looks at oncenter_answer; never while oncenter_ecu_tick runs, nor it while this does. */
void oncenter_ecu_tell(void);

#endif

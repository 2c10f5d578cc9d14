#ifndef ONCENTER_ECU_H
#define ONCENTER_ECU_H
/* One truck's monitor in the static memory of an ECU project, with the names that oncenter.a2l describes. */

#include "monitor.h"

enum { ONCENTER_RATE_HZ = 100 }; /* of oncenter_ecu_tick */

/* Calibration: set or load them after oncenter_ecu_defaults. Effective from the next oncenter_ecu_start on. */
extern oc_vehicle oncenter_vehicle;
extern oc_params oncenter_params;

/* Measurements: the input tick, its output, the answer of all ticks. */
extern oc_signals oncenter_tick;
extern oc_output oncenter_output;
extern oc_answer oncenter_answer;

/* Once after power-up. Does not set oncenter_vehicle. */
void oncenter_ecu_defaults(void);

/* At each ignition. Returns OC_OK, or the wrong part of the calibration; then ticks are ignored. Clears the state if
 * the calibration has changed. */
oc_error oncenter_ecu_start(void);

/* At ONCENTER_RATE_HZ, after oncenter_tick is filled. */
void oncenter_ecu_tick(void);

/* Updates oncenter_answer, when it is read. Must not interrupt oncenter_ecu_tick, nor be interrupted by it. */
void oncenter_ecu_update_answer(void);

#endif

#ifndef OC_TICK_H
#define OC_TICK_H
/* One tick in Figure 15: each step sets its values. */

#include <stdbool.h>
#include <stdint.h>

#include "angle.h"
#include "estimate.h"
#include "motion.h"
#include "preprocess.h"
#include "signals.h"

typedef struct {
    oc_signals signals;          /* valid bits: usable measurements */
    uint32_t measured;           /* valid bits of all measurements, including an angle sensor at fault */
    uint32_t reasons;            /* oc_reason bits of an unused tick; 0: used */
    bool clock_set_back;         /* earlier times are of another clock */
    bool after_hole;             /* first tick after a hole */
    bool after_gap;              /* the same for the angle, whatever signals are missing */
    bool stands;                 /* the truck stands */
    double creep;                /* rad/s, yaw rate if it creeps while its speed reads zero; 0: it rolls */
    bool moves;                  /* filtered values and motion are of this tick */
    bool suspected;              /* the angle sensor may be at fault */
    uint32_t statuses;           /* bits of the statuses that are true, debounced */
    uint32_t disturbed;          /* oc_reason bits by the statuses: intervention, reverse, steering assist */
    uint32_t at_fault;           /* valid bits of signals that are not what their names say */
    double yaw_rate_bias, yaw_rate_bias_sd; /* rad/s */
    oc_sensed sensed;            /* by the method's sensors, not filtered */
    oc_filtered filtered;        /* with the method's correction of the yaw rate */
    oc_motion motion;
    oc_angle_tick observed;      /* for the angle without its sensor */
    oc_angle angle;              /* zero where the tick is rejected */
} oc_tick;

#endif

#ifndef OC_TICK_H
#define OC_TICK_H
/* One tick on its way through Figure 15: each step adds its values. */

#include <stdbool.h>
#include <stdint.h>

#include "angle.h"
#include "estimate.h"
#include "motion.h"
#include "preprocess.h"
#include "signals.h"

typedef struct {
    oc_signals signals;          /* valid bits: measurements that may be used */
    uint32_t measured;           /* valid bits of all measurements, also of an angle sensor at fault */
    uint32_t reasons;            /* oc_reason, why the tick is unused; 0: used */
    bool clock_set_back;         /* times before it are of another clock */
    bool after_hole;             /* too long after the tick before it */
    bool stands;                 /* the truck stands */
    bool moves;                  /* the filtered values and motion are of this tick; else zero */
    bool suspected;                /* the angle's sensor may be at fault */
    double yaw_rate_bias, yaw_rate_bias_sd; /* rad/s */
    oc_sensed sensed;            /* by the method's sensors, not yet filtered */
    oc_filtered filtered;        /* with the method's correction of the yaw rate */
    oc_motion motion;
    oc_angle angle;              /* zero where the tick is refused */
} oc_tick;

#endif

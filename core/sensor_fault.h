#ifndef OC_SENSOR_FAULT_H
#define OC_SENSOR_FAULT_H
/* Whether the steering wheel angle sensor tells what the truck does: measured against estimated angle.
 *
 * A difference that lasts beyond `limit` is a fault, which has a name by how it came. It is over when the difference
 * has long been small again. Judged above 8 m/s, where the estimate is good; a signal that is lost, anywhere. */

#include <stdbool.h>
#include <stdint.h>

typedef enum {
    OC_FAULT_NONE,
    OC_FAULT_LOST,       /* no value any more */
    OC_FAULT_STUCK,      /* always the same value, whatever the truck does */
    OC_FAULT_JUMPED,     /* off since one tick */
    OC_FAULT_DRIFTING,   /* more and more off */
    OC_FAULT_WRONG_SIGN, /* left is right */
    OC_FAULT_REMOUNTED,  /* off since a stop or a hole */
    OC_FAULT_COUNT
} oc_fault;

typedef struct {
    double time, tick_s; /* s */
    double measured;     /* rad, as the sensor says it */
    double offset;       /* rad, as learned so far */
    double estimate, sd; /* rad */
    double speed;        /* m/s */
    bool has_measured;
    bool can_judge;      /* the truck was learned */
} oc_fault_tick;

typedef struct {
    int32_t running;
    oc_fault fault;
    double since;            /* s, when it began */
    double confidence;       /* at least so likely by Chebyshev's inequality, 0 to 1 */
    double missing_s, present_s;
    double offset, offset_s; /* rad, learned, some minutes late: learning follows a sensor that drifts; s behind it */
    double last;             /* rad, measured at the tick before */
    double held_value, held_estimate, held_s; /* since the measured value last changed */
    double wrong_s, well_s;  /* beyond the limit, not counting what came between; well within it, in a row */
    double stuck_s;
    double suspicious_since, last_well; /* s */
    double step_time, interruption_time; /* s, of the last step in one tick; of the last stop or hole */
    double mean_measured, mean_estimate, covariance, variance; /* fading sums of the last seconds */
} oc_fault_watch;

const char *oc_fault_name(oc_fault fault);

/* The fault there is now. */
oc_fault oc_fault_update(oc_fault_watch *watch, const oc_fault_tick *tick);

#endif

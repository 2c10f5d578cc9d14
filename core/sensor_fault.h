#ifndef OC_SENSOR_FAULT_H
#define OC_SENSOR_FAULT_H
/* Whether the steering wheel angle sensor tells what the truck does: measured against estimated angle.
 *
 * Three ways to a fault: a difference that lasts (a sum over what is beyond the borderline, for each side, and a mean),
 * bends the other way round (a sum of the log of the odds), a value that stays while the truck turns. It has a name by
 * how it came, and is over when the difference has long been small again; where it has long been as large, the sensor
 * sits elsewhere. Judged above 8 m/s, where the estimate is good; a signal that is lost, anywhere. A sensor that is
 * suspected must teach nothing, or what it is judged by follows it. */

#include <stdbool.h>
#include <stdint.h>

typedef enum {
    OC_FAULT_NONE,
    OC_FAULT_LOST,       /* no value any more */
    OC_FAULT_STUCK,      /* always the same value, whatever the truck does */
    OC_FAULT_JUMPED,     /* off since one tick */
    OC_FAULT_DRIFTING,   /* more and more off */
    OC_FAULT_WRONG_SIGN, /* left is right */
    OC_FAULT_REMOUNTED,  /* sits elsewhere since a stop or a hole, or where a drift left it */
    OC_FAULT_COUNT
} oc_fault;

typedef struct {
    double time;         /* s */
    float tick_s;        /* s */
    float judged_s;      /* s for which the difference is judged at this tick; 0: it is judged at a later one */
    float measured;     /* rad, as the sensor says it */
    float offset, offset_sd; /* rad, as learned so far */
    float estimate, sd; /* rad */
    float hidden;       /* how much is not known of the flank that the wheels are at, 0 to 1 */
    float speed;        /* m/s */
    bool has_measured;
    bool after_hole;     /* before it, time went on without ticks */
    bool can_judge;      /* the truck was learned */
} oc_fault_tick;

typedef struct {
    int32_t running;
    oc_fault fault;
    double since;            /* s, when it began */
    double last_time;        /* s, of the tick before */
    double suspicious_since, last_well; /* s */
    double step_time, interruption_time; /* s, of the last step in one tick; of the last stop or hole */
    double last_right;       /* s, when the odds of a wrong sign were last none */
    int32_t beyond;          /* the limit, now */
    float apart, steady_s;   /* rad, by which it is off, and for how long by no other */
    float confidence;       /* at least so likely by Chebyshev's inequality, 0 to 1 */
    float missing_s, present_s;
    float alike_s;           /* for which both were told without a step or hole; 2 at most */
    float offset, offset_sd; /* rad, learned, some minutes late: learning follows a sensor that drifts, */
    float offset_s;          /* and s behind them */
    float last;             /* rad, measured at the tick before */
    float held_value, held_estimate, held_s; /* since the measured value last changed */
    float held_fast_s;      /* of it, at speed */
    float mean;             /* limits, of the last half minute or so */
    float well_s;           /* well within the limit, in a row */
    float suspended_s;      /* not well within the limit, less a share of the time that it was */
    float wider;            /* of the limit, after drifts that went away by themselves */
    float stuck_s;
    float mean_measured, mean_estimate; /* rad, of the last seconds */
    float flipped;           /* log of the odds that left is right */
    float left, right;      /* limits x s beyond the borderline, to either side */
} oc_fault_watch;

/* Kept over ignition: a sensor at fault stays so until it has healed, and a truck judged more widely stays so. */
typedef struct {
    oc_fault fault;
    float confidence;
    float wider;
} oc_fault_evidence;

const char *oc_fault_name(oc_fault fault);

/* The fault there is now. A watch that is all zero begins with what was kept, as of the tick's time. */
oc_fault oc_fault_update(oc_fault_watch *watch, oc_fault_evidence *kept, const oc_fault_tick *tick);

/* Whether the sensor is not to be believed at this moment, be it a fault yet or not. */
bool oc_fault_beyond(const oc_fault_watch *watch);

/* Whether it may be at fault: then it is better not learned from, for a minute at most. */
bool oc_fault_suspected(const oc_fault_watch *watch);

#endif

#ifndef OC_SENSOR_FAULT_H
#define OC_SENSOR_FAULT_H
/* Monitor of the steering wheel angle sensor: measured against estimated angle.
 *
 * The first criterion is a lasting difference: a sum of its excess over a borderline, for each sign, and a mean. The
 * second is bends of reversed sign: a sum of the log of the odds. The third is a constant value while the truck turns.
 * The fault's name follows from its onset. It ends when the difference has long been small again. A sensor at a long
 * constant difference is remounted. The monitor judges above 8 m/s, where the estimate is accurate; it finds a lost
 * signal at any speed. A suspected sensor is not learned from, or the estimate would follow it. */

#include <stdbool.h>
#include <stdint.h>

typedef enum {
    OC_FAULT_NONE,
    OC_FAULT_LOST,       /* no signal */
    OC_FAULT_STUCK,      /* a constant value while the truck turns */
    OC_FAULT_JUMPED,     /* off by a step within one tick */
    OC_FAULT_DRIFTING,   /* increasingly off */
    OC_FAULT_WRONG_SIGN, /* sign is reversed */
    OC_FAULT_REMOUNTED,  /* another offset since a stop or a gap, or at the end of a drift */
    OC_FAULT_COUNT
} oc_fault;

typedef struct {
    double time;         /* s */
    float tick_s;        /* s */
    float judged_s;      /* s that this tick's check stands for; 0: no check at this tick */
    float measured;     /* rad, as measured */
    float offset, offset_sd; /* rad, as learned so far */
    float estimate, sd; /* rad */
    float hidden;       /* 0 to 1, how little the present flank of the play was loaded so far */
    float speed;        /* m/s */
    bool has_measured;
    bool after_hole;     /* first tick after a gap */
    bool can_judge;      /* the truck is identified */
} oc_fault_tick;

typedef struct {
    int32_t running;
    int32_t beyond;          /* the limit, at this tick */
    oc_fault fault;
    double since;            /* s, when it began */
    double last_time;        /* s, of the tick before */
    double suspicious_since, last_within; /* s */
    double step_time, interruption_time; /* s, of the last step in one tick; of the last stop or gap */
    double last_agreement;   /* s, when the odds of a reversed sign were last zero */
    float apart, rest_s;     /* rad, difference, and how long it has been constant */
    float confidence;       /* lower bound by Chebyshev's inequality, 0 to 1 */
    float missing_s, present_s;
    float paired_s;          /* for which both were available without a step or gap, 2 at most */
    float offset, offset_sd; /* rad, learned, delayed by minutes: learning follows a drifting sensor, */
    float offset_s;          /* and s behind them */
    float last;             /* rad, measured at the tick before */
    float held_value, held_estimate, held_s; /* since the measured value last changed */
    float held_fast_s;      /* of held_s, at speed */
    float mean;             /* limits, over some 20 s */
    float within_s;         /* without a break below half the limit */
    float suspended_s;      /* above half the limit, less a share of the time below */
    float wider;            /* share added to the limit, after drifts that ended by themselves */
    float stuck_s;
    float mean_measured, mean_estimate; /* rad, of the last seconds */
    float flipped;           /* log of the odds of a reversed sign */
    float left, right;      /* limits x s beyond the borderline, for either sign */
} oc_fault_watch;

/* Kept over ignition: a fault until the sensor has healed, and a wider limit for this truck. */
typedef struct {
    oc_fault fault;
    float confidence;
    float wider;
} oc_fault_evidence;

const char *oc_fault_name(oc_fault fault);

/* The present fault. A watch of zeros starts from the kept evidence at the tick's time. */
oc_fault oc_fault_update(oc_fault_watch *watch, oc_fault_evidence *kept, const oc_fault_tick *tick);

/* Whether this tick's measured angle is invalid: a fault, or a difference beyond the limit. */
bool oc_fault_beyond(const oc_fault_watch *watch);

/* Whether the sensor may be at fault: nothing is learned from it then, for a minute at most. */
bool oc_fault_suspected(const oc_fault_watch *watch);

#endif

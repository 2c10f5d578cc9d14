#ifndef OC_SENSOR_FAULT_H
#define OC_SENSOR_FAULT_H
/* Monitor of the steering wheel angle sensor: measured against estimated angle.
 *
 * The first criterion is a lasting difference: its excess over a borderline, summed for each sign, and its mean. The
 * second is a reversed sign in bends, by the log of the odds. The third is a constant value while the truck turns. The
 * onset determines the name of the fault. A fault ends when the difference has long been small again. A sensor with a
 * long constant difference counts as remounted. The monitor judges at speed, where the estimate is accurate. It
 * detects a lost signal at any speed. Nothing is learned from a suspected sensor, or the estimate would follow it. */

#include <stdbool.h>
#include <stdint.h>

typedef enum {
    OC_FAULT_NONE,
    OC_FAULT_LOST,       /* no signal */
    OC_FAULT_STUCK,      /* a constant value while the truck turns */
    OC_FAULT_JUMPED,     /* a new bias since a step in one tick */
    OC_FAULT_DRIFTING,   /* a growing bias */
    OC_FAULT_WRONG_SIGN, /* sign is reversed */
    OC_FAULT_REMOUNTED,  /* a new offset since a stop or a gap, or after a drift */
    OC_FAULT_COUNT
} oc_fault;

typedef struct {
    double time;         /* s */
    float tick_s;        /* s */
    float judged_s;      /* s that this tick's check covers; 0: no check at this tick */
    float measured;      /* rad, as measured */
    float estimate;      /* rad */
    float speed;         /* m/s */
    bool has_measured;
    bool after_hole;     /* first tick after a gap */
    bool assisted;       /* a motor steers: the wheel may rest in a bend */
    /* only where oc_fault_may_judge: */
    bool can_judge;      /* the truck is identified */
    bool is_accurate;    /* the truck is fast enough for the estimate */
    float offset, offset_sd; /* rad, as learned so far */
    float sd;            /* rad, of the estimate */
    float flank_deficit; /* 0 to 1, share that the present flank of the play lacks of its required time */
} oc_fault_tick;

typedef struct {
    int32_t running;
    int32_t exceeds_limit;   /* the difference, at this tick */
    oc_fault fault;
    double since;            /* s, when it began */
    double last_time;        /* s, of the tick before */
    double suspicious_since, last_within; /* s, since when the sums grow; last time below half the limit */
    double step_time, interruption_time; /* s, of the last step in one tick; of the last stop or gap */
    double last_agreement;   /* s, when the odds of a reversed sign were last zero */
    float steady_difference, steady_s; /* rad, of a faulty sensor that follows the truck; s, for how long */
    float confidence;        /* lower bound by Chebyshev's inequality, 0 to 1 */
    float missing_s, present_s;
    float paired_s;          /* with both angles and no step or gap, 2 at most */
    float offset, offset_sd; /* rad, learned, delayed by minutes, since learning follows a drifting sensor */
    float offset_s;          /* s of learning in them */
    float last;              /* rad, measured at the previous tick */
    float held_value, held_estimate, held_s; /* since the measured value last changed */
    float held_fast_s;       /* part of held_s at speed */
    float mean;              /* limits, over some 20 s */
    float within_s;          /* continuously below half the limit */
    float suspended_s;       /* above half the limit, less a share of the time below */
    float limit_growth;      /* share added to the limit after drifts that ended by themselves */
    float stuck_s;
    float mean_measured, mean_estimate; /* rad, of the last seconds */
    float reversed;          /* log of the odds of a reversed sign */
    float left, right;       /* limits x s beyond the borderline, for either sign */
} oc_fault_watch;

/* Kept over ignition: a fault until the sensor has recovered, and this truck's wider limit. */
typedef struct {
    oc_fault fault;
    float confidence;
    float limit_growth;
} oc_fault_evidence;

const char *oc_fault_name(oc_fault fault);

/* Whether this tick's difference may be judged, so that it needs all members of `tick`. */
bool oc_fault_may_judge(const oc_fault_watch *watch, const oc_fault_tick *tick);

/* The present fault. A zeroed watch starts from the kept evidence at the tick's time. */
oc_fault oc_fault_update(oc_fault_watch *watch, oc_fault_evidence *kept, const oc_fault_tick *tick);

/* Whether this tick's measured angle is invalid: during a fault, or beyond the limit. */
bool oc_fault_excludes_angle(const oc_fault_watch *watch);

/* Whether the sensor may be at fault. Suspends learning from it, for a minute at most. */
bool oc_fault_suspected(const oc_fault_watch *watch);

#endif

#ifndef OC_ASSIGNMENT_H
#define OC_ASSIGNMENT_H
/* Whether each signal is what its name says, before anything is said about the truck or a sensor.
 *
 * Angle, yaw rate, accelerometer and rear wheel speeds each give the lateral acceleration of the truck:
 *     delta v^2/(i L), r v, a_y, (v_r - v_l) v/T
 * The signal that two others contradict is at fault; of two signals, none can be named. Steps of 0.1 s. */

#include <stdbool.h>
#include <stdint.h>

#include "signal_level.h"
#include "signal_pair.h"
#include "signal_watch.h"
#include "signals.h"

typedef enum {
    OC_SIGNAL_FAULT_NONE,
    OC_SIGNAL_FAULT_FILLED,    /* missing samples are filled with a number */
    OC_SIGNAL_FAULT_STUCK,     /* a constant value while others show a change */
    OC_SIGNAL_FAULT_CLIPPED,   /* at an end of its range while others show more */
    OC_SIGNAL_FAULT_NOISE,     /* no more than noise */
    OC_SIGNAL_FAULT_JUMPS,     /* jumps that no truck makes: wrong bits, or a wrapped angle */
    OC_SIGNAL_FAULT_MAGNITUDE, /* without its sign */
    OC_SIGNAL_FAULT_REVERSED,  /* sign is reversed */
    OC_SIGNAL_FAULT_SCALE,     /* a wrong unit or size */
    OC_SIGNAL_FAULT_LATE,      /* time stamps do not fit */
    OC_SIGNAL_FAULT_UNRELATED, /* another signal */
    OC_SIGNAL_FAULT_COUNT
} oc_signal_fault;

enum { OC_BY_ANGLE, OC_BY_YAW_RATE, OC_BY_ACCELERATION, OC_BY_WHEELS, OC_WITNESSES };
enum {
    OC_PAIR_ANGLE_YAW_RATE,
    OC_PAIR_YAW_RATE_ACCELERATION,
    OC_PAIR_ANGLE_ACCELERATION,
    OC_PAIR_YAW_RATE_WHEELS,
    OC_PAIRS
};
/* The first four signals: angle, yaw rate, speed, lateral acceleration. */
enum { OC_SPEED_WATCH = 2, OC_WATCHED = 4 };

typedef struct {
    float per_ratio_times_wheelbase, ratio_times_wheelbase; /* 1/m, m */
    float product_doubt;       /* share by which i L may be wrong beyond a vehicle file's error */
    float per_track;           /* 1/m, of the rear axle */
    float tick_s, step_s;      /* s */
    int32_t ticks_per_step;
} oc_assignment_design;

typedef struct {
    oc_signal_watch watches[OC_WATCHED];
    oc_signal_level levels[OC_WATCHED];
    oc_witness witnesses[OC_WITNESSES];
    oc_signal_pair pairs[OC_PAIRS];
    float sums[OC_WATCHED];    /* of this step's ticks */
    float level_sums[OC_WATCHED]; /* of the means of the steps in a level's mean */
    float range_low, range_high; /* rad, of the angle while the truck rolls */
    float at_low_s, at_high_s; /* s, exactly there */
    float wheel_difference, wheel_mean; /* m/s, sums of this step's ticks */
    float straight_angle;      /* rad, measured while the truck hardly turns */
    float straight_steps;      /* number of steps in it */
    float value;               /* of the fault: number, s, or factor */
    float recovering_s;        /* s without any fault until it ends */
    int32_t ticks, wheel_ticks; /* in this step */
    int32_t valid_ticks[OC_WATCHED];
    int32_t place;             /* of this step, in the rings */
    int32_t level_steps;       /* in this mean of a level */
    int32_t against_steps;     /* at low speed, in which the truck turned against its angle */
    int32_t steps_to_judge;
    int32_t started;           /* bits of the signals that had a value */
    int32_t at_fault;          /* oc_signal_bit */
    oc_signal_fault fault;
} oc_assignment;

void oc_assignment_setup(oc_assignment_design *design, double ratio_times_wheelbase, float product_doubt, double track,
                         double rate_hz);

/* One tick; its valid bits mark possible measurements, `sent` those that its source marks. */
void oc_assignment_update(oc_assignment *assignment, const oc_assignment_design *design, const oc_signals *tick,
                          uint32_t sent);

/* Compares the two signals of a pair. */
void oc_assignment_compare(oc_pair_comparison *comparison, const oc_assignment *assignment, int32_t pair, float step_s);

/* Names the fault by what was collected so far. */
void oc_assignment_judge(oc_assignment *assignment, const oc_assignment_design *design);

/* m/s, from which signals are compared: the truck rolls. */
float oc_assignment_speed(void);

/* Minimum of a jump and of a jump that no truck makes, in a tick; minimum change that a stuck signal misses; of the
 * k-th signal in its unit. */
float oc_signal_jump_min(int32_t k);
float oc_signal_impossible_jump(int32_t k);
float oc_signal_missed_min(int32_t k);

const char *oc_signal_fault_name(oc_signal_fault fault);

#endif

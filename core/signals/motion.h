#ifndef OC_MOTION_H
#define OC_MOTION_H
/* 5.1.2: the truck's motion, the gate with its named reasons, and the queue of ticks that are pending. */

#include <stdbool.h>
#include <stdint.h>

#include "mean.h"
#include "params.h"
#include "preprocess.h"

enum {
    OC_BLOCKS_PER_CLEAN_TIME = 20,
    OC_PENDING_MAX = OC_BLOCKS_PER_CLEAN_TIME /* blocks that a ring holds */
};

/* Reasons for not using a tick. No tick has OC_REASON_WINDOW: it counts the ticks that t1 dropped or still holds. */
typedef enum {
    OC_REASON_MISSING_SIGNAL = 1,
    OC_REASON_TIME = 2,      /* time did not increase, or not by the rate of oc_setup; or it is NaN */
    OC_REASON_GAP = 4,       /* first tick after a gap: the filters restart */
    OC_REASON_SETTLING = 8,  /* the filters have not settled */
    OC_REASON_SPEED = 16,
    OC_REASON_CURVATURE = 32,
    OC_REASON_LONGITUDINAL_ACCELERATION = 64,
    OC_REASON_BANK = 128,
    OC_REASON_WINDOW = 256,
    OC_REASON_YAW_RATE_BIAS = 512, /* it changes faster than the filter follows; not in the thesis's method */
    OC_REASON_LATERAL_ACCELERATION = 1024, /* tyres and axles are not linear; not in the thesis's method */
    OC_REASON_SIGNAL_FAULT = 2048, /* a signal is not what its name says: assignment.h */
    OC_REASON_INTERVENTION = 4096, /* stability control or anti-lock brakes act: the brakes turn the truck */
    OC_REASON_REVERSE = 8192,
    OC_REASON_STEERING_ASSIST = 16384, /* a motor steers: the place in the play is unknown */
    OC_REASON_COUNT = 15
} oc_reason;

/* The truck's motion by the method's sensors. */
typedef struct {
    double yaw_rate, speed, lateral_acceleration; /* rad/s, m/s, m/s^2; the last is 0 where not used */
    bool use_accelerometer;
} oc_sensed;

/* The motion at one tick. Below 1 m/s, where the gate is closed, the curvature is r over 1 m/s. */
typedef struct {
    double curvature;                 /* 1/m, (32) */
    double longitudinal_acceleration; /* m/s^2 */
    double bank;                      /* m/s^2, (33); 0 without an accelerometer */
    double lateral_acceleration;      /* m/s^2: measured, or r*v without an accelerometer */
    double rear_part;                 /* rad at the steering wheel: i*w times the rear axle's angle */
    double residual;                  /* rad: measured angle less i*L*r/v, less the rear axle's part */
} oc_motion;

/* Clean ticks, pending until the t1 after them is clean, too. */
typedef struct {
    int32_t ticks;                     /* in the growing block */
    int32_t first, count;              /* of the ring */
    oc_sums filling;                   /* the growing block */
    oc_moments blocks[OC_PENDING_MAX]; /* whole blocks, ring */
} oc_pending;

void oc_pending_drop(oc_pending *pending);

/* Adds a clean tick. True if a block became final, which is then in *final. */
bool oc_pending_add(oc_pending *pending, int32_t ticks_per_block, int32_t blocks_until_final, double y, double x,
                    double w, oc_moments *final);

/* (32), (33) and the residual from one filtered tick. */
oc_motion oc_motion_of(const oc_filtered *tick, double ratio_times_wheelbase, double ratio_times_rear_weight,
                       bool use_accelerometer);

/* (34), (35) and v > 10 m/s: the reason bits, 0 if the tick is clean. */
uint32_t oc_gate(const oc_params *params, const oc_motion *motion, double speed);

/* Means of (33) over a minute each, with their minimum and maximum. */
typedef struct {
    double ticks, sum; /* of the growing minute, m/s^2 */
    double minutes, low, high;
} oc_bank_watch;

void oc_bank_watch_update(oc_bank_watch *watch, double bank, double ticks_per_minute);

/* Whether minutes differ by more than roads bank, which shows that the accelerometer's zero drifts. */
bool oc_bank_watch_drifts(const oc_bank_watch *watch);

/* The joint method's gate, which admits bends and banks. bank_mean: m/s^2, mean of (33); speed: m/s. */
uint32_t oc_joint_gate(const oc_params *params, const oc_motion *motion, double speed, double bank_mean);

#endif

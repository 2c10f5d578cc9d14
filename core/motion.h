#ifndef OC_MOTION_H
#define OC_MOTION_H
/* 5.1.2: the truck's motion, the gate with its named reasons, and the queue of ticks that wait for the gate. */

#include <stdbool.h>
#include <stdint.h>

#include "mean.h"
#include "params.h"
#include "preprocess.h"

enum {
    OC_BLOCKS_PER_CLEAN_TIME = 20,
    OC_PENDING_MAX = OC_BLOCKS_PER_CLEAN_TIME /* blocks that a ring holds */
};

/* Why a tick is not used. OC_REASON_WINDOW is of no single tick: it counts the ticks that t1 dropped or still holds. */
typedef enum {
    OC_REASON_MISSING_SIGNAL = 1,
    OC_REASON_TIME = 2,      /* time did not increase, or is NaN */
    OC_REASON_GAP = 4,       /* first tick after a gap: the filters restart */
    OC_REASON_SETTLING = 8,  /* the filters have not settled */
    OC_REASON_SPEED = 16,
    OC_REASON_CURVATURE = 32,
    OC_REASON_LONGITUDINAL_ACCELERATION = 64,
    OC_REASON_BANK = 128,
    OC_REASON_WINDOW = 256,
    OC_REASON_YAW_RATE_BIAS = 512, /* it moves faster than the filter; not for the thesis's method */
    OC_REASON_LATERAL_ACCELERATION = 1024, /* tyres and axles are not linear; not for the thesis's method */
    OC_REASON_COUNT = 11
} oc_reason;

/* The truck's motion by the method's sensors. */
typedef struct {
    double yaw_rate, speed, lateral_acceleration; /* rad/s, m/s, m/s^2; the last 0 where it is not used */
    bool use_accelerometer;
} oc_sensed;

/* The motion at one tick. Below 1 m/s the curvature is r over 1 m/s: the gate is closed there. */
typedef struct {
    double curvature;                 /* 1/m, (32) */
    double longitudinal_acceleration; /* m/s^2 */
    double bank;                      /* m/s^2, (33); 0 without an accelerometer */
    double lateral_acceleration;      /* m/s^2: measured, or r*v without an accelerometer */
    double residual;                  /* rad: measured angle less i*L*r/v */
} oc_motion;

/* Clean ticks that wait until the t1 after them is clean too. */
typedef struct {
    int32_t ticks;                     /* in the growing block */
    int32_t first, count;              /* of the ring */
    oc_sums filling;                   /* the growing block */
    oc_moments blocks[OC_PENDING_MAX]; /* whole blocks, ring */
} oc_pending;

void oc_pending_drop(oc_pending *pending);

/* Adds a clean tick; true if a block became final, which is then in *final. */
bool oc_pending_add(oc_pending *pending, int32_t ticks_per_block, int32_t blocks_until_final, double y, double x,
                    double w, oc_moments *final);

/* (32), (33) and the residual from one filtered tick. */
oc_motion oc_motion_of(const oc_filtered *tick, double ratio_times_wheelbase,
                       bool use_accelerometer);

/* (34), (35) and v > 10 m/s: the reason bits, 0 if the tick is clean. */
uint32_t oc_gate(const oc_params *params, const oc_motion *motion, double speed);

/* Means of (33) over a minute each: how low and how high the bank, as the accelerometer reads it, has been. */
typedef struct {
    double ticks, sum; /* of the minute that fills, m/s^2 */
    double minutes, low, high;
} oc_bank_watch;

void oc_bank_watch_update(oc_bank_watch *watch, double bank, double ticks_per_minute);

/* Whether minutes differ by more than roads bank: then the accelerometer's zero has moved. */
bool oc_bank_watch_drifts(const oc_bank_watch *watch);

/* The gate of the joint method, which models bends and banks: bank_mean is (33)'s, m/s^2, and speed in m/s. */
uint32_t oc_joint_gate(const oc_params *params, const oc_motion *motion, double speed, double bank_mean);

#endif

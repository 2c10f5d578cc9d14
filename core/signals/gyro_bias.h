#ifndef OC_GYRO_BIAS_H
#define OC_GYRO_BIAS_H
/* 5.3.1: the yaw rate sensor's bias and the wheels' radii, by a Kalman filter after Gustafsson.
 *
 * A reading is the gyro less the yaw rate of an axle's wheels, as means over a second:
 *     r - (v_r - v_l)/T = b - (v/T) (m + l a_y) - s (r - b)
 * b is the bias, which drifts. Each axle has a mismatch of its rolling radii m = r_l/r_r - 1 of (21), the change l of m
 * by lateral acceleration, and the relative error s of its track width T. The regressor of s is the gyro, whose noise
 * averages out over a second. Wheel noise in a regressor would bias T low. At standstill b alone is observable. A CUSUM
 * on the innovations detects a bias that changes faster than the filter follows.
 *
 * A tyre that loses air changes one axle's mismatch against the other's, which shows without the bias. Then it is a
 * hypothesis that only this axle changed: the other one gives the bias.
 *
 * Where tyres slide the model does not hold: a wheel speed far from the gyro's prediction is ignored. Steered front
 * wheels have a speed difference smaller by the cosine of their angle, 1.5 % at 10 deg. s includes it. */

#include <stdbool.h>
#include <stdint.h>

#include "between_drives.h"
#include "estimate.h"
#include "gyro_reading.h"
#include "params.h"
#include "past_bias.h"
#include "signals.h"
#include "standstill.h"
#include "vehicle.h"

enum {
    OC_AXLE_REAR,
    OC_AXLE_FRONT,
    OC_AXLE_COUNT
};

enum { OC_GYRO_BIAS_PIECES = 4 }; /* of deferred work, for a whole block */

typedef struct {
    double track[OC_AXLE_COUNT];    /* m; a default where the vehicle has none */
    double per_track[OC_AXLE_COUNT]; /* 1/m */
    double track_sd[OC_AXLE_COUNT]; /* share of the width, prior */
    double tick_s;
    double ticks_per_block;
    int32_t settling_ticks;         /* after stopping */
    int32_t lost_ticks;             /* until the lateral acceleration counts as lost */
    double standing_ticks;          /* of a standing block */
} oc_gyro_bias_design;

/* Sums of innovations beyond the slack. */
typedef struct {
    float up, down; /* standard deviations */
} oc_gyro_bias_cusum;

typedef struct {
    double x[OC_GYRO_BIAS_STATES];
    double P[OC_GYRO_BIAS_STATES][OC_GYRO_BIAS_STATES];
    oc_past_bias past;                       /* mean error of the yaw rates used so far */
    oc_gyro_bias_cusum common, opposite;     /* of the sum and of the difference of both axles' innovations */
    oc_gyro_reading axles[OC_AXLE_COUNT];
    oc_mean_bank straights;
    double alarm_blocks;                     /* since the alarm; 0: no alarm */
    double alarm_time;                       /* s, of all alarms */
    double alarm_variance;                   /* (rad/s)^2, of the bias before it */
    double time;                             /* s, of the last prediction */
    double block_time;                       /* s, end of the last whole block */
    double block_ticks;                      /* of the growing block */
    double mismatch_before[OC_AXLE_COUNT];   /* of the radii, as identified since ignition, or at the last leak_min */
    double bias_before;                      /* rad/s, with them */
    double leaked[OC_AXLE_COUNT];            /* change of the mismatch since ignition by a tyre that loses air */
    double off_s;                            /* ignition off since the last tick; 0: unknown */
    oc_still_mean still;                     /* of the growing standing block */
    double creep;                            /* rad/s, maximum yaw rate in it of a truck that only seems to stand */
    double still_blocks;                     /* of this standstill */
    double evidence;                         /* s, of blocks and standstill */
    double wheel_evidence;                   /* s, of blocks alone */
    double sd;                               /* rad/s, of the bias, as of the last block */
    int32_t due;                             /* of the pieces of deferred work, those that are left */
    int32_t still_ticks;                     /* of this standstill, settling included */
    int32_t lost_ticks;                      /* since the last lateral acceleration, clamped at the design's */
    int32_t started;                         /* since power-on */
    int32_t running;                         /* since ignition */
    int32_t has_wheels;                      /* since ignition */
    int32_t has_mismatch;                    /* since ignition both axles' are identified */
    int32_t leaking;                         /* since ignition a tyre of this axle loses air, less one; 0: of none */
    oc_status status;
} oc_gyro_bias;

void oc_gyro_bias_setup(oc_gyro_bias_design *design, const oc_vehicle *vehicle, const oc_params *params,
                        double rate_hz);

/* Ignition after `off_s` seconds, 0 where unknown: time may start at any value, and bias and radii may have changed. */
void oc_gyro_bias_restart(oc_gyro_bias *state, double off_s);

/* One tick, later than the previous one; the valid bits mark measurements. Ignores a tick without yaw rate. `creep`: as
 * for oc_standstill_update. */
void oc_gyro_bias_update(oc_gyro_bias *state, const oc_gyro_bias_design *design, const oc_params *params,
                         const oc_signals *tick, double creep);

/* One piece of the work that is due, after the last tick and before the next one. */
void oc_gyro_bias_work(oc_gyro_bias *state, const oc_gyro_bias_design *design, const oc_params *params);

/* rad/s, as of the last block. Unobservable while the prior dominates; invalid during an alarm. */
oc_estimate oc_gyro_bias_get(const oc_gyro_bias *state, const oc_params *params);

/* Whether the bias changed faster than the filter follows, and is not as certain again as before. */
bool oc_gyro_bias_alarmed(const oc_gyro_bias *state);

/* Change of r_l/r_r - 1 of an axle since ignition by a tyre that loses air; 0: none does. */
double oc_gyro_bias_leaked(const oc_gyro_bias *state, int32_t axle);

/* r_l/r_r - 1 of an axle, at zero lateral force. */
oc_estimate oc_gyro_bias_mismatch(const oc_gyro_bias *state, const oc_params *params, int32_t axle);

#endif

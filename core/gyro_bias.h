#ifndef OC_GYRO_BIAS_H
#define OC_GYRO_BIAS_H
/* 5.3.1: the yaw rate sensor's bias and the wheels' radii, by a Kalman filter after Gustafsson.
 *
 * A reading is the gyro less the yaw rate of an axle's wheels, as means over a second:
 *     r - (v_r - v_l)/T = b - (v/T) (m + l a_y) - s (r - b)
 * b is the bias, with a drift. Each axle has the mismatch of its rolling radii m = r_l/r_r - 1 of (21), the change l of
 * m by lateral acceleration, and the error s of its track width T. The regressor of s is the gyro, whose noise averages
 * out over a second: wheel noise in a regressor would bias T low. Standstill observes b alone. A CUSUM on the
 * innovations detects a bias that moves faster than the filter follows.
 *
 * The model fails where tyres slide: a wheel speed far from the gyro's prediction is ignored. Steered front wheels have
 * a smaller speed difference, by the cosine of their angle; s absorbs it: at 10 deg it is 1.5 %. */

#include <stdbool.h>
#include <stdint.h>

#include "estimate.h"
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

typedef struct {
    double track[OC_AXLE_COUNT];    /* m; a default where the vehicle has none */
    double per_track[OC_AXLE_COUNT]; /* 1/m */
    double track_sd[OC_AXLE_COUNT]; /* of the width, prior */
    double tick_s;
    double ticks_per_block;
    int32_t settling_ticks;         /* after stopping */
    int32_t lost_ticks;             /* after which the lateral acceleration counts as lost */
    double standing_ticks;          /* of a standing block */
} oc_gyro_bias_design;

typedef struct {
    double weight;              /* ticks of the growing block, and */
    double flat;                /* those of them at which the difference did not change */
    double quantum;             /* m/s, minimum step between plateaus; 0: none yet */
    double held;                /* blocks since the difference last changed */
    double noise;               /* (rad/s)^2, of one block, from the differences of neighbours */
    double variance;            /* (rad/s)^2, of the last block, without the turn's share */
    double blocks;              /* taken so far */
    double difference, speed, yaw_rate, acceleration; /* sums over the growing block */
    double last_reading, last_load; /* of the last whole block; its regressors */
    double innovation;          /* standard deviations, of the last block */
    double last_difference;     /* m/s, at the tick before */
    double plateau;             /* m/s, difference where it was last constant */
    double last_speed, last_yaw_rate; /* of the last whole block */
    int32_t has_update;           /* the last block had enough ticks */
} oc_gyro_bias_axle;

/* Sums of innovations beyond the slack. */
typedef struct {
    float up, down; /* standard deviations */
} oc_gyro_bias_cusum;

/* Sums over the last blocks of both axles: their number, the curvature (1/m), the bank (m/s^2) and products. */
typedef struct {
    double blocks, curvature, squares, bank, product;
} oc_gyro_bias_level;

typedef struct {
    double x[OC_GYRO_BIAS_STATES];
    double P[OC_GYRO_BIAS_STATES][OC_GYRO_BIAS_STATES];
    oc_past_bias past;                       /* of the yaw rates that were used */
    oc_gyro_bias_cusum together, apart;      /* on the sum and on the difference of both axles' innovations */
    oc_gyro_bias_axle axles[OC_AXLE_COUNT];
    oc_gyro_bias_level level;
    double alarm_blocks;                     /* since the alarm; 0: none */
    double alarm_time;                       /* s, of all alarms */
    double alarm_variance;                   /* (rad/s)^2, of the bias before it */
    double time;                             /* s, to which the state was predicted */
    double block_time;                       /* s, end of the last whole block */
    double block_ticks;                      /* of the growing block */
    oc_still_mean still;                     /* of the growing standing block */
    double still_blocks;                     /* of this standstill */
    double evidence;                         /* s, of blocks and of standing */
    double wheel_evidence;                   /* s, of blocks alone */
    double sd;                               /* rad/s, of the bias, as of the last block */
    int32_t due;                             /* steps left of the last whole block */
    int32_t still_ticks;                     /* of this standstill so far, settling included */
    int32_t lost_ticks;                      /* since the last lateral acceleration, clamped at the design's */
    int32_t started;                         /* since power-on */
    int32_t running;                         /* since ignition */
    int32_t has_wheels;                      /* since ignition */
    oc_status status;
} oc_gyro_bias;

void oc_gyro_bias_setup(oc_gyro_bias_design *design, const oc_vehicle *vehicle, const oc_params *params,
                        double rate_hz);

/* Ignition: time may begin anywhere, and the bias may have changed. */
void oc_gyro_bias_restart(oc_gyro_bias *state);

/* One tick, later than the one before; the valid bits mark measurements. Ignores a tick without yaw rate. */
void oc_gyro_bias_update(oc_gyro_bias *state, const oc_gyro_bias_design *design, const oc_params *params,
                         const oc_signals *tick);

/* rad/s, as of the last block. Unobservable while the prior dominates; invalid during an alarm. */
oc_estimate oc_gyro_bias_get(const oc_gyro_bias *state, const oc_params *params);

/* Whether the bias moved faster than the filter follows, and is not yet as certain again as before. */
bool oc_gyro_bias_alarmed(const oc_gyro_bias *state);

/* Whether the filter took a step in this tick, so that others can defer their work to the next. */
bool oc_gyro_bias_is_busy(const oc_gyro_bias *state);

/* r_l/r_r - 1 of an axle, at zero lateral force. */
oc_estimate oc_gyro_bias_mismatch(const oc_gyro_bias *state, const oc_params *params, int32_t axle);

#endif

#ifndef OC_GYRO_BIAS_H
#define OC_GYRO_BIAS_H
/* 5.3.1: the yaw rate sensor's bias and the wheels' radii, by a Kalman filter after Gustafsson.
 *
 * What the gyro says less what an axle's wheels say is, over a second,
 *     r - (v_r - v_l)/T = b - (v/T) (m + l a_y) - s (r - b)
 * with the bias b and its drift, and for each axle m = r_l/r_r - 1 of (21), the mismatch of the rolling radii, l what
 * side force adds to it, and s the error of the track width T. The regressor of s is the gyro, whose noise a second
 * averages away: noise in the wheels would fit the track too narrow. Standing still shows b alone. A CUSUM on the
 * innovations sees a bias that moves faster than the filter follows.
 *
 * It stops where tyres slide: a wheel far from what the gyro expects is not heard. Turned front wheels roll nearer to
 * each other, by the cosine of their angle, which is left to s: at 10 deg it is 1.5 %. */

#include <stdbool.h>
#include <stdint.h>

#include "estimate.h"
#include "params.h"
#include "past_bias.h"
#include "signals.h"
#include "vehicle.h"

enum {
    OC_AXLE_REAR,
    OC_AXLE_FRONT,
    OC_AXLE_COUNT
};

typedef struct {
    double track[OC_AXLE_COUNT];    /* m; the usual width where the vehicle has none */
    double per_track[OC_AXLE_COUNT]; /* 1/m */
    double track_sd[OC_AXLE_COUNT]; /* of the width, prior */
    double tick_s;
    double ticks_per_block;
    int32_t settling_ticks;         /* after stopping */
    int32_t silent_ticks;           /* after which an accelerometer is believed to be gone */
    double standing_ticks;          /* that tell something */
} oc_gyro_bias_design;

typedef struct {
    double weight;              /* ticks of the block that grows, and */
    double flat;                /* those of them at which the difference did not change */
    double quantum;             /* m/s, the smallest step between plateaus; 0: none seen */
    double held;                /* blocks over which the difference has not changed */
    double noise;               /* (rad/s)^2, of one block, from the differences of neighbours */
    double variance;            /* (rad/s)^2, of the last block, but for the turn's share */
    double blocks;              /* taken so far */
    double difference, speed, yaw_rate, acceleration; /* sums over the block that grows */
    double before, before_load; /* the block before: what it read, and of its regressors the load, */
    double innovation;          /* standard deviations, of the last block */
    double last;                /* m/s, difference at the tick before */
    double plateau;             /* m/s, difference where it last stood still */
    double before_speed, before_yaw_rate; /* speed and yaw rate */
    int32_t has_update;           /* the last block told something */
} oc_gyro_bias_axle;

/* How far innovations have leaned to either side. */
typedef struct {
    float up, down; /* standard deviations */
} oc_gyro_bias_cusum;

typedef struct {
    double x[OC_GYRO_BIAS_STATES];
    double P[OC_GYRO_BIAS_STATES][OC_GYRO_BIAS_STATES];
    oc_past_bias past;                       /* of the yaw rates that were used */
    oc_gyro_bias_axle axles[OC_AXLE_COUNT];
    oc_gyro_bias_cusum together, apart;      /* of both axles' innovations, and of one against the other */
    double alarm_blocks;                     /* since the alarm; 0: none */
    double alarm_time;                       /* s, of all alarms */
    double alarm_variance;                   /* (rad/s)^2, of the bias before it */
    double time;                             /* s, to which the state was predicted */
    double block_time;                       /* s, at which the block that is learned from ended */
    double block_ticks;                      /* of the block that grows */
    double still, still_yaw_rate, still_squares; /* of the standing block that grows */
    double still_blocks;                     /* of this standstill */
    double evidence;                         /* s, of blocks taken and of standing */
    double wheel_evidence;                   /* s, of blocks alone */
    int32_t due;                             /* steps in which the block that ended is yet to be learned from */
    int32_t still_ticks;                     /* of this standstill so far, settling included */
    int32_t silent_ticks;                    /* without a lateral acceleration, so far; no more than tell something */
    int32_t started;                         /* since power-on */
    int32_t running;                         /* since ignition */
    int32_t has_wheels;                      /* since ignition */
    oc_status status;
    double sd;                               /* rad/s, of the bias, as of the last block */
} oc_gyro_bias;

void oc_gyro_bias_setup(oc_gyro_bias_design *design, const oc_vehicle *vehicle, const oc_params *params,
                        double rate_hz);

/* Ignition: time may begin anywhere, and the bias may be elsewhere. */
void oc_gyro_bias_restart(oc_gyro_bias *state);

/* One tick later than the one before; the valid bits tell what is a measurement. Without a yaw rate nothing happens. */
void oc_gyro_bias_update(oc_gyro_bias *state, const oc_gyro_bias_design *design, const oc_params *params,
                         const oc_signals *tick);

/* rad/s, as of the last block. Unobservable while the prior decides; invalid while it is alarmed. */
oc_estimate oc_gyro_bias_get(const oc_gyro_bias *state, const oc_params *params);

/* Whether the bias has lately moved faster than it was followed, and is not known again as well as before. */
bool oc_gyro_bias_alarmed(const oc_gyro_bias *state);

/* Whether this tick had part of a block to learn from, so that others may leave their work to the next. */
bool oc_gyro_bias_is_busy(const oc_gyro_bias *state);

/* r_l/r_r - 1 of an axle, at no side force. */
oc_estimate oc_gyro_bias_mismatch(const oc_gyro_bias *state, const oc_params *params, int32_t axle);

#endif

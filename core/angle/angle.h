#ifndef OC_ANGLE_H
#define OC_ANGLE_H
/* The steering wheel angle without its sensor: an observer by (13) with the steering as unknown input.
 *
 * By (13) the front wheel angle is L*r/v + K a + T dr/dt. The gyro gives r, a filter of three poles its slope, r*v and
 * the accelerometer give a. T is the yaw inertia over the tyres' stiffness, plus the lag of the steering. T and the
 * scale of the errors are learned while the sensor is healthy. The play between front wheels and steering wheel is the
 * operator of backlash.h run backward. Lateral force beyond friction carries the wheels to one flank. Wheels that move
 * without such a force were pushed by a flank.
 *
 * Arctangent and linkage reduce the angle of (7) by a share of its cube, which is learned.
 *
 * 4.2: if a sensor was never available, the angle is Ackermann's alone, with a wide interval. Below walking speed the
 * angle is not observable: it is held, and its interval widens. Driving backward needs a signed speed. The tyre model
 * is linear, which holds below some 4 m/s^2.
 *
 * Single precision: in double this room took half of a Cortex-M4F's tick. */

#include <stdbool.h>
#include <stdint.h>

#include "estimate.h"
#include "front_wheel.h"
#include "side_slip.h"

/* The truck, as identified while the sensor was available; standard deviations where they matter. */
typedef struct {
    float offset_sd;                  /* rad */
    float gradient, gradient_sd;      /* rad/(m/s^2) */
    float wheelbase;                  /* share by which bends need more than L*r/v */
    float backlash;                   /* rad, full width */
    float unloading, unloading_sd;    /* m/s^2, neutral lateral acceleration a_0 */
    float wander;                     /* (m/s^2)^2, variance of a_0's random change in a second */
    float tandem;                     /* m^2/s^2, lateral force per curvature, by rear axles that resist turning */
    float friction;                   /* m/s^2 */
    float creep;                      /* rad/s per m/s^2 */
    float yaw_rate_noise;             /* (rad/s)^2, of the gyro in a second's mean; 0: not identified */
    float left_s, right_s;            /* s of lateral force that clearly loads either flank */
    int32_t identified;               /* the sensor was available for long enough */
} oc_angle_truck;

/* One tick. */
typedef struct {
    float yaw_rate, yaw_rate_bias_sd; /* rad/s, corrected */
    float speed;                      /* m/s */
    float lateral_acceleration;       /* m/s^2, as measured */
    float bank_sd;                    /* m/s^2, of the bank without an accelerometer */
    float braked_sd;                  /* rad, of the angle while brakes turn the truck */
    float front_wheel;                /* rad, by wheel speeds, if the method uses them */
    float lateral_speed;              /* m/s, over ground, if the method uses it */
    double true_by_sensor;            /* rad, measured less offset */
    bool has_sensor;                  /* the sensor is available and valid */
    bool can_learn;                   /* the observer may learn from it; where oc_angle_checks only */
    bool has_motion;                  /* the method's signals: yaw rate, speed, ... */
    bool accelerometer_lost;          /* no signal, although in use */
    bool assisted;                    /* a motor steers: the place in the play is unknown */
} oc_angle_tick;

typedef struct {
    oc_angle_method method;
    oc_ratio ratio;
    float wheelbase;                  /* m */
    float pull;                       /* m/s^2, given part of the neutral lateral acceleration */
    float yaw_rate_share;             /* weight of a new tick, of the filter's first pole */
    float acceleration_keep;          /* share of the yaw acceleration that is left after a tick, of its other two */
    float acceleration_share;         /* 1/s, yaw acceleration in a tick per rad/s that these two lag behind */
    float acceleration_noise;         /* 1/s^2, variance of the yaw acceleration over the gyro's in a second's mean */
    float swing_keep;                 /* share of the swing that is left after a tick */
    float activity_share;             /* weight of a new check, of the activity */
    float bank_share, rate_share, takeover_share;
    float delay_s;                     /* s, of the yaw rate's filter */
    float tick_s;
    float per_tick;                   /* Hz */
    float slope_ticks;                /* of the prediction by the slope of the yaw acceleration */
    float steering_ratio, per_ratio;  /* near the centre; 1 over it */
    float check_s;                    /* between two checks against the sensor */
    int32_t ticks_per_check;
} oc_angle_design;

/* Lost at ignition. */
typedef struct {
    int32_t running;
    int32_t ticks_to_check;
    float yaw_rate_first, yaw_rate, yaw_acceleration; /* rad/s, rad/s, rad/s^2: filtered */
    float speed;                      /* m/s */
    float bank;                       /* m/s^2, a_y - r*v */
    float noise;                      /* (rad/s^2)^2, variance of the yaw acceleration by the gyro's noise, as of the
                                       * last check */
    float swing;                      /* (rad/s^2)^2, recent peak of the squared yaw acceleration */
    float steered;                    /* share of the swing that is not this noise */
    float share;                      /* of the prediction that counts */
    float activity;                   /* rad/s, mean steering rate of the last seconds */
    float predicted;                  /* rad/s^2, yaw acceleration ahead, less its noise */
    float lead;                       /* s, T as of the last check */
    float lateness;                   /* s, delay of the estimate without prediction, as of the last check */
    float cube;                       /* rad^3, of the front wheels' steady-state angle */
    float flattening;                 /* 1/rad^2, reduction of the angle over its cube, as of the last check */
    float reference;                  /* rad, of the wheels at their last clear motion */
    float place, place_variance;      /* in the play, -1 and 1 at its flanks */
    float place_step;                 /* per tick until the next check */
    float held_s;                     /* since the angle was last observable */
    float without_sensor_s;           /* since the sensor was last valid */
    float estimate;                   /* rad */
    float difference;                 /* rad, last valid measured angle less the estimate, fading */
    float step;                       /* rad, last estimate less the angle of the returning sensor, fading */
    float before, rate;               /* rad, rad/s: of the previous tick */
    float sd;                         /* rad, of the estimate */
} oc_angle_tracking;

/* Learned by comparison with the sensor. */
typedef struct {
    float slopes, products;           /* sums: yaw acceleration squared, and times the residual; T is their ratio */
    float steady;                     /* sum: yaw acceleration squared times the angle per yaw rate */
    float cubes, flattened;           /* sums: the angle's cube squared, and times the reduction against (7) */
    float error_scale;                /* mean of the squared error over its predicted variance */
    float seconds;                    /* of comparison with the sensor */
    oc_side_slip_evidence side_slip;
} oc_angle_evidence;

typedef struct {
    double angle, rate, standard_deviation; /* rad, rad/s, rad: the true angle */
    double estimate, estimate_sd;           /* rad, by motion alone */
    double delay;                           /* s, of an estimated angle: what the prediction leaves */
    bool by_sensor;                         /* the angle is measured less offset */
    oc_status status;
} oc_angle;

void oc_angle_setup(oc_angle_design *design, oc_angle_method method, const oc_ratio *ratio, double wheelbase,
                    double rate_hz);

/* s, time constant of a steering rate. */
double oc_angle_rate_s(void);

/* Whether the next tick checks the estimate against the sensor. */
bool oc_angle_is_due(const oc_angle_tracking *tracking);

/* Whether the next oc_angle_update updates the slower part, if the truck moves. */
bool oc_angle_checks(const oc_angle_tracking *tracking);

/* Whether the truck is fast enough for the estimate to be compared with the sensor. */
bool oc_angle_is_accurate(const oc_angle_tracking *tracking);

/* Filters a tick's motion, before oc_angle_update. Early in the tick its result is there when it is needed. */
void oc_angle_filter(oc_angle_tracking *tracking, const oc_angle_design *design, const oc_angle_tick *tick);

/* Publishes the angle at each tick. Updates place in the play, interval and learning every check_s. */
void oc_angle_update(oc_angle_tracking *tracking, oc_angle_evidence *evidence, const oc_angle_design *design,
                     const oc_angle_truck *truck, const oc_angle_tick *tick, oc_angle *angle);

#endif

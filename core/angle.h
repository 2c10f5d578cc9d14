#ifndef OC_ANGLE_H
#define OC_ANGLE_H
/* The steering wheel angle now, without its sensor: an observer over (13) with the steering as unknown input.
 *
 * Of (13) the front wheel angle is L*r/v + K a + T dr/dt, whatever it does: r by the gyro, its slope by a filter of
 * three poles, a by r*v and the accelerometer. T is the yaw inertia over the tyres' stiffness, with what the steering
 * lags; it is learned, together with how far off all this is, while the sensor was healthy. What is between front
 * wheels and steering wheel is the play, whose operator (backlash.h) is run backward: side force beyond friction brings
 * the wheels to one flank, wheels that move without it were pushed there.
 *
 * Large angles are learned, too: beyond (7)'s proportion, arctangent and linkage take a share of the angle cubed.
 *
 * 4.2: without ever having had a sensor, only the Ackermann angle is told, and the interval says so.
 * Below a walking speed the motion says nothing: the angle is held and its interval opens. Driving backward needs a
 * speed with a sign. Tyres are linear, below some 4 m/s^2.
 *
 * Single precision: a double here cost a Cortex-M4F half of a tick. */

#include <stdbool.h>
#include <stdint.h>

#include "estimate.h"
#include "front_wheel.h"
#include "side_slip.h"

/* By what the front wheels' angle is told. */
typedef enum {
    OC_ANGLE_OBSERVER,
    OC_ANGLE_WHEEL_SPEED,             /* (21); (3) where wheels are taken to be alike */
    OC_ANGLE_WHEEL_SPEED_EXACT,       /* (2) with the radius ratio */
    OC_ANGLE_YAW_RATE,                /* L*r/v */
    OC_ANGLE_YAW_RATE_UNDERSTEER,     /* (22), (31) */
    OC_ANGLE_SIDE_SLIP,               /* (23), (24) */
    OC_ANGLE_METHOD_COUNT
} oc_angle_method;

/* What a drive with a sensor said of the truck; standard deviations where they matter. */
typedef struct {
    float offset_sd;                  /* rad */
    float gradient, gradient_sd;      /* rad/(m/s^2) */
    float wheelbase;                  /* share by which bends take more than L*r/v */
    float backlash;                   /* rad, full width */
    float unloading, unloading_sd;    /* m/s^2, a_0 */
    float tandem;                     /* m^2/s^2, side force by curvature, since axles behind resist turning */
    float friction;                   /* m/s^2 */
    float creep;                      /* rad/s per m/s^2 */
    float left_s, right_s;            /* s of side force clearly to either side, which show the play's flanks */
    int32_t known;                    /* there was a sensor for long enough */
} oc_angle_truck;

/* One tick. */
typedef struct {
    float tick_s;
    float yaw_rate, yaw_rate_bias_sd; /* rad/s, corrected */
    float speed;                      /* m/s */
    float lateral_acceleration;       /* m/s^2, as measured */
    float bank_sd;                    /* m/s^2, of what of it no accelerometer told */
    float front_wheel;                /* rad, by wheel speeds, for the methods that use them */
    float lateral_speed;              /* m/s, over ground, for the method that uses it */
    double true_by_sensor;            /* rad, measured less offset */
    bool has_sensor;                  /* and it is believed */
    bool teaches;                     /* and it may be learned from */
    bool has_motion;                  /* yaw rate, speed and what else the method needs */
    bool lacks_bank;                  /* the accelerometer is silent that there usually is */
} oc_angle_tick;

typedef struct {
    oc_angle_method method;
    oc_ratio ratio;
    float wheelbase;                  /* m */
    float yaw_rate_share;             /* of a new tick, of the filter's first pole */
    float stiffness, damping;         /* 1/s^2, 1/s, of its other two */
    float speed_share, bank_share, rate_share, takeover_share;
    float late_s;                     /* s, of the filter */
    float tick_s;
    float per_damping;                /* 1 over what the damping divides by in a tick */
    float per_tick, per_ratio;        /* Hz; 1 over the ratio near the centre */
    float check_s;                    /* between two checks against the sensor */
    int32_t ticks_per_check;
} oc_angle_design;

/* Lost at ignition. */
typedef struct {
    int32_t running;
    float yaw_rate_first, yaw_rate, yaw_acceleration;  /* rad/s, rad/s, rad/s^2: filtered */
    float speed;                      /* m/s */
    float bank;                       /* m/s^2, a_y - r*v */
    float lead;                       /* s, T as of the last check */
    float cube;                       /* rad^3, of the front wheels' steady angle, and */
    float flattening;                 /* 1/rad^2, by which it lessens it, as of the last check */
    float reference;                  /* rad, where the wheels were when they last moved clearly */
    float place, place_variance;      /* in the play, -1 to 1, and */
    float place_step;                 /* by which it goes on in each tick until the next check */
    int32_t ticks_to_check;
    float held_s;                     /* since the motion said something */
    float without_sensor_s;           /* since it was believed */
    float standing_s;                 /* without a sensor: the load may have changed */
    float estimate;                   /* rad */
    float difference;                 /* rad, of the sensor to it when it was last believed, fading */
    float step;                       /* rad, from the sensor to what was told when it came back, fading */
    float before, rate;               /* rad, rad/s: of the tick before */
    float sd;                         /* rad, of the estimate */
} oc_angle_tracking;

/* What was learned by comparing with the sensor. */
typedef struct {
    float slopes, products;           /* of yaw acceleration with what is left: T is their ratio */
    float steady;                     /* the slopes times what angle a yaw rate took when they were gathered */
    float cubes, flattened;           /* of the front wheels' angle cubed with what it is less than (7) */
    float spread;                     /* mean of squared error over foretold variance */
    float seconds;                    /* behind it */
    oc_side_slip_evidence side_slip;
} oc_angle_evidence;

typedef struct {
    double angle, rate, standard_deviation; /* rad, rad/s, rad: the true angle */
    double estimate, estimate_sd;     /* rad: what motion alone says */
    bool by_sensor;                         /* the angle is measured less offset */
    oc_status status;
} oc_angle;

void oc_angle_setup(oc_angle_design *design, oc_angle_method method, const oc_ratio *ratio, double wheelbase,
                    double rate_hz);

/* s by which the observer's filter is late. */
double oc_angle_late_s(const oc_angle_design *design);

/* Whether the next tick checks the estimate against the sensor. */
bool oc_angle_is_due(const oc_angle_tracking *tracking);

/* Filters and tells the angle at each tick. What is slower, where in the play the wheels are, the interval and what the
 * sensor teaches, follows ten times a second. */
void oc_angle_update(oc_angle_tracking *tracking, oc_angle_evidence *evidence, const oc_angle_design *design,
                     const oc_angle_truck *truck, const oc_angle_tick *tick, oc_angle *angle);

#endif

#ifndef OC_SIGNALS_H
#define OC_SIGNALS_H
/* One tick as the truck reports it.
 *
 * SI units and rad. ISO 8855: a left turn is positive for angle, yaw rate, lateral acceleration and torque. The
 * accelerometer measures specific force: a road that falls to the right reads positive. */

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Of the comparison of signals, and samples of the joint method: a driver steers below 2 Hz. */
enum { OC_STEPS_PER_SECOND = 10 };

/* Bits of oc_signals.valid: which members are available. A set bit with a NaN counts as not set. */
typedef enum {
    OC_HAS_STEERING_WHEEL_ANGLE = 1,
    OC_HAS_YAW_RATE = 2,
    OC_HAS_VEHICLE_SPEED = 4,
    OC_HAS_LATERAL_ACCELERATION = 8,
    OC_HAS_WHEEL_SPEED_FRONT_LEFT = 16,
    OC_HAS_WHEEL_SPEED_FRONT_RIGHT = 32,
    OC_HAS_WHEEL_SPEED_REAR_LEFT = 64,
    OC_HAS_WHEEL_SPEED_REAR_RIGHT = 128,
    OC_HAS_LATERAL_SPEED = 256,
    OC_HAS_STEERING_WHEEL_TORQUE = 512,
    OC_HAS_STABILITY_CONTROL_ACTIVE = 1024,
    OC_HAS_ANTI_LOCK_ACTIVE = 2048,
    OC_HAS_STEERING_ASSIST_ACTIVE = 4096,
    OC_HAS_REVERSE = 8192,
    OC_HAS_AXLE_LIFTED = 16384,
    OC_HAS_REAR_AXLE_ANGLE = 32768
} oc_signal_bit;

enum {
    OC_SIGNAL_COUNT = 16,
    OC_WHEEL_SPEEDS = 240, /* bits of the four */
    OC_STATUSES = 31744 /* bits of the statuses */
};

typedef struct {
    double time;                 /* s, of this tick; the core has no clock of its own */
    double steering_wheel_angle; /* rad, as measured, offset included */
    double yaw_rate;             /* rad/s */
    double vehicle_speed;        /* m/s */
    double lateral_acceleration; /* m/s^2, specific force */
    double wheel_speed_front_left, wheel_speed_front_right; /* m/s at the tread, by a nominal radius */
    double wheel_speed_rear_left, wheel_speed_rear_right; /* m/s */
    double lateral_speed;        /* m/s over ground, by GNSS; only for the angle by side slip */
    double steering_wheel_torque; /* N m, that the driver applies */
    double stability_control_active; /* status, 1 or 0: of yaw, roll-over or brakes */
    double anti_lock_active;         /* status */
    double steering_assist_active;   /* status: a motor steers, as for lane keeping */
    double reverse;                  /* status: the truck drives backward, or its reverse gear is engaged */
    double axle_lifted;              /* status: of the axle that resists turning */
    double rear_axle_angle;          /* rad, road wheels of a steered rear axle */
    uint32_t valid;              /* oc_signal_bit */
} oc_signals;

/* The same in this order as columns of a table: NaN: not available, NULL: missing column (not time). */
typedef struct {
    size_t count;
    const double *time;                 /* s */
    const double *steering_wheel_angle; /* rad */
    const double *yaw_rate;             /* rad/s */
    const double *vehicle_speed;        /* m/s */
    const double *lateral_acceleration; /* m/s^2 */
    const double *wheel_speed_front_left, *wheel_speed_front_right; /* m/s */
    const double *wheel_speed_rear_left, *wheel_speed_rear_right; /* m/s */
    const double *lateral_speed;        /* m/s */
    const double *steering_wheel_torque; /* N m */
    const double *stability_control_active, *anti_lock_active, *steering_assist_active; /* 0, 1 */
    const double *reverse, *axle_lifted; /* 0, 1 */
    const double *rear_axle_angle;      /* rad */
} oc_columns;

/* The valid bits less those of NaN and of values implausible for a road vehicle: from 16 turns of the wheel, 10 rad/s,
 * 150 m/s, 100 m/s^2 or 1e5 N m on; of a status from 1.5, of the rear axle's angle from 1.5 rad on. */
uint32_t oc_signals_measured(const oc_signals *tick);

/* Whether the valid bits have all of `needed`. */
bool oc_signals_has(uint32_t valid, int32_t needed);

/* The bits of the statuses that are available and true. */
uint32_t oc_signals_true(const oc_signals *tick);

#endif

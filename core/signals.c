#include "signals.h"

#include <math.h>

/* Numerical. */
static const double angle_limit = 100.0;        /* rad, 16 turns: as all, against implausible values and NaN */
static const double yaw_rate_limit = 10.0;      /* rad/s */
static const double speed_limit = 150.0;        /* m/s */
static const double acceleration_limit = 100.0; /* m/s^2 */
static const double torque_limit = 1e5;         /* N m, or N of a rod's force */

static bool usable(double value, double limit) {
    return fabs(value) < limit;
}

static bool all_usable(const oc_signals *tick) {
    return usable(tick->steering_wheel_angle, angle_limit) && usable(tick->yaw_rate, yaw_rate_limit) &&
           usable(tick->vehicle_speed, speed_limit) && usable(tick->lateral_acceleration, acceleration_limit) &&
           usable(tick->wheel_speed_front_left, speed_limit) && usable(tick->wheel_speed_front_right, speed_limit) &&
           usable(tick->wheel_speed_rear_left, speed_limit) && usable(tick->wheel_speed_rear_right, speed_limit) &&
           usable(tick->lateral_speed, speed_limit) && usable(tick->steering_wheel_torque, torque_limit);
}

/* The bit if its member is implausible. */
static uint32_t invalid_bit(oc_signal_bit bit, double value, double limit) {
    return usable(value, limit) ? 0u : (uint32_t)bit;
}

static uint32_t invalid_wheels(const oc_signals *tick) {
    return invalid_bit(OC_HAS_WHEEL_SPEED_FRONT_LEFT, tick->wheel_speed_front_left, speed_limit) |
           invalid_bit(OC_HAS_WHEEL_SPEED_FRONT_RIGHT, tick->wheel_speed_front_right, speed_limit) |
           invalid_bit(OC_HAS_WHEEL_SPEED_REAR_LEFT, tick->wheel_speed_rear_left, speed_limit) |
           invalid_bit(OC_HAS_WHEEL_SPEED_REAR_RIGHT, tick->wheel_speed_rear_right, speed_limit);
}

uint32_t oc_signals_measured(const oc_signals *tick) {
    if (all_usable(tick)) {
        return tick->valid;
    }
    const uint32_t invalid = invalid_bit(OC_HAS_STEERING_WHEEL_ANGLE, tick->steering_wheel_angle, angle_limit) |
                             invalid_bit(OC_HAS_YAW_RATE, tick->yaw_rate, yaw_rate_limit) |
                             invalid_bit(OC_HAS_VEHICLE_SPEED, tick->vehicle_speed, speed_limit) |
                             invalid_bit(OC_HAS_LATERAL_ACCELERATION, tick->lateral_acceleration, acceleration_limit) |
                             invalid_bit(OC_HAS_LATERAL_SPEED, tick->lateral_speed, speed_limit) |
                             invalid_bit(OC_HAS_STEERING_WHEEL_TORQUE, tick->steering_wheel_torque, torque_limit);
    return tick->valid & ~(invalid | invalid_wheels(tick));
}

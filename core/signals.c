#include "signals.h"

#include <math.h>

/* Beyond these a value is no measurement of a road vehicle; NaN is beyond them, too. */
static const double angle_limit = 100.0;        /* rad, 16 turns */
static const double yaw_rate_limit = 10.0;      /* rad/s */
static const double speed_limit = 150.0;        /* m/s */
static const double acceleration_limit = 100.0; /* m/s^2 */

static bool within(double value, double limit) {
    return fabs(value) < limit;
}

static bool all_measured(const oc_signals *tick) {
    return within(tick->steering_wheel_angle, angle_limit) && within(tick->yaw_rate, yaw_rate_limit) &&
           within(tick->vehicle_speed, speed_limit) && within(tick->lateral_acceleration, acceleration_limit) &&
           within(tick->wheel_speed_front_left, speed_limit) && within(tick->wheel_speed_front_right, speed_limit) &&
           within(tick->wheel_speed_rear_left, speed_limit) && within(tick->wheel_speed_rear_right, speed_limit) &&
           within(tick->lateral_speed, speed_limit);
}

/* The bit where its member is no measurement. */
static uint32_t bit_beyond(oc_signal_bit bit, double value, double limit) {
    return within(value, limit) ? 0u : (uint32_t)bit;
}

static uint32_t wheels_beyond(const oc_signals *tick) {
    return bit_beyond(OC_HAS_WHEEL_SPEED_FRONT_LEFT, tick->wheel_speed_front_left, speed_limit) |
           bit_beyond(OC_HAS_WHEEL_SPEED_FRONT_RIGHT, tick->wheel_speed_front_right, speed_limit) |
           bit_beyond(OC_HAS_WHEEL_SPEED_REAR_LEFT, tick->wheel_speed_rear_left, speed_limit) |
           bit_beyond(OC_HAS_WHEEL_SPEED_REAR_RIGHT, tick->wheel_speed_rear_right, speed_limit);
}

uint32_t oc_signals_measured(const oc_signals *tick) {
    if (all_measured(tick)) {
        return tick->valid;
    }
    const uint32_t beyond = bit_beyond(OC_HAS_STEERING_WHEEL_ANGLE, tick->steering_wheel_angle, angle_limit) |
                            bit_beyond(OC_HAS_YAW_RATE, tick->yaw_rate, yaw_rate_limit) |
                            bit_beyond(OC_HAS_VEHICLE_SPEED, tick->vehicle_speed, speed_limit) |
                            bit_beyond(OC_HAS_LATERAL_ACCELERATION, tick->lateral_acceleration, acceleration_limit) |
                            bit_beyond(OC_HAS_LATERAL_SPEED, tick->lateral_speed, speed_limit);
    return tick->valid & ~(beyond | wheels_beyond(tick));
}

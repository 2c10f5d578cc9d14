#include "oncenter_block.h"

#include <string.h>

#include "oncenter_ecu.h"

static unsigned long ticks;

int oncenter_block_start(double wheelbase_m, double steering_ratio) {
    ticks = 0;
    oncenter_ecu_defaults();
    memset(&oncenter_vehicle, 0, sizeof oncenter_vehicle);
    oncenter_vehicle.wheelbase = wheelbase_m;
    oncenter_vehicle.steering_ratio = steering_ratio;
    oncenter_vehicle.traffic_side = 1.0; /* -1 for left-hand traffic */
    return (int)oncenter_ecu_start();
}

void oncenter_block_step(double steering_wheel_angle, double yaw_rate, double vehicle_speed,
                         double lateral_acceleration, double *offset, double *offset_sd, double *offset_status) {
    memset(&oncenter_tick, 0, sizeof oncenter_tick);
    oncenter_tick.time = (double)ticks / ONCENTER_RATE_HZ;
    oncenter_tick.steering_wheel_angle = steering_wheel_angle;
    oncenter_tick.yaw_rate = yaw_rate;
    oncenter_tick.vehicle_speed = vehicle_speed;
    oncenter_tick.lateral_acceleration = lateral_acceleration;
    oncenter_tick.valid = OC_HAS_STEERING_WHEEL_ANGLE | OC_HAS_YAW_RATE | OC_HAS_VEHICLE_SPEED |
                          OC_HAS_LATERAL_ACCELERATION; /* a NaN is not available */
    (void)oncenter_ecu_tick();
    ++ticks;
    *offset = oncenter_output.offset;
    *offset_sd = oncenter_output.offset_sd;
    *offset_status = (double)oncenter_output.offset_status;
}

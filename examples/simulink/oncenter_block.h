#ifndef ONCENTER_BLOCK_H
#define ONCENTER_BLOCK_H
/* Two functions for Simulink's C Caller, for the folder that `oncenter export c` writes. SI and rad, left positive. */

/* Call at each start of a simulation. Returns 0, or the core's error, 1 and more. */
int oncenter_block_start(double wheelbase_m, double steering_ratio);

/* Call at 100 Hz. The status is 0 unobservable, 1 converging, 2 valid, 3 invalid; while it is 0, offset and its
 * standard deviation are undefined. */
void oncenter_block_step(double steering_wheel_angle, double yaw_rate, double vehicle_speed,
                         double lateral_acceleration, double *offset, double *offset_sd, double *offset_status);

#endif

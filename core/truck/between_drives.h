#ifndef OC_BETWEEN_DRIVES_H
#define OC_BETWEEN_DRIVES_H
/* What may change while the ignition is off. */

#include <stdint.h>

enum {
    /* between_drives.toml: names */
    /* rad, straight-ahead offset, of a sensor that nobody touched: ride height, wind, what the model lacks */
    OC_BETWEEN_OFFSET,
    OC_BETWEEN_WHEEL_RADIUS, /* 1, rolling radius of each wheel: pressure, temperature, a changed wheel */
    OC_BETWEEN_YAW_RATE_BIAS, /* rad/s, yaw rate bias; at an ignition by the parameter gyro_bias_ignition_sd_rad_s */
    OC_BETWEEN_ACCELEROMETER_ZERO, /* m/s^2, zero error of the accelerometer */
    OC_BETWEEN_PULL, /* m/s^2, pull by the wheel alignment: new tyres, wear */
    OC_BETWEEN_GRADIENT, /* rad/(m/s^2), understeer gradient at the road wheel, by load */
    OC_BETWEEN_WHEELBASE, /* 1, equivalent wheelbase, as a share, by load */
    /* m/s^2, mean crown of a drive's roads; what is left of the prior's spread belongs to the region, which a truck's
     * drives share */
    OC_BETWEEN_CROWN,
    OC_BETWEEN_PLAY, /* rad, free play: temperature, wear, adjustment */
    /* end */
    OC_BETWEEN_COUNT
};

/* Variance of the change of a quantity, OC_BETWEEN_*, in the square of its unit. `off_s`: s between the drives, 0 where
 * unknown. */
float oc_variance_between_drives(int32_t quantity, float off_s);

#endif

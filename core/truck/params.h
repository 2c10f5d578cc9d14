#ifndef OC_PARAMS_H
#define OC_PARAMS_H
/* Tuning parameters, independent of the sample rate. Each name ends in its unit. The comment has the meaning, the
 * effect of small and large values, the default and its source. docs/make_params.py writes the doubles here and their
 * rows in params.c from params.toml. */

#include <stdbool.h>
#include <stdint.h>

#include "front_wheel.h"

/* Source of the motion, and estimated quantities. */
typedef enum {
    OC_METHOD_THESIS,      /* (36)-(38) by measured yaw rate and vehicle speed */
    OC_METHOD_JOINT,       /* offset, gradient, play and neutral lateral acceleration, by the corrected yaw rate */
    OC_METHOD_WHEEL_SPEED, /* (36)-(38) by wheel speeds, 5.5.4 */
    OC_METHOD_COUNT
} oc_method;

typedef struct {
    oc_method method;
    oc_angle_method angle_method; /* of the angle without its sensor, which the sensor is compared with */
    /* params.toml: members */
    /* Preprocess */
    /* cut-off of the low-pass of all signals but the angle; small smooths more and adds delay. 3, 5.1.1 */
    double cutoff_hz;
    double delay_band_hz; /* the angle is delayed by the filters' mean group delay from 0 to this frequency. 2, 5.1.1 */
    double speed_slope_window_s; /* window of the slope dv/dt; large smooths more and adds delay. 1, ours */
    double gap_max_s; /* a longer hole in the ticks restarts the filters. 0.1, ours */
    /* The gate (34), (35) */
    double speed_min_m_s; /* minimum speed; below it (10) is inaccurate and the column twists. 10, 5.1 */
    double curvature_max_1_m; /* R_max^-1 of (34); large admits bends. 1/800, Table 4 */
    /* limit of (34); large admits brake pull and torque steer. 0.3, Table 4 */
    double longitudinal_acceleration_max_m_s2;
    double bank_max_m_s2; /* a_y,max of (35); large admits banked roads. 0.3, Table 4 */
    double clean_time_s; /* t1: time after a tick in which all ticks must be clean. 2, Table 4 */
    /* Offset (36), (37) */
    double batch_s; /* evidence in a batch mean; must exceed the correlation time of the residual. 5, ours */
    double offset_evidence_min_s; /* minimum evidence of a valid offset. 20, 5.5.1's 300 m at 15 m/s */
    double offset_half_width_max_rad; /* maximum 95 % half-width of a valid offset. 1.5 deg, contract */
    /* prior sd of the yaw rate bias without a standstill. 0.1 deg/s, half of 5.3.1's 0.2 */
    double yaw_rate_bias_sd_rad_s;
    /* Understeer (38) */
    /* minimum lateral acceleration; below it (38) is ill-conditioned. 0.3, ours */
    double understeer_acceleration_min_m_s2;
    /* maximum lateral acceleration; above it tyres and axles are not linear. 1.5, 5.1.3 */
    double understeer_acceleration_max_m_s2;
    double understeer_evidence_min_s; /* minimum evidence; below it K_us is zero. 10, ours */
    double understeer_half_width_max_rad_m_s2; /* maximum 95 % half-width of a valid gradient. 0.2 deg/(m/s^2), ours */
    double understeer_sd_rad_m_s2; /* prior sd of K_us while it is set to zero. 0.4 deg/(m/s^2), 4.2's truck */
    /* Standstill */
    double standstill_speed_max_m_s; /* maximum speed of a standstill. 0.1, ours */
    double standstill_settling_s; /* time after stopping that is not used, until the cab has settled. 0.2, ours */
    double standstill_time_min_s; /* minimum duration of a standstill that is used. 0.5, ours */
    /* Gyro bias and wheel radii, 5.3.1 */
    /* prior sd of the bias; large relies on the wheels' radii instead. 1.5 deg/s, ours: 3 occurs */
    double gyro_bias_sd_rad_s;
    double gyro_bias_ignition_sd_rad_s; /* prior sd of the bias's change at an ignition. 0.1 deg/s, ours */
    double gyro_bias_wander_sd_rad_s; /* prior sd of the bias's random walk in a minute. 0.01 deg/s, ours */
    double gyro_bias_drift_first_sd_rad_s2; /* prior sd of the bias's drift at ignition. 0.3 deg/s/min, 2.5: 1 occurs */
    /* the same later, with wheel speeds; large follows faster, including the wheels' noise. 0.025 deg/s/min, ours: 0.8
     * deg/s in drift_time */
    double gyro_bias_drift_sd_rad_s2;
    double gyro_bias_drift_standing_sd_rad_s2; /* the same where only standstills are available. 0.01 deg/s/min, ours */
    double gyro_bias_drift_time_s; /* time constant of a drift. 1800, ours: twice 2.5's warm-up */
    double gyro_bias_half_width_max_rad_s; /* maximum 95 % half-width of a valid bias. 0.1 deg/s, half of 5.3.1's 0.2 */
    /* prior sd of the mismatch: left over right wheel radius, less one. 0.005, ours: wear and pressure */
    double wheel_radius_mismatch_sd_1;
    /* prior sd of the mismatch's random walk in an hour. 5e-4, bench/effects.py, row tyres_in_the_sun: 8e-4 in 10
     * minutes */
    double wheel_radius_wander_sd_1;
    double wheel_radius_load_sd_s2_m; /* prior sd of the mismatch per m/s^2 of lateral force. 0.003, ours */
    /* prior sd of the net turn of a drive without a gyro; increase it for laps in one direction. 360 deg, ours: one
     * loop more in one direction */
    double net_turn_sd_rad;
    /* sd of the lateral force by a bank that no accelerometer measures; of the mean bank of a drive by the wheel
     * speeds' method. 0.2, 5.3.2: 2 % of crown */
    double bank_sd_m_s2;
    double track_width_sd_1; /* prior sd of the error of a given track width, as a share of it. 0.02, ours */
    /* The joint method's gate: the method models bends and banks, which the thesis's gate excludes */
    double joint_speed_min_m_s; /* minimum speed; below it pole wheels miss pulses. 3, ours; `yard` */
    /* maximum curvature; large admits angles at which the ratio near the centre does not hold. 0.07, ours; `town` */
    double joint_curvature_max_1_m;
    /* maximum lateral acceleration; above it tyres and axles are not linear. 1.8, ours */
    double joint_lateral_acceleration_max_m_s2;
    /* maximum longitudinal acceleration; large admits brake pull and torque steer. 0.8, ours; `town` */
    double joint_longitudinal_acceleration_max_m_s2;
    /* maximum deviation of (33) from its mean; beyond are kerbs and faults. 1.0, ours */
    double joint_bank_change_max_m_s2;
    /* The joint method: memory and priors */
    /* maximum time constant of forgetting; small follows changes faster, large has less variance. 2000, ours */
    double joint_memory_s;
    double joint_evidence_min_s; /* minimum evidence of a valid answer. 60, ours */
    /* maximum 95 % half-width of a valid offset, drive part only; excludes pull, wind and axle set-up. 0.5 deg,
     * contract */
    double offset_drive_half_width_max_rad;
    double accelerometer_bias_sd_m_s2; /* prior sd of the accelerometer's bias. 0.5, ours: up to 0.6 was observed */
    /* prior sd of the bias's random walk in a minute; large follows a drift faster and forgets the flanks. 0.05,
     * bench/effects.py, row accelerometer_drift */
    double accelerometer_wander_sd_m_s2;
    /* prior sd of the shift of the neutral lateral acceleration by wheel alignment (pull). 0.05, ours */
    double pull_sd_m_s2;
    /* prior sd of the same shift by the mean crosswind of a drive. 0.02, ours: some 1.5 m/s of crosswind */
    double wind_sd_m_s2;
    double crown_m_s2; /* prior mean of the road crown, which falls to the side of traffic. 0.2, 2.5: 2 % */
    double crown_sd_m_s2; /* prior sd of that crown. 0.1, ours */
    /* prior probability of an axle set up to unload on that crown; 0 excludes it. Above 0.5 a given pull is that of
     * such an axle, and another one has the rest. 0.05, ours: one in twenty */
    double set_up_probability_1;
    /* crown of the ground at standstill, on roads and yards, as a share of the road crown. 0.5, ours */
    double standing_crown_share_1;
    double standing_slope_sd_m_s2; /* prior sd of the remaining slope of the ground at standstill. 0.2, ours: 2 % */
    /* lateral force of the front tyres per curvature, where rear axles resist turning. 0, ours; 6x2 some 12, 8x4 10,
     * 6x4 19 */
    double tandem_side_force_m2_s2;
    /* front wheel angle per angle of a steered rear axle on the same circle; 0: none is steered, else the signal
     * rear_axle_angle is required. 0, the vehicle file; 1 for two axles, a tag axle some 0.6 */
    double rear_axle_weight_1;
    /* Given values of the truck; a standard deviation of 0: not given */
    /* free play of the steering, wind-up of the column included. 0 deg, the vehicle file or the truck's memory */
    double known_play_rad;
    double known_play_sd_rad; /* its standard deviation. 0 deg, 0: not given */
    /* K_us/g at the road wheel. 0 deg/(m/s^2), the vehicle file or the truck's memory */
    double known_understeer_gradient_rad_m_s2;
    /* its standard deviation, including changes of load. 0 deg/(m/s^2), 0: not given */
    double known_understeer_gradient_sd_rad_m_s2;
    /* share by which the equivalent wheelbase is longer than the vehicle file's. 0, the truck's memory */
    double known_wheelbase_share_1;
    double known_wheelbase_share_sd_1; /* its standard deviation. 0, 0: not given */
    /* pull: neutral lateral acceleration by wheel alignment; positive to the left. 0, the vehicle file */
    double known_pull_m_s2;
    /* its standard deviation; replaces pull_sd_m_s2 and the prior of an axle set up for the crown. 0, 0: not given */
    double known_pull_sd_m_s2;
    /* bias of the lateral accelerometer. 0, the vehicle file or the truck's memory */
    double known_accelerometer_bias_m_s2;
    /* its standard deviation; replaces accelerometer_bias_sd_m_s2. 0, 0: not given */
    double known_accelerometer_bias_sd_m_s2;
    /* bias of the yaw rate sensor at the start of the drive. 0 deg/s, the vehicle file or the truck's memory */
    double known_yaw_rate_bias_rad_s;
    /* its standard deviation; replaces gyro_bias_sd_rad_s. 0 deg/s, 0: not given */
    double known_yaw_rate_bias_sd_rad_s;
    /* reading of a steered rear axle's angle sensor with that axle straight. 0 deg, the vehicle file, or an axle that
     * was locked */
    double known_rear_axle_zero_rad;
    /* its standard deviation; without it the offset is the combined one of the front and the rear axle's sensors. 0
     * deg, 0: not given */
    double known_rear_axle_zero_sd_rad;
    /* Steering wheel torque */
    /* prior mean of the torque per lateral acceleration, sd half of it; set it for a rod's or motor's force. 2, ours: 1
     * to 3 on centre, with assistance */
    double torque_slope_n_m_m_s2;
    double torque_zero_sd_n_m; /* prior sd of the torque sensor's zero error. 0.1, ours */
    /* 1: without an accelerometer (use_accelerometer 0) a torque signal replaces it and is required. 0, ours */
    double torque_for_accelerometer_1;
    /* end */
    /* 1: the accelerometer is used (5.3.2, 5.5.3); 0: r*v alone, without a bank limit */
    int32_t use_accelerometer;
} oc_params;

/* Joint method, observer, and the defaults of docs/params.md. */
void oc_params_defaults(oc_params *params);

/* Whether all are within their ranges. */
bool oc_params_are_sound(const oc_params *params);

/* Name of the first one out of its range, or NULL. A program that calls it has the names in flash, a kilobyte. */
const char *oc_params_check(const oc_params *params);

#endif

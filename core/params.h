#ifndef OC_PARAMS_H
#define OC_PARAMS_H
/* What an engineer tunes, free of the sample rate. Every name ends in its unit; the text behind says
 * what it means, what small and large do, its default and the default's source. docs/make_params.py writes the doubles
 * here and their rows in params.c from params.toml. */

#include <stdbool.h>
#include <stdint.h>

#include "angle.h"

/* Whose word is taken for the motion, and what is estimated from it. */
typedef enum {
    OC_METHOD_THESIS,      /* (36)-(38) from yaw rate and vehicle speed as they are */
    OC_METHOD_JOINT,       /* offset, gradient, play and unloading point together, from the corrected yaw rate */
    OC_METHOD_WHEEL_SPEED, /* (36)-(38) from wheel speeds, 5.5.4 */
    OC_METHOD_COUNT
} oc_method;

typedef struct {
    oc_method method;
    oc_angle_method angle_method; /* of the angle without its sensor, by which that is judged */
    /* params.toml: members */
    /* Preprocess */
    double cutoff_hz; /* low-pass of all signals but the angle; small is smoother and later. 3, 5.1.1 */
    double delay_band_hz; /* the angle waits for the filters' mean group delay from 0 to here. 2, 5.1.1 */
    double speed_slope_window_s; /* smoothing of dv/dt; large is calmer and later. 1, ours */
    double gap_max_s; /* a longer hole restarts the filters. 0.1, ours */
    /* The gate (34), (35) */
    double speed_min_m_s; /* below it (10) and the column's torsion are poor. 10, 5.1 */
    double curvature_max_1_m; /* R_max^-1 of (34); large lets bends in. 1/800, Table 4 */
    double longitudinal_acceleration_max_m_s2; /* of (34); large lets brake pull and torque steer in. 0.3, Table 4 */
    double bank_max_m_s2; /* a_y,max of (35); large lets banked roads in. 0.3, Table 4 */
    double clean_time_s; /* t1: how long all must be clean after a tick. 2, Table 4 */
    /* Offset (36), (37) */
    double batch_s; /* evidence a batch mean spans; must outlast the residual's memory. 5, ours */
    double offset_evidence_min_s; /* less evidence leaves the offset not valid. 20, 5.5.1's 300 m at 15 m/s */
    double offset_half_width_max_rad; /* 1.96 sd beyond it are not valid. 1.5 deg, contract */
    double yaw_rate_bias_sd_rad_s; /* prior where no standstill tells. 0.1 deg/s, half of 5.3.1's 0.2 */
    /* Understeer (38) */
    double understeer_acceleration_min_m_s2; /* below it (38) divides by next to nothing. 0.3, ours */
    double understeer_acceleration_max_m_s2; /* above it tyres and axles bend the line. 1.5, 5.1.3 */
    double understeer_evidence_min_s; /* K_us stays zero below it. 10, ours */
    double understeer_half_width_max_rad_m_s2; /* a wider 95 % interval is not valid. 0.2 deg/(m/s^2), ours */
    double understeer_sd_rad_m_s2; /* prior while K_us is taken as zero. 0.4 deg/(m/s^2), 4.2's truck */
    /* Standstill */
    double standstill_speed_max_m_s; /* slower is standing. 0.1, ours */
    double standstill_settling_s; /* left out after stopping, until the cab is still. 0.2, ours */
    double standstill_time_min_s; /* minimum duration of a standstill that is used. 0.5, ours */
    /* Gyro bias and wheel radii, 5.3.1 */
    double gyro_bias_sd_rad_s; /* prior; large trusts the wheels' radii instead. 1.5 deg/s, ours: 3 occurs */
    double gyro_bias_ignition_sd_rad_s; /* prior of the bias's change at each ignition. 0.1 deg/s, ours */
    double gyro_bias_wander_sd_rad_s; /* prior of the bias's random change in a minute. 0.01 deg/s, ours */
    /* prior of the bias's steady change at ignition. 0.3 deg/s/min, 2.5: 1 occurs */
    double gyro_bias_drift_first_sd_rad_s2;
    /* the same later, where wheel speeds observe it; large follows sooner, and follows the wheels' noise. 0.025
     * deg/s/min, ours: 0.8 deg/s in drift_time */
    double gyro_bias_drift_sd_rad_s2;
    double gyro_bias_drift_standing_sd_rad_s2; /* the same where only standstills observe it. 0.01 deg/s/min, ours */
    double gyro_bias_drift_time_s; /* how long a drift lasts. 1800, ours: twice 2.5's warm-up */
    double gyro_bias_half_width_max_rad_s; /* a wider 95 % interval is not valid. 0.1 deg/s, half of 5.3.1's 0.2 */
    double wheel_radius_mismatch_sd_1; /* prior of left over right radius, less one. 0.005, ours: wear and pressure */
    /* prior of the mismatch's random change in an hour. 5e-4, bench/effects.py, row tyres_in_the_sun: 8e-4 in 10
     * minutes */
    double wheel_radius_wander_sd_1;
    double wheel_radius_load_sd_s2_m; /* prior of the mismatch per m/s^2 of lateral force. 0.003, ours */
    /* prior of a whole drive's turning, where no gyro measures it; set more where a track is lapped one way. 360 deg,
     * ours: a loop more to one side */
    double net_turn_sd_rad;
    /* prior of a whole drive's mean bank, without an accelerometer; only for the wheel speeds' method. 0.2, 5.3.2: 2 %
     * of crown */
    double bank_sd_m_s2;
    double track_width_sd_1; /* prior, of the width, where the vehicle file has it. 0.02, ours */
    /* The joint method's gate: it models what the thesis's must avoid */
    double joint_speed_min_m_s; /* slower ticks are not used; pole wheels miss pulses there. 3, ours; `yard` */
    double joint_curvature_max_1_m; /* large lets in what the ratio near centre misses. 0.07, ours; `town` */
    double joint_lateral_acceleration_max_m_s2; /* above it tyres and axles bend the line. 1.8, ours */
    double joint_longitudinal_acceleration_max_m_s2; /* large lets brake pull and torque steer in. 0.8, ours; `town` */
    double joint_bank_change_max_m_s2; /* of (33) about its mean: kerbs and faults. 1.0, ours */
    /* The joint method: how far back its evidence reaches, and its priors */
    double joint_memory_s; /* small follows change sooner, large is surer. 2000, ours */
    double joint_evidence_min_s; /* less evidence leaves the answer not valid. 60, ours */
    /* a larger 95 % half-width of the drive's own part is not valid; pull, wind and axle set-up are not in it. 0.5 deg,
     * contract */
    double offset_drive_half_width_max_rad;
    double accelerometer_bias_sd_m_s2; /* prior of the accelerometer's bias. 0.5, ours: 0.6 was seen */
    /* prior of the bias's random change in a minute; large follows a drift sooner, and forgets the flanks. 0.05,
     * bench/effects.py, row accelerometer_drift */
    double accelerometer_wander_sd_m_s2;
    /* prior of the lateral force by which alignment shifts the neutral lateral acceleration. 0.05, ours */
    double pull_sd_m_s2;
    double wind_sd_m_s2; /* prior of the same shift by a drive's mean crosswind. 0.02, ours: some 1.5 m/s of it */
    double crown_m_s2; /* a road's mean fall to the side of traffic. 0.2, 2.5: 2 % */
    double crown_sd_m_s2; /* prior sd of that crown. 0.1, ours */
    /* share of the crown that the ground has where trucks stand, road or yard. 0.5, ours */
    double standing_crown_share_1;
    double standing_slope_sd_m_s2; /* prior of the rest of that ground's slope. 0.2, ours: 2 % */
    /* lateral force of the front tyres by a bend's curvature alone, since rear axles resist turning. 0, ours; 6x2 some
     * 12, 8x4 10, 6x4 19 */
    double tandem_side_force_m2_s2;
    /* What the truck is known to be; a standard deviation of 0: not known */
    /* free play of the steering, wind-up of the column included. 0 deg, the vehicle file or the truck's memory */
    double known_play_rad;
    double known_play_sd_rad; /* its standard deviation. 0 deg, 0: unknown */
    /* K_us/g at the road wheel. 0 deg/(m/s^2), the vehicle file or the truck's memory */
    double known_understeer_gradient_rad_m_s2;
    /* its standard deviation, by load as well. 0 deg/(m/s^2), 0: unknown */
    double known_understeer_gradient_sd_rad_m_s2;
    /* share by which the equivalent wheelbase is longer than the vehicle file's. 0, the truck's memory */
    double known_wheelbase_share_1;
    double known_wheelbase_share_sd_1; /* its standard deviation. 0, 0: unknown */
    /* lateral acceleration at which the steering unloads, by wheel alignment; positive to the left. 0, the vehicle file
     * */
    double known_pull_m_s2;
    /* its standard deviation, in place of pull_sd_m_s2 and of an axle that may be set up for the crown. 0, 0: unknown
     * */
    double known_pull_sd_m_s2;
    /* bias of the lateral accelerometer. 0, the vehicle file or the truck's memory */
    double known_accelerometer_bias_m_s2;
    /* its standard deviation, in place of accelerometer_bias_sd_m_s2. 0, 0: unknown */
    double known_accelerometer_bias_sd_m_s2;
    /* bias of the yaw rate sensor when the drive begins. 0 deg/s, the vehicle file or the truck's memory */
    double known_yaw_rate_bias_rad_s;
    /* its standard deviation, in place of gyro_bias_sd_rad_s. 0 deg/s, 0: unknown */
    double known_yaw_rate_bias_sd_rad_s;
    /* Steering wheel torque */
    /* prior of the torque per lateral acceleration, with an sd of half of it; a rod's or motor's force has another. 2,
     * ours: 1 to 3 on centre, with assistance */
    double torque_slope_n_m_m_s2;
    double torque_zero_sd_n_m; /* prior of the torque sensor's zero error, sd. 0.1, ours */
    /* 1: with use_accelerometer 0 a torque signal replaces the accelerometer, and is needed. 0, ours */
    double torque_for_accelerometer_1;
    /* end */
    /* whether the accelerometer is used at all (5.3.2, 5.5.3): 1, or 0 for r*v alone and no bank limit */
    int32_t use_accelerometer;
} oc_params;

void oc_params_defaults(oc_params *params);

/* Whether each is within its range. */
bool oc_params_are_sound(const oc_params *params);

/* The name of the first that is not, or NULL; the names are a kilobyte of flash where this is called. */
const char *oc_params_check(const oc_params *params);

#endif

#include "params.h"

#include <stdbool.h>
#include <stddef.h>
#include <string.h>

#define DEGREE (3.14159265358979323846 / 180.0) /* rad, for constants */

static const oc_params defaults = {
    .method = OC_METHOD_JOINT,
    .angle_method = OC_ANGLE_OBSERVER,
    /* params.toml: defaults */
    .cutoff_hz = 3.0,
    .delay_band_hz = 2.0,
    .speed_slope_window_s = 1.0,
    .gap_max_s = 0.1,
    .speed_min_m_s = 10.0,
    .curvature_max_1_m = 1.0 / 800.0,
    .longitudinal_acceleration_max_m_s2 = 0.3,
    .bank_max_m_s2 = 0.3,
    .clean_time_s = 2.0,
    .batch_s = 5.0,
    .offset_evidence_min_s = 20.0,
    .offset_half_width_max_rad = 1.5 * DEGREE,
    .yaw_rate_bias_sd_rad_s = 0.1 * DEGREE,
    .understeer_acceleration_min_m_s2 = 0.3,
    .understeer_acceleration_max_m_s2 = 1.5,
    .understeer_evidence_min_s = 10.0,
    .understeer_half_width_max_rad_m_s2 = 0.2 * DEGREE,
    .understeer_sd_rad_m_s2 = 0.4 * DEGREE,
    .standstill_speed_max_m_s = 0.1,
    .standstill_settling_s = 0.2,
    .standstill_time_min_s = 0.5,
    .gyro_bias_sd_rad_s = 1.5 * DEGREE,
    .gyro_bias_ignition_sd_rad_s = 0.1 * DEGREE,
    .gyro_bias_wander_sd_rad_s = 0.01 * DEGREE,
    .gyro_bias_drift_first_sd_rad_s2 = 0.3 * DEGREE / 60.0,
    .gyro_bias_drift_sd_rad_s2 = 0.025 * DEGREE / 60.0,
    .gyro_bias_drift_standing_sd_rad_s2 = 0.01 * DEGREE / 60.0,
    .gyro_bias_drift_time_s = 1800.0,
    .gyro_bias_half_width_max_rad_s = 0.1 * DEGREE,
    .wheel_radius_mismatch_sd_1 = 0.005,
    .wheel_radius_wander_sd_1 = 0.0005,
    .wheel_radius_load_sd_s2_m = 0.003,
    .net_turn_sd_rad = 360.0 * DEGREE,
    .bank_sd_m_s2 = 0.2,
    .track_width_sd_1 = 0.02,
    .joint_speed_min_m_s = 3.0,
    .joint_curvature_max_1_m = 0.07,
    .joint_lateral_acceleration_max_m_s2 = 1.8,
    .joint_longitudinal_acceleration_max_m_s2 = 0.8,
    .joint_bank_change_max_m_s2 = 1.0,
    .joint_memory_s = 2000.0,
    .joint_evidence_min_s = 60.0,
    .offset_drive_half_width_max_rad = 0.5 * DEGREE,
    .accelerometer_bias_sd_m_s2 = 0.5,
    .accelerometer_wander_sd_m_s2 = 0.05,
    .pull_sd_m_s2 = 0.05,
    .wind_sd_m_s2 = 0.02,
    .crown_m_s2 = 0.2,
    .crown_sd_m_s2 = 0.1,
    .set_up_probability_1 = 0.05,
    .standing_crown_share_1 = 0.5,
    .standing_slope_sd_m_s2 = 0.2,
    .tandem_side_force_m2_s2 = 0.0,
    .rear_axle_weight_1 = 0.0,
    .known_play_rad = 0.0 * DEGREE,
    .known_play_sd_rad = 0.0 * DEGREE,
    .known_understeer_gradient_rad_m_s2 = 0.0 * DEGREE,
    .known_understeer_gradient_sd_rad_m_s2 = 0.0 * DEGREE,
    .known_wheelbase_share_1 = 0.0,
    .known_wheelbase_share_sd_1 = 0.0,
    .known_pull_m_s2 = 0.0,
    .known_pull_sd_m_s2 = 0.0,
    .known_accelerometer_bias_m_s2 = 0.0,
    .known_accelerometer_bias_sd_m_s2 = 0.0,
    .known_yaw_rate_bias_rad_s = 0.0 * DEGREE,
    .known_yaw_rate_bias_sd_rad_s = 0.0 * DEGREE,
    .known_rear_axle_zero_rad = 0.0 * DEGREE,
    .known_rear_axle_zero_sd_rad = 0.0 * DEGREE,
    .torque_slope_n_m_m_s2 = 2.0,
    .torque_zero_sd_n_m = 0.1,
    .torque_for_accelerometer_1 = 0.0,
    /* end */
    .use_accelerometer = 1,
};

void oc_params_defaults(oc_params *params) {
    *params = defaults;
}

/* Ranges of the params that are doubles, in single precision and in the order of oc_params. */
static const struct {
    float low, high;
} ranges[] = {
    /* params.toml: ranges */
    {1.0f, 50.0f}, /* cutoff_hz */
    {0.1f, 49.5f}, /* delay_band_hz */
    {0.2f, 5.0f}, /* speed_slope_window_s */
    {0.01f, 1.0f}, /* gap_max_s */
    {1.0f, 40.0f}, /* speed_min_m_s */
    {1e-05f, 0.1f}, /* curvature_max_1_m */
    {0.01f, 10.0f}, /* longitudinal_acceleration_max_m_s2 */
    {0.01f, 10.0f}, /* bank_max_m_s2 */
    {0.1f, 20.0f}, /* clean_time_s */
    {0.1f, 600.0f}, /* batch_s */
    {0.0f, 100000.0f}, /* offset_evidence_min_s */
    {0.0001f, 1.0f}, /* offset_half_width_max_rad */
    {0.0f, 0.1f}, /* yaw_rate_bias_sd_rad_s */
    {0.01f, 5.0f}, /* understeer_acceleration_min_m_s2 */
    {0.01f, 10.0f}, /* understeer_acceleration_max_m_s2 */
    {0.0f, 100000.0f}, /* understeer_evidence_min_s */
    {1e-06f, 1.0f}, /* understeer_half_width_max_rad_m_s2 */
    {0.0f, 1.0f}, /* understeer_sd_rad_m_s2 */
    {0.0f, 1.0f}, /* standstill_speed_max_m_s */
    {0.0f, 60.0f}, /* standstill_settling_s */
    {0.1f, 600.0f}, /* standstill_time_min_s */
    {0.0001f, 1.0f}, /* gyro_bias_sd_rad_s */
    {0.0f, 1.0f}, /* gyro_bias_ignition_sd_rad_s */
    {0.0f, 0.1f}, /* gyro_bias_wander_sd_rad_s */
    {0.0f, 0.01f}, /* gyro_bias_drift_first_sd_rad_s2 */
    {0.0f, 0.01f}, /* gyro_bias_drift_sd_rad_s2 */
    {0.0f, 0.01f}, /* gyro_bias_drift_standing_sd_rad_s2 */
    {1.0f, 100000.0f}, /* gyro_bias_drift_time_s */
    {1e-05f, 1.0f}, /* gyro_bias_half_width_max_rad_s */
    {0.0f, 0.1f}, /* wheel_radius_mismatch_sd_1 */
    {0.0f, 0.01f}, /* wheel_radius_wander_sd_1 */
    {0.0f, 0.1f}, /* wheel_radius_load_sd_s2_m */
    {0.1f, 10000.0f}, /* net_turn_sd_rad */
    {0.0f, 10.0f}, /* bank_sd_m_s2 */
    {0.0f, 0.2f}, /* track_width_sd_1 */
    {1.0f, 40.0f}, /* joint_speed_min_m_s */
    {0.0001f, 0.1f}, /* joint_curvature_max_1_m */
    {0.1f, 5.0f}, /* joint_lateral_acceleration_max_m_s2 */
    {0.01f, 10.0f}, /* joint_longitudinal_acceleration_max_m_s2 */
    {0.05f, 10.0f}, /* joint_bank_change_max_m_s2 */
    {100.0f, 100000.0f}, /* joint_memory_s */
    {5.0f, 100000.0f}, /* joint_evidence_min_s */
    {0.0001f, 1.0f}, /* offset_drive_half_width_max_rad */
    {0.001f, 10.0f}, /* accelerometer_bias_sd_m_s2 */
    {0.0f, 1.0f}, /* accelerometer_wander_sd_m_s2 */
    {0.0f, 10.0f}, /* pull_sd_m_s2 */
    {0.0f, 10.0f}, /* wind_sd_m_s2 */
    {0.0f, 2.0f}, /* crown_m_s2 */
    {0.001f, 10.0f}, /* crown_sd_m_s2 */
    {0.0f, 1.0f}, /* set_up_probability_1 */
    {0.0f, 1.0f}, /* standing_crown_share_1 */
    {0.001f, 10.0f}, /* standing_slope_sd_m_s2 */
    {0.0f, 100.0f}, /* tandem_side_force_m2_s2 */
    {0.0f, 1.5f}, /* rear_axle_weight_1 */
    {0.0f, 0.6f}, /* known_play_rad */
    {0.0f, 0.6f}, /* known_play_sd_rad */
    {-0.1f, 0.1f}, /* known_understeer_gradient_rad_m_s2 */
    {0.0f, 0.1f}, /* known_understeer_gradient_sd_rad_m_s2 */
    {-0.5f, 0.5f}, /* known_wheelbase_share_1 */
    {0.0f, 0.5f}, /* known_wheelbase_share_sd_1 */
    {-0.9f, 0.9f}, /* known_pull_m_s2 */
    {0.0f, 10.0f}, /* known_pull_sd_m_s2 */
    {-0.9f, 0.9f}, /* known_accelerometer_bias_m_s2 */
    {0.0f, 10.0f}, /* known_accelerometer_bias_sd_m_s2 */
    {-0.2f, 0.2f}, /* known_yaw_rate_bias_rad_s */
    {0.0f, 1.0f}, /* known_yaw_rate_bias_sd_rad_s */
    {-0.8f, 0.8f}, /* known_rear_axle_zero_rad */
    {0.0f, 0.8f}, /* known_rear_axle_zero_sd_rad */
    {0.05f, 1000.0f}, /* torque_slope_n_m_m_s2 */
    {0.001f, 100.0f}, /* torque_zero_sd_n_m */
    {0.0f, 1.0f}, /* torque_for_accelerometer_1 */
    /* end */
};

/* Their number, and the names after theirs. */
enum { DOUBLES = sizeof ranges / sizeof ranges[0], METHOD = DOUBLES, ANGLE_METHOD, USE_ACCELEROMETER, SOUND };

static size_t number_of_param(size_t place) {
    return (place - offsetof(oc_params, cutoff_hz)) / sizeof(double);
}

static bool is_outside(const oc_params *params, size_t number) {
    double exact;
    (void)memcpy(&exact, (const char *)params + offsetof(oc_params, cutoff_hz) + number * sizeof exact, sizeof exact);
    const float value = (float)exact;
    return !(value >= ranges[number].low && value <= ranges[number].high); /* true for NaN */
}

static size_t first_fault(const oc_params *p) {
    for (size_t k = 0; k < DOUBLES; ++k) {
        if (is_outside(p, k)) {
            return k;
        }
    }
    if (p->delay_band_hz > 0.99 * p->cutoff_hz) {
        return number_of_param(offsetof(oc_params, delay_band_hz));
    }
    if (p->understeer_acceleration_max_m_s2 < p->understeer_acceleration_min_m_s2) {
        return number_of_param(offsetof(oc_params, understeer_acceleration_max_m_s2));
    }
    if ((uint32_t)p->method >= OC_METHOD_COUNT) {
        return METHOD;
    }
    if ((uint32_t)p->angle_method >= OC_ANGLE_METHOD_COUNT) {
        return ANGLE_METHOD;
    }
    return p->use_accelerometer == 0 || p->use_accelerometer == 1 ? SOUND : USE_ACCELEROMETER;
}

bool oc_params_are_sound(const oc_params *params) {
    return first_fault(params) == SOUND;
}

/* In the order of first_fault. */
static const char *const names[] = {
    /* params.toml: names */
    "cutoff_hz", "delay_band_hz", "speed_slope_window_s", "gap_max_s", "speed_min_m_s", "curvature_max_1_m",
    "longitudinal_acceleration_max_m_s2", "bank_max_m_s2", "clean_time_s", "batch_s", "offset_evidence_min_s",
    "offset_half_width_max_rad", "yaw_rate_bias_sd_rad_s", "understeer_acceleration_min_m_s2",
    "understeer_acceleration_max_m_s2", "understeer_evidence_min_s", "understeer_half_width_max_rad_m_s2",
    "understeer_sd_rad_m_s2", "standstill_speed_max_m_s", "standstill_settling_s", "standstill_time_min_s",
    "gyro_bias_sd_rad_s", "gyro_bias_ignition_sd_rad_s", "gyro_bias_wander_sd_rad_s", "gyro_bias_drift_first_sd_rad_s2",
    "gyro_bias_drift_sd_rad_s2", "gyro_bias_drift_standing_sd_rad_s2", "gyro_bias_drift_time_s",
    "gyro_bias_half_width_max_rad_s", "wheel_radius_mismatch_sd_1", "wheel_radius_wander_sd_1",
    "wheel_radius_load_sd_s2_m", "net_turn_sd_rad", "bank_sd_m_s2", "track_width_sd_1", "joint_speed_min_m_s",
    "joint_curvature_max_1_m", "joint_lateral_acceleration_max_m_s2", "joint_longitudinal_acceleration_max_m_s2",
    "joint_bank_change_max_m_s2", "joint_memory_s", "joint_evidence_min_s", "offset_drive_half_width_max_rad",
    "accelerometer_bias_sd_m_s2", "accelerometer_wander_sd_m_s2", "pull_sd_m_s2", "wind_sd_m_s2", "crown_m_s2",
    "crown_sd_m_s2", "set_up_probability_1", "standing_crown_share_1", "standing_slope_sd_m_s2",
    "tandem_side_force_m2_s2", "rear_axle_weight_1", "known_play_rad", "known_play_sd_rad",
    "known_understeer_gradient_rad_m_s2", "known_understeer_gradient_sd_rad_m_s2", "known_wheelbase_share_1",
    "known_wheelbase_share_sd_1", "known_pull_m_s2", "known_pull_sd_m_s2", "known_accelerometer_bias_m_s2",
    "known_accelerometer_bias_sd_m_s2", "known_yaw_rate_bias_rad_s", "known_yaw_rate_bias_sd_rad_s",
    "known_rear_axle_zero_rad", "known_rear_axle_zero_sd_rad", "torque_slope_n_m_m_s2", "torque_zero_sd_n_m",
    "torque_for_accelerometer_1",
    /* end */
    "method",
    "angle_method",
    "use_accelerometer",
    NULL,
};

const char *oc_params_check(const oc_params *params) {
    return names[first_fault(params)];
}

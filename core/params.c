#include "params.h"

#include <stdbool.h>
#include <stddef.h>
#include <string.h>

static const double degree = 3.14159265358979323846 / 180.0;

void oc_params_defaults(oc_params *params) {
    *params = (oc_params){
        .method = OC_METHOD_THESIS,
        .angle_method = OC_ANGLE_NONE,
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
        .offset_half_width_max_rad = 1.5 * degree,
        .yaw_rate_bias_sd_rad_s = 0.1 * degree,
        .understeer_acceleration_min_m_s2 = 0.3,
        .understeer_acceleration_max_m_s2 = 1.5,
        .understeer_evidence_min_s = 10.0,
        .understeer_half_width_max_rad_m_s2 = 0.2 * degree,
        .understeer_sd_rad_m_s2 = 0.4 * degree,
        .standstill_speed_max_m_s = 0.1,
        .standstill_settling_s = 0.2,
        .standstill_time_min_s = 0.5,
        .gyro_bias_sd_rad_s = 1.5 * degree,
        .gyro_bias_ignition_sd_rad_s = 0.1 * degree,
        .gyro_bias_wander_sd_rad_s = 0.01 * degree,
        .gyro_bias_drift_first_sd_rad_s2 = 0.3 * degree / 60.0,
        .gyro_bias_drift_sd_rad_s2 = 0.05 * degree / 60.0,
        .gyro_bias_drift_standing_sd_rad_s2 = 0.01 * degree / 60.0,
        .gyro_bias_drift_time_s = 1800.0,
        .gyro_bias_half_width_max_rad_s = 0.1 * degree,
        .wheel_radius_mismatch_sd_1 = 0.005,
        .wheel_radius_wander_sd_1 = 5e-5,
        .wheel_radius_load_sd_s2_m = 0.003,
        .net_turn_sd_rad = 360.0 * degree,
        .bank_sd_m_s2 = 0.2,
        .track_width_sd_1 = 0.02,
        .joint_speed_min_m_s = 8.0,
        .joint_curvature_max_1_m = 1.0 / 100.0,
        .joint_lateral_acceleration_max_m_s2 = 1.8,
        .joint_longitudinal_acceleration_max_m_s2 = 0.6,
        .joint_bank_change_max_m_s2 = 1.0,
        .joint_memory_s = 2000.0,
        .joint_evidence_min_s = 60.0,
        .accelerometer_bias_sd_m_s2 = 0.5,
        .pull_sd_m_s2 = 0.05,
        .wind_sd_m_s2 = 0.02,
        .crown_m_s2 = 0.2,
        .crown_sd_m_s2 = 0.1,
        .standing_crown_share_1 = 0.5,
        .standing_slope_sd_m_s2 = 0.2,
        .use_accelerometer = 1,
    };
}

/* Of a param that is a double. Not on the stack, which is small in firmware. */
typedef struct {
    const char *name;
    size_t place; /* in oc_params */
    double low, high;
} range;

static const range ranges[] = {
    {"cutoff_hz", offsetof(oc_params, cutoff_hz), 1.0, 50.0},
    {"delay_band_hz", offsetof(oc_params, delay_band_hz), 0.1, 49.5},
    {"speed_slope_window_s", offsetof(oc_params, speed_slope_window_s), 0.2, 5.0},
    {"gap_max_s", offsetof(oc_params, gap_max_s), 0.01, 1.0},
    {"speed_min_m_s", offsetof(oc_params, speed_min_m_s), 1.0, 40.0},
    {"curvature_max_1_m", offsetof(oc_params, curvature_max_1_m), 1e-5, 0.1},
    {"longitudinal_acceleration_max_m_s2", offsetof(oc_params, longitudinal_acceleration_max_m_s2), 0.01, 10.0},
    {"bank_max_m_s2", offsetof(oc_params, bank_max_m_s2), 0.01, 10.0},
    {"clean_time_s", offsetof(oc_params, clean_time_s), 0.1, 20.0},
    {"batch_s", offsetof(oc_params, batch_s), 0.1, 600.0},
    {"offset_evidence_min_s", offsetof(oc_params, offset_evidence_min_s), 0.0, 1e5},
    {"offset_half_width_max_rad", offsetof(oc_params, offset_half_width_max_rad), 1e-4, 1.0},
    {"yaw_rate_bias_sd_rad_s", offsetof(oc_params, yaw_rate_bias_sd_rad_s), 0.0, 0.1},
    {"understeer_acceleration_min_m_s2", offsetof(oc_params, understeer_acceleration_min_m_s2), 0.01, 5.0},
    {"understeer_acceleration_max_m_s2", offsetof(oc_params, understeer_acceleration_max_m_s2), 0.01, 10.0},
    {"understeer_evidence_min_s", offsetof(oc_params, understeer_evidence_min_s), 0.0, 1e5},
    {"understeer_half_width_max_rad_m_s2", offsetof(oc_params, understeer_half_width_max_rad_m_s2), 1e-6, 1.0},
    {"understeer_sd_rad_m_s2", offsetof(oc_params, understeer_sd_rad_m_s2), 0.0, 1.0},
    {"joint_speed_min_m_s", offsetof(oc_params, joint_speed_min_m_s), 1.0, 40.0},
    {"joint_curvature_max_1_m", offsetof(oc_params, joint_curvature_max_1_m), 1e-4, 0.1},
    {"joint_lateral_acceleration_max_m_s2", offsetof(oc_params, joint_lateral_acceleration_max_m_s2), 0.1, 5.0},
    {"joint_longitudinal_acceleration_max_m_s2", offsetof(oc_params, joint_longitudinal_acceleration_max_m_s2), 0.01,
     10.0},
    {"joint_bank_change_max_m_s2", offsetof(oc_params, joint_bank_change_max_m_s2), 0.05, 10.0},
    {"joint_memory_s", offsetof(oc_params, joint_memory_s), 100.0, 1e5},
    {"joint_evidence_min_s", offsetof(oc_params, joint_evidence_min_s), 5.0, 1e5},
    {"accelerometer_bias_sd_m_s2", offsetof(oc_params, accelerometer_bias_sd_m_s2), 0.001, 10.0},
    {"pull_sd_m_s2", offsetof(oc_params, pull_sd_m_s2), 0.0, 10.0},
    {"wind_sd_m_s2", offsetof(oc_params, wind_sd_m_s2), 0.0, 10.0},
    {"crown_m_s2", offsetof(oc_params, crown_m_s2), 0.0, 2.0},
    {"crown_sd_m_s2", offsetof(oc_params, crown_sd_m_s2), 0.001, 10.0},
    {"standing_crown_share_1", offsetof(oc_params, standing_crown_share_1), 0.0, 1.0},
    {"standing_slope_sd_m_s2", offsetof(oc_params, standing_slope_sd_m_s2), 0.001, 10.0},
    {"standstill_speed_max_m_s", offsetof(oc_params, standstill_speed_max_m_s), 0.0, 1.0},
    {"standstill_settling_s", offsetof(oc_params, standstill_settling_s), 0.0, 60.0},
    {"standstill_time_min_s", offsetof(oc_params, standstill_time_min_s), 0.1, 600.0},
    {"gyro_bias_sd_rad_s", offsetof(oc_params, gyro_bias_sd_rad_s), 1e-4, 1.0},
    {"gyro_bias_ignition_sd_rad_s", offsetof(oc_params, gyro_bias_ignition_sd_rad_s), 0.0, 1.0},
    {"gyro_bias_wander_sd_rad_s", offsetof(oc_params, gyro_bias_wander_sd_rad_s), 0.0, 0.1},
    {"gyro_bias_drift_first_sd_rad_s2", offsetof(oc_params, gyro_bias_drift_first_sd_rad_s2), 0.0, 0.01},
    {"gyro_bias_drift_sd_rad_s2", offsetof(oc_params, gyro_bias_drift_sd_rad_s2), 0.0, 0.01},
    {"gyro_bias_drift_standing_sd_rad_s2", offsetof(oc_params, gyro_bias_drift_standing_sd_rad_s2), 0.0, 0.01},
    {"gyro_bias_drift_time_s", offsetof(oc_params, gyro_bias_drift_time_s), 1.0, 1e5},
    {"gyro_bias_half_width_max_rad_s", offsetof(oc_params, gyro_bias_half_width_max_rad_s), 1e-5, 1.0},
    {"wheel_radius_mismatch_sd_1", offsetof(oc_params, wheel_radius_mismatch_sd_1), 0.0, 0.1},
    {"wheel_radius_wander_sd_1", offsetof(oc_params, wheel_radius_wander_sd_1), 0.0, 0.01},
    {"wheel_radius_load_sd_s2_m", offsetof(oc_params, wheel_radius_load_sd_s2_m), 0.0, 0.1},
    {"net_turn_sd_rad", offsetof(oc_params, net_turn_sd_rad), 0.1, 1e4},
    {"bank_sd_m_s2", offsetof(oc_params, bank_sd_m_s2), 0.0, 10.0},
    {"track_width_sd_1", offsetof(oc_params, track_width_sd_1), 0.0, 0.2},
};

static bool is_outside(const oc_params *params, const range *range) {
    double value;
    (void)memcpy(&value, (const char *)params + range->place, sizeof value);
    return !(value >= range->low && value <= range->high); /* NaN is out, too */
}

const char *oc_params_check(const oc_params *p) {
    for (size_t k = 0; k < sizeof ranges / sizeof ranges[0]; ++k) {
        if (is_outside(p, &ranges[k])) {
            return ranges[k].name;
        }
    }
    if (p->delay_band_hz > 0.99 * p->cutoff_hz) {
        return "delay_band_hz";
    }
    if (p->understeer_acceleration_max_m_s2 < p->understeer_acceleration_min_m_s2) {
        return "understeer_acceleration_max_m_s2";
    }
    if ((uint32_t)p->method >= OC_METHOD_COUNT) {
        return "method";
    }
    if ((uint32_t)p->angle_method >= OC_ANGLE_METHOD_COUNT) {
        return "angle_method";
    }
    return p->use_accelerometer == 0 || p->use_accelerometer == 1 ? NULL : "use_accelerometer";
}

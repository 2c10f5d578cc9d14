#include "params.h"

#include <stddef.h>

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

typedef struct {
    const char *name;
    double value, low, high;
} range;

const char *oc_params_check(const oc_params *p) {
    const range ranges[] = {
        {"cutoff_hz", p->cutoff_hz, 1.0, 50.0},
        {"delay_band_hz", p->delay_band_hz, 0.1, 0.99 * p->cutoff_hz},
        {"speed_slope_window_s", p->speed_slope_window_s, 0.2, 5.0},
        {"gap_max_s", p->gap_max_s, 0.01, 1.0},
        {"speed_min_m_s", p->speed_min_m_s, 1.0, 40.0},
        {"curvature_max_1_m", p->curvature_max_1_m, 1e-5, 0.1},
        {"longitudinal_acceleration_max_m_s2", p->longitudinal_acceleration_max_m_s2, 0.01, 10.0},
        {"bank_max_m_s2", p->bank_max_m_s2, 0.01, 10.0},
        {"clean_time_s", p->clean_time_s, 0.1, 20.0},
        {"batch_s", p->batch_s, 0.1, 600.0},
        {"offset_evidence_min_s", p->offset_evidence_min_s, 0.0, 1e5},
        {"offset_half_width_max_rad", p->offset_half_width_max_rad, 1e-4, 1.0},
        {"yaw_rate_bias_sd_rad_s", p->yaw_rate_bias_sd_rad_s, 0.0, 0.1},
        {"understeer_acceleration_min_m_s2", p->understeer_acceleration_min_m_s2, 0.01, 5.0},
        {"understeer_acceleration_max_m_s2", p->understeer_acceleration_max_m_s2, p->understeer_acceleration_min_m_s2,
         10.0},
        {"understeer_evidence_min_s", p->understeer_evidence_min_s, 0.0, 1e5},
        {"understeer_half_width_max_rad_m_s2", p->understeer_half_width_max_rad_m_s2, 1e-6, 1.0},
        {"understeer_sd_rad_m_s2", p->understeer_sd_rad_m_s2, 0.0, 1.0},
        {"joint_speed_min_m_s", p->joint_speed_min_m_s, 1.0, 40.0},
        {"joint_curvature_max_1_m", p->joint_curvature_max_1_m, 1e-4, 0.1},
        {"joint_lateral_acceleration_max_m_s2", p->joint_lateral_acceleration_max_m_s2, 0.1, 5.0},
        {"joint_longitudinal_acceleration_max_m_s2", p->joint_longitudinal_acceleration_max_m_s2, 0.01, 10.0},
        {"joint_bank_change_max_m_s2", p->joint_bank_change_max_m_s2, 0.05, 10.0},
        {"joint_memory_s", p->joint_memory_s, 100.0, 1e5},
        {"joint_evidence_min_s", p->joint_evidence_min_s, 5.0, 1e5},
        {"accelerometer_bias_sd_m_s2", p->accelerometer_bias_sd_m_s2, 0.001, 10.0},
        {"pull_sd_m_s2", p->pull_sd_m_s2, 0.0, 10.0},
        {"wind_sd_m_s2", p->wind_sd_m_s2, 0.0, 10.0},
        {"crown_m_s2", p->crown_m_s2, 0.0, 2.0},
        {"crown_sd_m_s2", p->crown_sd_m_s2, 0.001, 10.0},
        {"standing_crown_share_1", p->standing_crown_share_1, 0.0, 1.0},
        {"standing_slope_sd_m_s2", p->standing_slope_sd_m_s2, 0.001, 10.0},
        {"standstill_speed_max_m_s", p->standstill_speed_max_m_s, 0.0, 1.0},
        {"standstill_settling_s", p->standstill_settling_s, 0.0, 60.0},
        {"standstill_time_min_s", p->standstill_time_min_s, 0.1, 600.0},
        {"gyro_bias_sd_rad_s", p->gyro_bias_sd_rad_s, 1e-4, 1.0},
        {"gyro_bias_ignition_sd_rad_s", p->gyro_bias_ignition_sd_rad_s, 0.0, 1.0},
        {"gyro_bias_wander_sd_rad_s", p->gyro_bias_wander_sd_rad_s, 0.0, 0.1},
        {"gyro_bias_drift_first_sd_rad_s2", p->gyro_bias_drift_first_sd_rad_s2, 0.0, 0.01},
        {"gyro_bias_drift_sd_rad_s2", p->gyro_bias_drift_sd_rad_s2, 0.0, 0.01},
        {"gyro_bias_drift_standing_sd_rad_s2", p->gyro_bias_drift_standing_sd_rad_s2, 0.0, 0.01},
        {"gyro_bias_drift_time_s", p->gyro_bias_drift_time_s, 1.0, 1e5},
        {"gyro_bias_half_width_max_rad_s", p->gyro_bias_half_width_max_rad_s, 1e-5, 1.0},
        {"wheel_radius_mismatch_sd_1", p->wheel_radius_mismatch_sd_1, 0.0, 0.1},
        {"wheel_radius_wander_sd_1", p->wheel_radius_wander_sd_1, 0.0, 0.01},
        {"wheel_radius_load_sd_s2_m", p->wheel_radius_load_sd_s2_m, 0.0, 0.1},
        {"net_turn_sd_rad", p->net_turn_sd_rad, 0.1, 1e4},
        {"bank_sd_m_s2", p->bank_sd_m_s2, 0.0, 10.0},
        {"track_width_sd_1", p->track_width_sd_1, 0.0, 0.2},
        {"method", (double)p->method, 0.0, OC_METHOD_COUNT - 1},
        {"angle_method", (double)p->angle_method, 0.0, OC_ANGLE_METHOD_COUNT - 1},
        {"use_accelerometer", (double)p->use_accelerometer, 0.0, 1.0},
    };
    for (size_t k = 0; k < sizeof ranges / sizeof ranges[0]; ++k) {
        if (!(ranges[k].value >= ranges[k].low && ranges[k].value <= ranges[k].high)) { /* NaN is out, too */
            return ranges[k].name;
        }
    }
    return NULL;
}

#ifndef OC_PARAMS_H
#define OC_PARAMS_H
/* What an engineer tunes, free of the sample rate. Defaults: oc_params_defaults, the only place that holds them.
 * Every name ends in its unit; the text behind says what it means, what small and large do, and whence the default. */

#include <stdint.h>

typedef struct {
    /* preprocess */
    double cutoff_hz;             /* low-pass of all signals but the angle; small is smoother and later. 3, 5.1.1 */
    double delay_band_hz;         /* the angle's delay is the filters' mean group delay from 0 to here. 2, 5.1.1 */
    double speed_slope_window_s;  /* smoothing of dv/dt; large is calmer and later. 1, ours */
    double gap_max_s;             /* a longer hole restarts the filters. 0.1, ours */
    /* the gate */
    double speed_min_m_s;                     /* below it (10) and the column's torsion are poor. 10, 5.1 */
    double curvature_max_1_m;                 /* R_max^-1 of (34); large lets bends in. 1/800, Table 4 */
    double longitudinal_acceleration_max_m_s2; /* of (34); large lets brake pull and torque steer in. 0.3, Table 4 */
    double bank_max_m_s2;                     /* a_y,max of (35); large lets banked roads in. 0.3, Table 4 */
    double clean_time_s;                      /* t1: how long after a tick all must be clean. 2, Table 4 */
    /* offset (36), (37) */
    double batch_s;                    /* evidence a batch mean spans; must outlast the residual's memory. 5, ours */
    double offset_evidence_min_s;      /* 20, 5.5.1's 300 m at 15 m/s */
    double offset_half_width_max_rad;  /* a wider 95 % interval is not valid. 1.5 deg, contract */
    double yaw_rate_bias_sd_rad_s;     /* prior where no standstill tells. 0.1 deg/s, half of 5.3.1's 0.2 */
    /* understeer (38) */
    double understeer_acceleration_min_m_s2;  /* below it (38) divides by next to nothing. 0.3, ours */
    double understeer_acceleration_max_m_s2;  /* above it tyres and axles bend the line. 1.5, 5.1.3 */
    double understeer_evidence_min_s;         /* K_us stays zero below it. 10, ours */
    double understeer_half_width_max_rad_m_s2; /* a wider 95 % interval is not valid. 0.2 deg/(m/s^2), ours */
    double understeer_sd_rad_m_s2;            /* prior while K_us is taken as zero. 0.4 deg/(m/s^2), 4.2's truck */
    /* standstill */
    double standstill_speed_max_m_s; /* slower is standing. 0.1, ours */
    double standstill_settling_s;    /* what is left out after stopping, until the cab is still. 0.2, ours */
    double standstill_time_min_s;    /* shorter tells nothing. 0.5, ours */
    /* whether the accelerometer is used at all (5.3.2, 5.5.3): 1, or 0 for r*v alone and no bank limit */
    int32_t use_accelerometer;
} oc_params;

void oc_params_defaults(oc_params *params);

/* The name of the first parameter out of its range, or NULL. */
const char *oc_params_check(const oc_params *params);

#endif

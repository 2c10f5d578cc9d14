#include "monitor.h"

#include <math.h>

#include "bounds.h"
#include "joint_model.h"

/* Derived. */
static const double one_piece_hz = 50.0; /* minimum rate at which a second has a tick for each of its 30 pieces */

/* Numerical. */
/* Minimum standard deviations: single precision would lose sums beside larger information. */
static const float play_sd_min = 1e-3f;      /* rad */
static const float gradient_sd_min = 1e-4f;  /* rad/(m/s^2) */
static const float wheelbase_sd_min = 1e-3f; /* share */

/* Tuned, in tuned.toml: setup */
static const double yaw_lag_s = 0.04; /* s: lag of the yaw rate behind the wheel */
static const float unknown_sd_min = 0.1f; /* sd from which the prior of i L is that of an unknown truck, as a share */
/* probability of a pull or a wind of hypothesis_equations.wide_pull times its sd */
static const float pull_tail = 0.1f;
/* end */

static bool is_between(double value, float low, float high) {
    const float rounded = (float)value;
    return rounded >= low && rounded <= high; /* NaN is not */
}

static bool is_track(double track) {
    return track == 0.0 || is_between(track, 1.0f, 3.0f);
}

static bool is_ratio(const oc_ratio *ratio) {
    if (ratio->terms < 0 || ratio->terms > OC_RATIO_TERMS_MAX) {
        return false;
    }
    for (int32_t k = 0; k < ratio->terms; ++k) {
        if (!is_between(ratio->coefficients[k], -1e6f, 1e6f)) {
            return false;
        }
    }
    return true;
}

const char *oc_vehicle_check(const oc_vehicle *vehicle) {
    if (!is_between(vehicle->wheelbase, 1.0f, 20.0f)) {
        return "wheelbase";
    }
    if (!is_between(vehicle->steering_ratio, 1.0f, 60.0f)) {
        return "steering_ratio";
    }
    if (!is_between(vehicle->traffic_side, -1.0f, 1.0f)) {
        return "traffic_side";
    }
    if (!is_ratio(&vehicle->ratio)) {
        return "ratio";
    }
    if (!is_track(vehicle->track_width_front)) {
        return "track_width_front";
    }
    if (!is_track(vehicle->track_width_rear)) {
        return "track_width_rear";
    }
    return NULL;
}

/* Whether the vehicle has the track widths that these methods need. */
static bool has_tracks_for(const oc_params *params, double track, double track_front) {
    const bool turns_by_wheels = params->method == OC_METHOD_WHEEL_SPEED;
    const bool steers_by_wheels =
        params->angle_method == OC_ANGLE_WHEEL_SPEED || params->angle_method == OC_ANGLE_WHEEL_SPEED_EXACT;
    return (!turns_by_wheels || track > 0.0) && (!steers_by_wheels || track_front > 0.0);
}

static int32_t rounded_up(double positive) {
    const int32_t whole = (int32_t)positive;
    return whole + (whole < positive ? 1 : 0);
}

static oc_term_information information_of(double mean, double sd, float sd_min, float scale) {
    const float accuracy = scale / oc_max((float)sd, sd_min);
    return (oc_term_information){accuracy * accuracy, accuracy * accuracy * (float)mean / scale};
}

/* Share by which i L of an unknown truck may differ from the vehicle's; 0 where a vehicle file or a memory has it. */
static float product_doubt_of(const oc_params *p) {
    const float sd = (float)p->known_wheelbase_share_sd_1;
    return sd > unknown_sd_min ? 2.0f * sd : 0.0f;
}

/* The given values of the truck replace the model's priors. */
static void set_given_values(oc_hypothesis_design *design, const oc_params *p) {
    oc_known_truck *known = &design->known;
    known->set_up_probability = (float)p->set_up_probability_1;
    known->set_up_sign = 1.0f;
    known->pull_tail = pull_tail;
    if (p->known_play_sd_rad > 0.0) {
        const float sd = oc_max((float)p->known_play_sd_rad, play_sd_min);
        known->play = (float)p->known_play_rad;
        known->play_accuracy = 1.0f / sd;
        known->width_sd = oc_min(known->width_sd, sd);
    }
    if (p->known_understeer_gradient_sd_rad_m_s2 > 0.0) {
        known->gradient =
            information_of(p->known_understeer_gradient_rad_m_s2, p->known_understeer_gradient_sd_rad_m_s2,
                           gradient_sd_min, design->scale[GRADIENT]);
    }
    if (p->known_wheelbase_share_sd_1 > 0.0) {
        known->wheelbase = information_of(p->known_wheelbase_share_1, p->known_wheelbase_share_sd_1, wheelbase_sd_min,
                                          design->scale[WHEELBASE]);
        known->product_doubt = product_doubt_of(p);
    }
    if (p->known_pull_sd_m_s2 > 0.0) {
        known->pull = (float)p->known_pull_m_s2;
        const bool is_set_up = p->set_up_probability_1 > 0.5; /* by the vehicle file: the pull is the crown */
        known->pull_tail = 0.0f;
        known->set_up_sign = -1.0f;
        known->set_up_probability = is_set_up ? 1.0f - (float)p->set_up_probability_1 : 0.0f;
    }
}

static int32_t wheel_axle_of(const oc_vehicle *vehicle) {
    return vehicle->track_width_rear > 0.0 ? OC_AXLE_REAR : OC_AXLE_FRONT;
}

static double track_of(const oc_vehicle *vehicle) {
    return wheel_axle_of(vehicle) == OC_AXLE_REAR ? vehicle->track_width_rear : vehicle->track_width_front;
}

static oc_error check_setup(const oc_vehicle *vehicle, const oc_params *params, double rate_hz) {
    if (vehicle == NULL || params == NULL) {
        return OC_ERROR_NULL;
    }
    if (oc_vehicle_check(vehicle) != NULL) {
        return OC_ERROR_VEHICLE;
    }
    if (!oc_params_are_sound(params)) {
        return OC_ERROR_PARAMS;
    }
    const bool is_in_range = rate_hz >= (double)OC_RATE_MIN_HZ && rate_hz <= (double)OC_RATE_MAX_HZ;
    if (!is_in_range || !(params->cutoff_hz < 0.45 * rate_hz)) {
        return OC_ERROR_RATE;
    }
    const bool has_tracks = has_tracks_for(params, track_of(vehicle), vehicle->track_width_front);
    return has_tracks ? OC_OK : OC_ERROR_VEHICLE;
}

/* Sets the valid bits that a tick must have: of the angle, of the method, of the angle method. */
static void set_needed_signals(oc_coefficients *c) {
    const oc_params *p = &c->params;
    const uint32_t moves = OC_HAS_YAW_RATE | OC_HAS_VEHICLE_SPEED;
    const uint32_t front = OC_HAS_WHEEL_SPEED_FRONT_LEFT | OC_HAS_WHEEL_SPEED_FRONT_RIGHT;
    const uint32_t rear = OC_HAS_WHEEL_SPEED_REAR_LEFT | OC_HAS_WHEEL_SPEED_REAR_RIGHT;
    const bool by_torque = p->method == OC_METHOD_JOINT && p->torque_for_accelerometer_1 > 0.5;
    const uint32_t force = p->use_accelerometer ? (uint32_t)OC_HAS_LATERAL_ACCELERATION
                           : by_torque          ? (uint32_t)OC_HAS_STEERING_WHEEL_TORQUE
                                                : 0u;
    const uint32_t by_wheels = c->wheel_axle == OC_AXLE_REAR ? rear : front;
    const bool observes_wheels =
        p->angle_method == OC_ANGLE_WHEEL_SPEED || p->angle_method == OC_ANGLE_WHEEL_SPEED_EXACT;
    const uint32_t steered = OC_HAS_STEERING_WHEEL_ANGLE |
                             (c->ratio_times_rear_weight > 0.0 ? (uint32_t)OC_HAS_REAR_AXLE_ANGLE : 0u);
    c->steered = (int32_t)steered;
    c->needed = (int32_t)(steered | (p->method == OC_METHOD_WHEEL_SPEED ? by_wheels : moves | force));
    c->observed = (int32_t)(moves | (observes_wheels ? front : 0u) |
                            (p->angle_method == OC_ANGLE_SIDE_SLIP ? (uint32_t)OC_HAS_LATERAL_SPEED : 0u));
}

oc_error oc_setup(oc_coefficients *coefficients, const oc_vehicle *vehicle, const oc_params *params, double rate_hz) {
    if (coefficients == NULL) {
        return OC_ERROR_NULL;
    }
    const oc_error error = check_setup(vehicle, params, rate_hz);
    if (error != OC_OK) {
        coefficients->rate_hz = 0.0; /* refuses ticks */
        return error;
    }
    const double track = track_of(vehicle);
    const double clean_ticks = params->clean_time_s * rate_hz;
    oc_coefficients *c = coefficients; /* in place, to save stack */
    c->vehicle = *vehicle;
    c->params = *params;
    c->rate_hz = rate_hz;
    c->tick_s = 1.0 / rate_hz;
    c->ratio_times_wheelbase = vehicle->steering_ratio * vehicle->wheelbase;
    c->ratio_times_rear_weight = vehicle->steering_ratio * params->rear_axle_weight_1;
    c->ticks_per_batch = params->batch_s * rate_hz;
    c->wheel_axle = wheel_axle_of(vehicle);
    set_needed_signals(c);
    c->offset_per_mismatch = track > 0.0 ? vehicle->steering_ratio * vehicle->wheelbase / track : 0.0;
    c->ticks_until_new_clock = (int32_t)rate_hz; /* a second in order */
    c->pieces_per_tick = rounded_up(one_piece_hz / rate_hz);
    /* upward, which bounds the number of blocks */
    c->ticks_per_block = rounded_up(clean_ticks / (double)OC_BLOCKS_PER_CLEAN_TIME);
    c->blocks_until_final = rounded_up(clean_ticks / c->ticks_per_block);
    oc_preprocess_design(&c->preprocess, params->cutoff_hz, params->delay_band_hz, params->speed_slope_window_s,
                         params->method == OC_METHOD_JOINT ? yaw_lag_s : 0.0, rate_hz);
    oc_assignment_setup(&c->assignment, c->ratio_times_wheelbase, product_doubt_of(params), vehicle->track_width_rear,
                        rate_hz);
    oc_gyro_bias_setup(&c->gyro_bias, vehicle, params, rate_hz);
    const bool has_accelerometer = params->use_accelerometer != 0;
    const bool by_torque = params->torque_for_accelerometer_1 > 0.5;
    const bool measures_bank = has_accelerometer || by_torque || params->method != OC_METHOD_JOINT;
    oc_torque_setup(&c->torque, params->torque_slope_n_m_m_s2, params->torque_zero_sd_n_m, rate_hz,
                    params->joint_speed_min_m_s, params->accelerometer_bias_sd_m_s2, has_accelerometer);
    const bool has_known_pull = params->known_pull_sd_m_s2 > 0.0;
    const float pull = (float)(has_known_pull ? params->known_pull_sd_m_s2 : params->pull_sd_m_s2);
    const float wind = (float)params->wind_sd_m_s2;
    const float bank = measures_bank ? 0.0f : (float)params->crown_sd_m_s2;
    const float shifts = pull * pull + wind * wind + bank * bank;
    oc_joint_setup(&c->joint, &c->preprocess.lowpass, rate_hz, vehicle->steering_ratio, c->ratio_times_wheelbase,
                   sqrtf(shifts), measures_bank, params->joint_memory_s);
    set_given_values(&c->joint.hypothesis, params);
    c->joint.unmeasured_bank = measures_bank ? 0.0f : (float)params->bank_sd_m_s2;
    c->joint.alignment_share = shifts > 0.0f ? pull * pull / shifts : 0.0f;
    c->joint.wind_share = shifts > 0.0f ? wind * wind / shifts : 0.0f;
    const float wander = (float)params->accelerometer_wander_sd_m_s2;
    c->joint.hypothesis.wander = wander * wander / 60.0f;
    c->joint.tandem = (float)params->tandem_side_force_m2_s2;
    oc_ratio ratio = vehicle->ratio;
    ratio.ratio = vehicle->steering_ratio;
    oc_angle_setup(&c->angle, params->angle_method, &ratio, vehicle->wheelbase, rate_hz);
    c->angle.pull = c->joint.hypothesis.known.pull / c->joint.tyre_share;
    return OC_OK;
}

#include "angle.h"

#include <math.h>

#include "bounds.h"

/* Derived. */
static const float half_turn = 3.14159265358979323846f; /* pi */

/* Numerical. */
static const float yaw_rate_max = 10.0f; /* rad/s, as signals.c: a corrected rate, and the filter's, may exceed it */
static const float never_s = 1e9f;          /* longer than any time without a sensor */
static const float angle_sd_max = 10.0f;    /* rad, against unbounded growth at standstill */
static const float swing_min = 1e-12f;      /* (rad/s^2)^2, against 0/0 */

/* Tuned, in tuned.toml: angle */
static const float first_pole_hz = 5.0f; /* Hz: first pole of the filter of the yaw rate; drivers steer below 2 Hz */
static const float pair_hz = 3.8f; /* Hz: pair of poles of this filter */
static const float pair_damping = 0.65f; /* damping of this pair; less delay at the same noise than without ringing */
/* s: time constant of a_y - r v, part of the lateral force that the yaw rate lacks */
static const float bank_s = 0.05f;
static const float check_s = 0.05f; /* s: period of the place in the play, of learning and of the sensor check */
static const float moved_min = 0.7f * 0.017453292f; /* rad: movement of the wheels that is not noise */
static const float moved_clear = 2.0f * 0.017453292f; /* rad: movement by which the driver clearly pushes the wheels */
static const float near_friction = 0.1f; /* m/s^2: lateral force beyond friction that may be unmeasured wind and bank */
static const float place_variance_max = 0.7f; /* variance of an unknown place in the play, -1 to 1 */
static const float error_sd = 0.6f * 3.14159265358979323846f / 180.0f; /* rad: sd of the slow error at speed */
static const float error_speed = 1.5f; /* m/s: speed below which this error grows, as 1 + error_speed / v */
static const float lead_sd_s = 0.07f; /* s: sd of the delay that the prediction leaves, times the steering rate */
static const float yaw_acceleration_sd_s = 0.3f; /* s: sd of T, times the yaw acceleration */
/* s: memory of the peaks of the yaw acceleration, that separates steering from noise */
static const float swing_s = 0.7f;
/* squared yaw acceleration, in variances of its noise, at which half of it counts */
static const float swing_noises = 4.0f;
/* s: sd of the time until a new movement of the driver shows, times the activity */
static const float onset_sd_s = 0.11f;
static const float activity_s = 3.0f; /* s: memory of the driver's mean steering rate */
/* (rad/s)^2: variance of the gyro in a second's mean, where it is not identified: below 80 Hz, without accelerometer */
static const float usual_noise = 3.3e-08f;
/* rad/s^2: yaw acceleration of a hard turn, in which half of the prediction counts */
static const float hard_turn = 0.85f;
static const float slope_lead_s = 0.045f; /* s: prediction of the yaw acceleration by its slope */
static const float load_lead_s = 0.2f; /* s: prediction of the lateral force that carries the wheels through the play */
static const float clear_noises = 12.0f; /* as swing_noises, of steering that is clearly the driver's */
static const float T_prior_s = 1.3f; /* s: prior of T, steering wheel angle per yaw acceleration */
static const float T_prior_steady_s = 6.0f; /* s: steering wheel angle per yaw rate at which T_prior_s holds */
static const float T_prior_s2 = 0.05f; /* rad^2/s^3: sum of squared yaw acceleration with the prior's weight */
static const float drift_s = 300.0f; /* s: time until a random walk counts as a drift: variance t (1 + t/300) */
static const float load_share_sd = 0.1f; /* sd of K over K after the loss of the sensor, by fuel and tyres */
static const float learning_memory_s = 600.0f; /* s: memory of T, of the error's scale and of the side slip's terms */
static const float unbanked_share = 0.3f; /* sd of K over K while the accelerometer is lost */
static const float flattened_max = 0.3f; /* maximum error over the estimate for learning the cube */
static const float flattening_sd = 0.5f; /* 1/rad^2: prior sd of the cube's share; the arctangent alone is 1/3 */
static const float flattening_prior = 0.0001f; /* rad^6 s: sum of squared cubes with the prior's weight */
static const float hand_rate_sd = 1.5f; /* rad/s: rate at which the sd of a held angle grows */
/* m/s: minimum speed at which the estimate is compared with the sensor, to learn T and the error's scale and to judge
 * the sensor */
static const float learning_speed = 8.0f;
static const float valid_sd = 5.0f * 3.14159265358979323846f / 180.0f; /* rad: maximum sd of a valid estimated angle */
/* end */

void oc_angle_setup(oc_angle_design *design, oc_angle_method method, const oc_ratio *ratio, double wheelbase,
                    double rate_hz) {
    const float tick_s = 1.0f / (float)rate_hz;
    const float w = 2.0f * half_turn * pair_hz;
    const float first = 2.0f * half_turn * first_pole_hz * tick_s;
    const float damping = 2.0f * pair_damping * w;
    const float acceleration_keep = 1.0f / (1.0f + damping * tick_s); /* implicit in the damping: stable at 20 Hz */
    const float lag = 1.0f / (2.0f * half_turn * first_pole_hz), slope = damping + w * w * lag;
    const int32_t ticks_per_check = (int32_t)(check_s / tick_s + 0.5f);
    *design = (oc_angle_design){
        .method = method,
        .ratio = *ratio,
        .wheelbase = (float)wheelbase,
        .yaw_rate_share = first / (1.0f + first),
        .acceleration_keep = acceleration_keep,
        .acceleration_share = acceleration_keep * w * w * tick_s,
        .bank_share = tick_s / (bank_s + tick_s),
        .rate_share = tick_s / (2.0f * check_s + tick_s),
        .takeover_share = tick_s / (1.0f + tick_s),
        .acceleration_noise = w * w * w * w / (2.0f * (slope * (1.0f + damping * lag) - w * w * lag)),
        .swing_keep = 1.0f - tick_s / swing_s,
        .activity_share = tick_s * (float)ticks_per_check / activity_s,
        .delay_s = method == OC_ANGLE_OBSERVER ? 2.0f * pair_damping / w + (1.0f + first) * tick_s / first : 0.0f,
        .tick_s = tick_s,
        .per_tick = (float)rate_hz,
        .slope_ticks = slope_lead_s * (float)rate_hz,
        .steering_ratio = (float)ratio->ratio,
        .per_ratio = 1.0f / (float)ratio->ratio,
        .check_s = tick_s * (float)ticks_per_check,
        .ticks_per_check = ticks_per_check,
    };
}

double oc_angle_rate_s(void) {
    return (double)(2.0f * check_s);
}

static float limited_yaw_rate(float yaw_rate) {
    return oc_clamp_size(yaw_rate, yaw_rate_max);
}

static void begin_observer(oc_angle_tracking *t, const oc_angle_tick *tick) {
    *t = (oc_angle_tracking){
        .running = 1,
        .yaw_rate_first = limited_yaw_rate(tick->yaw_rate),
        .yaw_rate = limited_yaw_rate(tick->yaw_rate),
        .speed = tick->speed,
        .bank = tick->lateral_acceleration - tick->yaw_rate * tick->speed,
        .place_variance = place_variance_max,
        .lead = T_prior_s,
        .without_sensor_s = never_s,
    };
}

/* The share of the prediction that the gyro's noise leaves: 1 where the yaw acceleration, or its recent peak, is far
 * beyond it. In hard turns the prediction would overshoot. */
static void follow_swing(oc_angle_tracking *t, const oc_angle_design *d, float before) {
    const float square = t->yaw_acceleration * t->yaw_acceleration;
    const float kept = t->swing * d->swing_keep;
    t->swing = square > kept ? square : kept;
    t->steered = t->swing / (t->swing + swing_noises * t->noise + swing_min);
    const float per_hard_turn = 1.0f / (hard_turn * hard_turn);
    const float hard = t->swing * per_hard_turn;
    const float ahead = d->slope_ticks * (t->yaw_acceleration - before);
    t->share = t->steered / (1.0f + hard * hard);
    t->predicted = t->share * (t->yaw_acceleration + t->steered * t->steered * ahead);
}

void oc_angle_filter(oc_angle_tracking *t, const oc_angle_design *d, const oc_angle_tick *tick) {
    if (!t->running || !tick->has_motion) {
        return;
    }
    t->speed = tick->speed;
    t->yaw_rate_first += (limited_yaw_rate(tick->yaw_rate) - t->yaw_rate_first) * d->yaw_rate_share;
    const float before = t->yaw_acceleration;
    t->yaw_acceleration = d->acceleration_keep * before + d->acceleration_share * (t->yaw_rate_first - t->yaw_rate);
    t->yaw_rate = limited_yaw_rate(t->yaw_rate + t->yaw_acceleration * d->tick_s);
    follow_swing(t, d, before);
    t->bank += (tick->lateral_acceleration - t->yaw_rate * t->speed - t->bank) * d->bank_share;
}

/* (m/s^2)^2, of the accelerometer's zero since the loss of the sensor. First it is a random walk, later a drift, whose
 * variance grows faster. */
static float zero_walk_variance(const oc_angle_tracking *t, const oc_angle_truck *truck) {
    const float lost_s = t->without_sensor_s;
    return lost_s < never_s ? truck->wander * lost_s * (1.0f + lost_s / drift_s) : 0.0f;
}

/* Without an accelerometer neither the bank of a bend nor all of the lateral force is identifiable. */
static float neutral_sd_of(const oc_angle_tracking *t, const oc_angle_truck *truck, const oc_angle_tick *tick) {
    const float sd = sqrtf(truck->unloading_sd * truck->unloading_sd + zero_walk_variance(t, truck));
    return tick->accelerometer_lost ? sd + tick->bank_sd : sd;
}

static float gradient_sd_of(const oc_angle_truck *truck, const oc_angle_tick *tick) {
    return tick->accelerometer_lost ? truck->gradient_sd + unbanked_share * fabsf(truck->gradient) : truck->gradient_sd;
}

/* Estimates the steering wheel's place in the play by the front wheels' motion and the lateral force. */
static void follow_play(oc_angle_tracking *t, const oc_angle_design *d, const oc_angle_truck *truck, float wheels,
                          float load, float unloading_sd) {
    const float half = 0.5f * truck->backlash;
    const float beyond = fabsf(load) - truck->friction;
    const float moved = wheels - t->reference;
    const float excess = oc_clamp_size(moved, moved_min) - moved; /* negated */
    t->reference -= excess;
    float push = 0.0f;
    if (beyond <= 0.0f || -excess * load > 0.0f) {
        push -= excess / moved_clear;
    }
    if (beyond > 0.0f) {
        const float crept = 2.0f * truck->creep * beyond * d->check_s / (half > 1e-3f ? half : 1e-3f);
        push += load > 0.0f ? crept : -crept;
    }
    float place = t->place + push;
    t->place_variance -= t->place_variance * oc_min(fabsf(push), 1.0f);
    const float share = 2.0f * d->check_s; /* half a second */
    if (beyond < near_friction) {
        place -= place * share;
    }
    if (beyond < near_friction + unloading_sd) {
        t->place_variance += (place_variance_max - t->place_variance) * share;
    }
    t->place_step = (oc_clamp_size(place, 1.0f) - t->place) / (float)d->ticks_per_check;
}

/* s, steering wheel angle over yaw rate in steady state. */
static float per_yaw_rate(const oc_angle_tracking *t, const oc_angle_design *d, const oc_angle_truck *truck) {
    const float v = fabsf(t->speed);
    const float by_geometry = d->wheelbase / v; /* a part of it remains beyond the critical speed of oversteer */
    return d->steering_ratio * oc_max(by_geometry + truck->gradient * v, 0.1f * by_geometry);
}

/* T at this speed: it includes the filter's delay times the angle per yaw rate of (10). */
static float lead_at(const oc_angle_evidence *e, const oc_angle_design *d, float per_rate) {
    const float per_slope = 1.0f / (e->slopes + T_prior_s2);
    const float lead = (e->products + T_prior_s2 * T_prior_s) * per_slope;
    const float usual = (e->steady + T_prior_s2 * T_prior_steady_s) * per_slope;
    const float T = lead + d->delay_s * (per_rate - usual);
    return T > 0.0f ? T : 0.0f;
}

/* 1/rad^2, reduction of the front wheels' angle over its cube. */
static float flattening(const oc_angle_evidence *e) {
    return e->flattened / (e->cubes + flattening_prior);
}

static void learn_flattening(oc_angle_evidence *e, const oc_angle_tracking *t, const oc_angle_design *d,
                             float error) {
    if (fabsf(error) < flattened_max * fabsf(t->estimate)) {
        const float left = flattening(e) * t->cube - error * d->per_ratio;
        e->flattened += left * t->cube * d->check_s;
        e->cubes += t->cube * t->cube * d->check_s;
    }
}

static oc_side_slip side_slip_of(const oc_angle_tracking *t, const oc_angle_tick *tick) {
    return (oc_side_slip){
        .speed = t->speed,
        .lateral_speed = tick->lateral_speed,
        .yaw_rate = tick->yaw_rate,
        .lateral_acceleration = tick->yaw_rate * t->speed,
    };
}

static float to_steering_wheel(const oc_angle_design *d, float front_wheel) {
    return d->ratio.terms == 0 ? d->steering_ratio * front_wheel
                               : (float)oc_ratio_to_steering_wheel(&d->ratio, (double)front_wheel);
}

/* (23) */
static float wheels_by_side_slip(const oc_angle_tracking *t, const oc_angle_evidence *e, const oc_angle_design *d,
                                  const oc_angle_tick *tick) {
    const oc_side_slip slip = side_slip_of(t, tick);
    return to_steering_wheel(d, (float)oc_side_slip_front_wheel(&e->side_slip, &slip, (double)d->wheelbase));
}

/* rad, the steering wheel angle for this motion, by (13). */
static float wheels_of(oc_angle_tracking *t, const oc_angle_evidence *e, const oc_angle_design *d,
                       const oc_angle_truck *truck, const oc_angle_tick *tick) {
    const float a = t->yaw_rate * t->speed + t->bank;
    const float v = t->speed;
    switch (d->method) {
    case OC_ANGLE_SIDE_SLIP:
        return wheels_by_side_slip(t, e, d, tick);
    case OC_ANGLE_WHEEL_SPEED:
    case OC_ANGLE_WHEEL_SPEED_EXACT:
        return to_steering_wheel(d, tick->front_wheel);
    case OC_ANGLE_YAW_RATE:
        return to_steering_wheel(d, oc_front_wheel_by_yaw_rate(d->wheelbase, tick->yaw_rate, v, 0.0f, 0.0f));
    case OC_ANGLE_YAW_RATE_UNDERSTEER:
        return to_steering_wheel(d, oc_front_wheel_by_yaw_rate(d->wheelbase, tick->yaw_rate, v, truck->gradient,
                                                               tick->yaw_rate * v));
    default:
        break;
    }
    const float steady = oc_front_wheel_by_yaw_rate(d->wheelbase * (1.0f + truck->wheelbase), t->yaw_rate, v,
                                                    truck->gradient, a - truck->unloading + d->pull);
    t->cube = steady * steady * steady;
    const float lead = v < 0.0f ? -t->lead : t->lead; /* backward, the yaw rate follows the angle with the other sign */
    return to_steering_wheel(d, steady - t->flattening * t->cube + lead * d->per_ratio * t->predicted);
}

/* rad^2, of the observer's errors; a comparison with the sensor identifies their scale. */
static float observer_variance(const oc_angle_tracking *t, const oc_angle_truck *truck) {
    const float slow = error_sd * (1.0f + error_speed / fabsf(t->speed));
    const float half_play = 0.5f * truck->backlash;
    return slow * slow + half_play * half_play * t->place_variance;
}

/* rad^2, of the lag that is left: the recent peak of the yaw acceleration, times the sd of T and the delay's; and a
 * movement that has begun but does not show yet. */
static float lag_variance(const oc_angle_tracking *t, float per_rate) {
    const float late = lead_sd_s * per_rate, onset = onset_sd_s * t->activity;
    return t->swing * t->steered * t->steered * (late * late + yaw_acceleration_sd_s * yaw_acceleration_sd_s) +
           onset * onset;
}

/* rad^2, of the truck's parameters, and of errors that a comparison with the sensor cannot identify. */
static float truck_variance(const oc_angle_tracking *t, const oc_angle_evidence *e, const oc_angle_design *d,
                             const oc_angle_truck *truck, const oc_angle_tick *tick) {
    const float i = d->steering_ratio;
    const float a = t->yaw_rate * t->speed + t->bank - truck->unloading;
    const float loaded = load_share_sd * truck->gradient;
    const float gyro = i * d->wheelbase / t->speed * tick->yaw_rate_bias_sd;
    const float gradient_sd = gradient_sd_of(truck, tick);
    const float gradient = i * a * gradient_sd, load = i * a * loaded;
    const float flat = i * t->cube * flattening_sd;
    const float per_force = i * (fabsf(truck->gradient) + gradient_sd);
    const float banked = per_force * per_force * (tick->bank_sd * tick->bank_sd + zero_walk_variance(t, truck));
    return truck->offset_sd * truck->offset_sd + gyro * gyro + gradient * gradient + load * load + banked +
           flat * flat * flattening_prior / (flattening_prior + e->cubes);
}

/* Learns T and the scale of the estimate's errors by comparison with the sensor. */
static void learn_from_sensor(oc_angle_evidence *e, const oc_angle_tracking *t, const oc_angle_design *d,
                              float per_rate, float error, float without_T, float variance) {
    const float keep = 1.0f - d->check_s / learning_memory_s;
    if (t->place_variance < 0.1f) {
        const float squared = (t->yaw_acceleration * t->yaw_acceleration - t->noise) * d->check_s;
        e->slopes = oc_max(keep * e->slopes + squared, 0.0f);
        e->steady = oc_max(keep * e->steady + squared * per_rate, 0.0f);
        e->products = keep * e->products + t->yaw_acceleration * without_T * d->check_s;
    }
    e->seconds += d->check_s;
    const float share = d->check_s / oc_min(learning_memory_s, 1.0f + e->seconds);
    e->error_scale += (oc_min(error * error / variance, 25.0f) - e->error_scale) * share;
}

bool oc_angle_is_due(const oc_angle_tracking *t) {
    return t->ticks_to_check <= 0;
}

bool oc_angle_checks(const oc_angle_tracking *t) {
    return oc_angle_is_due(t) || t->held_s > 0.0f;
}

bool oc_angle_is_accurate(const oc_angle_tracking *t) {
    return fabsf(t->speed) > learning_speed;
}

static void learn_truck(const oc_angle_tracking *t, oc_angle_evidence *e, const oc_angle_design *d,
                        const oc_angle_tick *tick, float per_rate, float observer) {
    const float error = (float)tick->true_by_sensor - t->estimate;
    if (d->method == OC_ANGLE_OBSERVER) {
        learn_flattening(e, t, d, error);
    }
    if (oc_angle_is_accurate(t)) {
        learn_from_sensor(e, t, d, per_rate, error, error + t->lead * t->predicted,
                          observer + lag_variance(t, per_rate));
        if (d->method == OC_ANGLE_SIDE_SLIP) {
            const oc_side_slip slip = side_slip_of(t, tick);
            oc_side_slip_learn(&e->side_slip, &slip, oc_ratio_to_front_wheel(&d->ratio, tick->true_by_sensor),
                               (double)d->check_s, (double)learning_memory_s);
        }
    }
}

/* Share of the swing that is clearly the driver's. */
static float clearly_steered(const oc_angle_tracking *t) {
    const float share = t->swing / (t->swing + clear_noises * t->noise + swing_min);
    return share * share;
}

/* m/s^2, change of the lateral force over load_lead_s. */
static float load_ahead(const oc_angle_tracking *t, float clear) {
    return clear * clear * load_lead_s * t->speed * t->yaw_acceleration;
}

/* The slower part: place in the play, learning from the sensor, the estimate's sd. */
static void check(oc_angle_tracking *t, oc_angle_evidence *e, const oc_angle_design *d, const oc_angle_truck *truck,
                  const oc_angle_tick *tick, bool identified, float wheels) {
    const float per_rate = per_yaw_rate(t, d, truck);
    t->lead = identified ? lead_at(e, d, per_rate) : T_prior_s;
    t->lateness = d->method == OC_ANGLE_OBSERVER ? t->lead / per_rate : 0.0f;
    t->flattening = flattening(e);
    if (t->held_s > 0.0f || t->without_sensor_s >= never_s) {
        t->reference = wheels;
    }
    const float clear = clearly_steered(t);
    t->activity += (clear * per_rate * sqrtf(t->swing) - t->activity) * d->activity_share;
    const float load = t->yaw_rate * (t->speed + truck->tandem / fabsf(t->speed)) + t->bank - truck->unloading +
                       load_ahead(t, clear);
    follow_play(t, d, truck, wheels, load, neutral_sd_of(t, truck, tick));
    t->place_variance = tick->assisted ? place_variance_max : t->place_variance;
    const float observer = observer_variance(t, truck);
    if (tick->can_learn && identified) {
        learn_truck(t, e, d, tick, per_rate, observer);
    }
    const float error_scale = e->error_scale + 2.0f / (1.0f + e->seconds); /* the prior 2 counts as a second */
    t->sd = sqrtf(error_scale * observer + lag_variance(t, per_rate) + truck_variance(t, e, d, truck, tick) +
                  tick->braked_sd * tick->braked_sd);
}

/* rad, the front wheels' angle at the steering wheel, without the play. */
static float follow_wheels(oc_angle_tracking *t, const oc_angle_evidence *e, const oc_angle_design *d,
                           const oc_angle_truck *truck, const oc_angle_tick *tick) {
    const float wheels = wheels_of(t, e, d, truck, tick);
    const bool observes = d->method == OC_ANGLE_OBSERVER;
    t->place += t->place_step;
    t->estimate = observes ? wheels + 0.5f * truck->backlash * t->place : wheels;
    return wheels;
}

/* Below walking speed, 1 m/s, the angle is not observable: it is held, and its interval widens. */
static void hold(oc_angle_tracking *t, const oc_angle_design *d) {
    t->held_s += d->tick_s;
    t->place_variance = place_variance_max;
    t->place_step = 0.0f;
    t->sd = oc_min(t->sd + hand_rate_sd * d->tick_s, angle_sd_max);
}

/* When the sensor returns, the difference to the estimate fades, so that the angle does not jump. */
static void publish_measured(oc_angle_tracking *t, const oc_angle_design *d, const oc_angle_truck *learned,
                             double measured, oc_angle *out) {
    static const float faded = 1e-6f; /* rad */
    const bool came_back = t->without_sensor_s > 0.0f && t->without_sensor_s < never_s;
    const float left = t->step * (1.0f - d->takeover_share);
    t->step = came_back ? t->before - (float)measured : fabsf(left) > faded ? left : 0.0f;
    t->difference = (float)measured + t->step - t->estimate;
    t->without_sensor_s = 0.0f;
    const float offset_sd = learned->identified ? learned->offset_sd : valid_sd;
    out->angle = measured + (double)t->step;
    out->delay = 0.0;
    out->standard_deviation = (double)(t->step == 0.0f ? offset_sd : sqrtf(offset_sd * offset_sd + t->step * t->step));
    out->status = learned->identified ? OC_VALID : OC_CONVERGING;
}

/* When the sensor is lost, the difference to its last angle fades, so that the angle does not jump. */
static void publish_estimated(oc_angle_tracking *t, const oc_angle_design *d, bool identified, bool moves,
                              oc_angle *out) {
    t->difference -= t->difference * d->takeover_share;
    t->without_sensor_s += d->tick_s;
    out->angle = (double)(t->estimate + t->difference);
    out->standard_deviation = (double)t->sd;
    out->delay = (double)(t->lateness * (1.0f - t->share));
    out->status = !identified || !moves ? OC_UNOBSERVABLE : t->sd < valid_sd ? OC_VALID : OC_CONVERGING;
}

void oc_angle_update(oc_angle_tracking *t, oc_angle_evidence *e, const oc_angle_design *d,
                     const oc_angle_truck *learned, const oc_angle_tick *tick, oc_angle *out) {
    /* Before a sensor was available, over 64 tuning drives: intervals hold the truth at 94 % of the ticks (3ab1a79). */
    static const oc_angle_truck truck_prior = {
        .offset_sd = 2.5f * 3.14159265358979323846f / 180.0f,   /* rad, of alignment, and of play beyond the next */
        .gradient_sd = 0.8f * 3.14159265358979323846f / 180.0f, /* rad/(m/s^2), about 0 */
        .backlash = 4.0f * 3.14159265358979323846f / 180.0f,    /* rad */
        .friction = 1e9f,
    };
    const bool identified = learned->identified != 0;
    const oc_angle_truck *truck = identified ? learned : &truck_prior;
    if (!t->running && tick->has_motion) {
        begin_observer(t, tick);
    }
    const bool moves = tick->has_motion && fabsf(tick->speed) > 1.0f;
    const bool checks = oc_angle_checks(t);
    t->ticks_to_check = (oc_angle_is_due(t) ? d->ticks_per_check : t->ticks_to_check) - 1;
    if (moves) {
        const float wheels = follow_wheels(t, e, d, truck, tick);
        if (checks) {
            t->noise = d->acceleration_noise * (learned->yaw_rate_noise > 0.0f ? learned->yaw_rate_noise : usual_noise);
            check(t, e, d, truck, tick, identified, wheels);
        }
        t->held_s = 0.0f;
    } else {
        hold(t, d);
    }
    out->estimate = (double)t->estimate;
    out->estimate_sd = (double)t->sd;
    out->by_sensor = tick->has_sensor;
    if (tick->has_sensor) {
        publish_measured(t, d, learned, tick->true_by_sensor, out);
    } else {
        publish_estimated(t, d, identified, moves, out);
    }
    t->rate += (((float)out->angle - t->before) * d->per_tick - t->rate) * d->rate_share;
    t->before = (float)out->angle;
    out->rate = (double)t->rate;
}

#include "angle.h"

#include <math.h>

static const double half_turn = 3.14159265358979323846;

/* The filter: what a driver does is below some 2 Hz; more lets the gyro's noise in, less is late. */
static const double first_pole_hz = 4.0;
static const double pair_hz = 4.0;
static const double pair_damping = 0.8;
static const double speed_s = 0.1;
static const double bank_s = 0.15;    /* roads change slower, the accelerometer's noise faster */
static const double rate_s = 0.1;
static const double takeover_s = 1.0;

/* The play backward. */
static const double moved_min = 0.5 * 3.14159265358979323846 / 180.0;   /* rad: less is noise */
static const double moved_clear = 2.0 * 3.14159265358979323846 / 180.0; /* rad, by which wheels tell who pushed them */
static const double backward_creep_factor = 2.0;
static const double near_friction = 0.10;                 /* m/s^2: wind and bank push as much, unseen */
static const double forgotten_s = 0.5;                    /* how long a place holds with no side force to keep it */
static const double place_variance_max = 0.7;             /* flanks are likelier than the middle */

/* How far off the estimate is, before a sensor has said. */
static const double error_sd = 0.6 * 3.14159265358979323846 / 180.0;         /* rad, and */
static const double error_speed = 5.0;                                        /* m/s, below which it grows */
static const double lead_sd_s = 0.06;                     /* s, of how late it is */
static const double yaw_acceleration_sd_s = 0.15;         /* s, of T */
static const double T_prior_s = 0.5;                      /* s */
static const double T_prior_steady_s = 6.0;               /* s, of steering wheel angle per yaw rate, where T is that */
static const double T_prior_s2 = 0.05;                    /* rad^2/s^2 x s: yaw acceleration that outweighs the prior */
static const double load_share_sd = 0.10;                 /* of K after the sensor is lost, by fuel and tyres */
static const double load_share_stopped_sd = 0.25;         /* and after a stop that was long enough to load */
static const double loading_s = 60.0;
static const double learning_memory_s = 600.0;
static const double learned_s = 30.0;
static const double unflattened = 1.10;                   /* the gyro's noise flattens the slope T */

/* Beyond (7): turning on a circle takes the arctangent of L/R, linkages and racks turn the wheels faster at their ends.
 * Both together take a share of the front wheels' angle cubed. */
static const double cube_min = 0.15 * 0.15 * 0.15;        /* rad^3: smaller ones tell of other errors */
static const double cube_speed = 3.0;                     /* m/s: slower, the gyro's noise counts too much */
static const double flattened_max = 0.3;                  /* of an angle: more is driving backward, or a sensor at fault */
static const double flattening_sd = 0.5;                  /* 1/rad^2, prior about none; the arctangent alone is 1/3 */
static const double flattening_prior = 1e-4;              /* rad^6 x s: cubes that outweigh the prior */

/* Where motion says nothing. */
static const double walking_speed = 1.0;                      /* m/s */
static const double never_s = 1e9;
static const double hand_rate_sd = 1.5;                   /* rad/s */
static const double angle_sd_max = 10.0;                  /* rad */
static const double learning_speed = 8.0;                 /* m/s */
static const double valid_sd = 5.0 * 3.14159265358979323846 / 180.0;

void oc_angle_setup(oc_angle_design *design, oc_angle_method method, const oc_ratio *ratio, double wheelbase,
                    double rate_hz) {
    const double tick_s = 1.0 / rate_hz;
    const double w = 2.0 * half_turn * pair_hz;
    const double first = 2.0 * half_turn * first_pole_hz * tick_s;
    *design = (oc_angle_design){
        .method = method,
        .ratio = *ratio,
        .wheelbase = wheelbase,
        .yaw_rate_share = first / (1.0 + first),
        .stiffness = w * w,
        .damping = 2.0 * pair_damping * w,
        .speed_share = tick_s / (speed_s + tick_s),
        .bank_share = tick_s / (bank_s + tick_s),
        .rate_share = tick_s / (rate_s + tick_s),
        .takeover_share = tick_s / (takeover_s + tick_s),
        .tick_s = tick_s,
    };
}

static double limited_to(double value, double limit) {
    if (value > limit) {
        return limit;
    }
    return value < -limit ? -limit : value;
}

static double at_most(double a, double b) {
    return a < b ? a : b;
}

static void begin_observer(oc_angle_tracking *t, const oc_angle_tick *tick) {
    *t = (oc_angle_tracking){
        .running = 1,
        .yaw_rate_first = tick->yaw_rate,
        .yaw_rate = tick->yaw_rate,
        .speed = tick->speed,
        .bank = tick->lateral_acceleration - tick->yaw_rate * tick->speed,
        .place_variance = place_variance_max,
        .without_sensor_s = never_s,
    };
}

static void filter_motion(oc_angle_tracking *t, const oc_angle_design *d, const oc_angle_tick *tick) {
    t->speed += (tick->speed - t->speed) * d->speed_share;
    t->yaw_rate_first += (tick->yaw_rate - t->yaw_rate_first) * d->yaw_rate_share;
    /* implicit in the damping, so that it is stable at 20 Hz */
    t->yaw_acceleration = (t->yaw_acceleration + d->stiffness * (t->yaw_rate_first - t->yaw_rate) * d->tick_s) /
                          (1.0 + d->damping * d->tick_s);
    t->yaw_rate += t->yaw_acceleration * d->tick_s;
    t->bank += (tick->lateral_acceleration - t->yaw_rate * t->speed - t->bank) * d->bank_share;
}

static double lead_s(const oc_angle_evidence *e) {
    return unflattened * (e->products + T_prior_s2 * T_prior_s) / (e->slopes + T_prior_s2);
}

/* Which flank of the play the steering wheel is at, from where the wheels go. */
static void place_in_play(oc_angle_tracking *t, const oc_angle_design *d, const oc_angle_truck *truck, double wheels,
                  double load) {
    const double half = 0.5 * truck->backlash;
    const double beyond = fabs(load) - truck->friction;
    const double moved = wheels - t->reference;
    const double clear = limited_to(moved, moved_min) - moved; /* minus what is beyond */
    t->reference -= clear;
    double push = 0.0;
    if (beyond <= 0.0 || -clear * load > 0.0) {
        push -= clear / moved_clear;
    }
    if (beyond > 0.0) {
        const double crept = backward_creep_factor * truck->creep * beyond * d->tick_s / (half > 1e-3 ? half : 1e-3);
        push += load > 0.0 ? crept : -crept;
    }
    t->place += push;
    t->place_variance -= t->place_variance * at_most(fabs(push), 1.0);
    if (beyond < near_friction) {
        const double share = d->tick_s / forgotten_s;
        t->place -= t->place * share;
        t->place_variance += (place_variance_max - t->place_variance) * share;
    }
    t->place = limited_to(t->place, 1.0);
}

double oc_angle_late_s(const oc_angle_design *d) {
    return d->method == OC_ANGLE_OBSERVER ? d->damping / d->stiffness + d->tick_s / d->yaw_rate_share : 0.0;
}

/* s; steering wheel angle per yaw rate, at a steady state. */
static double per_yaw_rate(const oc_angle_tracking *t, const oc_angle_design *d, const oc_angle_truck *truck) {
    const double v = fabs(t->speed);
    return d->ratio.ratio * (d->wheelbase / v + truck->gradient * v);
}

/* T as it is at this speed: oc_angle_late_s of what (10) needs is in it. */
static double lead_at(const oc_angle_tracking *t, const oc_angle_evidence *e, const oc_angle_design *d,
                      const oc_angle_truck *truck) {
    const double usual = (e->steady + T_prior_s2 * T_prior_steady_s) / (e->slopes + T_prior_s2);
    const double T = lead_s(e) + oc_angle_late_s(d) * (per_yaw_rate(t, d, truck) - usual);
    return T > 0.0 ? T : 0.0;
}

/* 1/rad^2, by which the front wheels' angle cubed lessens it. */
static double flattening(const oc_angle_evidence *e) {
    return e->flattened / (e->cubes + flattening_prior);
}

static void learn_flattening(oc_angle_evidence *e, const oc_angle_tracking *t, const oc_angle_design *d,
                             double error) {
    const bool plausible = fabs(error) < flattened_max * fabs(t->estimate);
    if (plausible && fabs(t->speed) > cube_speed && fabs(t->cube) > cube_min) {
        const double left = flattening(e) * t->cube - error / d->ratio.ratio;
        e->flattened += left * t->cube * d->tick_s;
        e->cubes += t->cube * t->cube * d->tick_s;
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

/* (23) */
static double wheels_by_side_slip(const oc_angle_tracking *t, const oc_angle_evidence *e, const oc_angle_design *d,
                                  const oc_angle_tick *tick) {
    const oc_side_slip slip = side_slip_of(t, tick);
    return oc_ratio_to_steering_wheel(&d->ratio, oc_side_slip_front_wheel(&e->side_slip, &slip, d->wheelbase));
}

/* What the learned truck needs, by (13), for the motion that is. */
static double wheels_of(oc_angle_tracking *t, const oc_angle_evidence *e, const oc_angle_design *d,
                        const oc_angle_truck *truck, double T, const oc_angle_tick *tick) {
    const double a = t->yaw_rate * t->speed + t->bank;
    const double v = t->speed;
    switch (d->method) {
    case OC_ANGLE_WHEEL_SPEED:
    case OC_ANGLE_WHEEL_SPEED_EXACT:
        return oc_ratio_to_steering_wheel(&d->ratio, tick->front_wheel);
    case OC_ANGLE_YAW_RATE:
        return oc_ratio_to_steering_wheel(&d->ratio,
                                          oc_front_wheel_by_yaw_rate(d->wheelbase, tick->yaw_rate, v, 0.0, 0.0));
    case OC_ANGLE_YAW_RATE_UNDERSTEER:
        return oc_ratio_to_steering_wheel(
            &d->ratio, oc_front_wheel_by_yaw_rate(d->wheelbase, tick->yaw_rate, v, truck->gradient, tick->yaw_rate * v));
    default:
        break;
    }
    const double steady = oc_front_wheel_by_yaw_rate(d->wheelbase * (1.0 + truck->wheelbase), t->yaw_rate, v,
                                                     truck->gradient, a - truck->unloading);
    t->cube = steady * steady * steady;
    return oc_ratio_to_steering_wheel(&d->ratio, steady - flattening(e) * t->cube +
                                                     T / d->ratio.ratio * t->yaw_acceleration);
}

/* Of the estimate, by its own make: what a sensor can judge. */
static double own_variance(const oc_angle_tracking *t, const oc_angle_truck *truck) {
    const double slow = error_sd * (1.0 + error_speed / fabs(t->speed));
    const double late = lead_sd_s * t->rate;
    const double turning = yaw_acceleration_sd_s * t->yaw_acceleration;
    const double played = 0.5 * truck->backlash;
    return slow * slow + late * late + turning * turning + played * played * t->place_variance;
}

/* By what a sensor cannot say, or said before. */
static double other_variance(const oc_angle_tracking *t, const oc_angle_evidence *e, const oc_angle_design *d,
                             const oc_angle_truck *truck, const oc_angle_tick *tick) {
    const double i = d->ratio.ratio;
    const double a = t->yaw_rate * t->speed + t->bank - truck->unloading;
    const double loaded = (t->standing_s > loading_s ? load_share_stopped_sd : load_share_sd) * truck->gradient;
    const double gyro = i * d->wheelbase / t->speed * tick->yaw_rate_bias_sd;
    const double gradient = i * a * truck->gradient_sd, load = i * a * loaded;
    const double flat = i * t->cube * flattening_sd;
    return truck->offset_sd * truck->offset_sd + gyro * gyro + gradient * gradient + load * load +
           flat * flat * flattening_prior / (flattening_prior + e->cubes);
}

/* What the sensor says of T and of how far off the estimate is. */
static void learn_from_sensor(oc_angle_evidence *e, const oc_angle_tracking *t, const oc_angle_design *d,
                              const oc_angle_truck *truck, double error, double without_T, double variance) {
    const double keep = 1.0 - d->tick_s / learning_memory_s;
    if (t->place_variance < 0.1) {
        const double squared = t->yaw_acceleration * t->yaw_acceleration * d->tick_s;
        e->slopes = keep * e->slopes + squared;
        e->steady = keep * e->steady + squared * per_yaw_rate(t, d, truck);
        e->products = keep * e->products + t->yaw_acceleration * without_T * d->tick_s;
    }
    e->seconds += d->tick_s;
    const double share = d->tick_s / at_most(learning_memory_s, 10.0 + e->seconds);
    e->spread += (at_most(error * error / variance, 25.0) - e->spread) * share;
}

/* Without ever having had a sensor. */
static const oc_angle_truck unknown_truck = {
    .offset_sd = 1.0 * 3.14159265358979323846 / 180.0,   /* rad, of alignment */
    .gradient_sd = 0.5 * 3.14159265358979323846 / 180.0, /* rad/(m/s^2), prior */
    .backlash = 4.0 * 3.14159265358979323846 / 180.0,    /* rad */
    .friction = 1e9,
};

void oc_angle_update(oc_angle_tracking *t, oc_angle_evidence *e, const oc_angle_design *d, const oc_angle_truck *given,
                     const oc_angle_tick *tick, oc_angle *out) {
    const oc_angle_truck *truck = given->known ? given : &unknown_truck;
    const bool observes = d->method == OC_ANGLE_OBSERVER;
    if (!t->running && tick->has_motion) {
        begin_observer(t, tick);
    }
    if (tick->has_motion) {
        filter_motion(t, d, tick);
    }
    const bool moves = tick->has_motion && fabs(t->speed) > walking_speed && fabs(tick->speed) > 0.5 * walking_speed;
    if (moves) {
        const double T = given->known ? lead_at(t, e, d, truck) : T_prior_s;
        const double wheels = d->method == OC_ANGLE_SIDE_SLIP ? wheels_by_side_slip(t, e, d, tick)
                                                              : wheels_of(t, e, d, truck, T, tick);
        if (t->held_s > 0.0 || t->without_sensor_s >= never_s) {
            t->reference = wheels;
        }
        t->held_s = 0.0;
        const double load = t->yaw_rate * t->speed + t->bank - truck->unloading;
        place_in_play(t, d, truck, wheels, load);
        t->estimate = observes ? wheels + 0.5 * truck->backlash * t->place : wheels;
        const double own = own_variance(t, truck);
        const double error = tick->true_by_sensor - t->estimate;
        if (tick->teaches && given->known && observes) {
            learn_flattening(e, t, d, error);
        }
        if (tick->teaches && given->known && fabs(t->speed) > learning_speed) {
            learn_from_sensor(e, t, d, truck, error, error + T * t->yaw_acceleration, own);
            if (d->method == OC_ANGLE_SIDE_SLIP) {
                const oc_side_slip slip = side_slip_of(t, tick);
                oc_side_slip_learn(&e->side_slip, &slip, oc_ratio_to_front_wheel(&d->ratio, tick->true_by_sensor),
                                   d->tick_s, learning_memory_s);
            }
        }
        const double spread = e->seconds > learned_s ? e->spread : 2.0;
        t->sd = sqrt(spread * own + other_variance(t, e, d, truck, tick));
    } else {
        t->held_s += d->tick_s;
        t->place_variance = place_variance_max;
        t->sd = at_most(t->sd + hand_rate_sd * d->tick_s, angle_sd_max);
    }

    /* no jump when the sensor goes, or comes back: its last word fades, and so does ours */
    out->estimate = t->estimate;
    out->estimate_sd = t->sd;
    out->by_sensor = tick->has_sensor;
    if (tick->has_sensor) {
        const bool came_back = t->without_sensor_s > 0.0 && t->without_sensor_s < never_s;
        t->step = came_back ? t->before - tick->true_by_sensor : t->step * (1.0 - d->takeover_share);
        t->difference = tick->true_by_sensor + t->step - t->estimate;
        t->without_sensor_s = t->standing_s = 0.0;
        out->standard_deviation = sqrt(truck->offset_sd * truck->offset_sd + t->step * t->step);
        out->status = given->known ? OC_VALID : OC_CONVERGING;
    } else {
        t->difference -= t->difference * d->takeover_share;
        t->without_sensor_s += d->tick_s;
        t->standing_s += moves ? 0.0 : d->tick_s;
        out->standard_deviation = t->sd;
        out->status = !given->known || !moves ? OC_UNOBSERVABLE : t->sd < valid_sd ? OC_VALID : OC_CONVERGING;
    }
    out->angle = t->estimate + t->difference;
    t->rate += ((out->angle - t->before) / d->tick_s - t->rate) * d->rate_share;
    t->before = out->angle;
    out->rate = t->rate;
}

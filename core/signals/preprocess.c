#include "preprocess.h"

#include <math.h>
#include <string.h>

#include "trig.h"

/* Derived. */
static const double pi = 3.14159265358979323846;

oc_lowpass oc_lowpass_design(double cutoff_hz, double rate_hz) {
    const double c = 1.0 / oc_tan(pi * cutoff_hz / rate_hz);
    const double b0 = 1.0 / (1.0 + sqrt(2.0) * c + c * c);
    return (oc_lowpass){.b0 = b0, .a1 = 2.0 * (1.0 - c * c) * b0, .a2 = (1.0 - sqrt(2.0) * c + c * c) * b0};
}

double oc_lowpass_delay(double cutoff_hz, double band_hz, double rate_hz) {
    /* The bilinear transform warps the frequency axis: u is the analogue prototype's frequency. Its phase is
     * -atan(sqrt(2) u / (1 - u^2)), here as an arcsine. */
    const double u = oc_tan(pi * band_hz / rate_hz) / oc_tan(pi * cutoff_hz / rate_hz);
    const double phase = oc_asin(sqrt(2.0) * u / sqrt(1.0 + u * u * u * u));
    return phase / (2.0 * pi * band_hz);
}

void oc_preprocess_design(oc_preprocess *design, double cutoff_hz, double delay_band_hz, double slope_window_s,
                          double lag_s, double rate_hz) {
    const double delay = (oc_lowpass_delay(cutoff_hz, delay_band_hz, rate_hz) + lag_s) * rate_hz;
    const int32_t between_points = (int32_t)(slope_window_s * rate_hz / (OC_SLOPE_POINTS - 1) + 0.5);
    design->lowpass = oc_lowpass_design(cutoff_hz, rate_hz);
    design->delay_ticks = (int32_t)delay;
    design->delay_fraction = delay - design->delay_ticks;
    design->slope_every = between_points > 1 ? between_points : 1;
    /* Least squares line through the points: sum of (k - 5) v_k over sum of (k - 5)^2 = 110 for 11 points. */
    const double half = (OC_SLOPE_POINTS - 1) / 2.0;
    const double squares = (double)OC_SLOPE_POINTS * half * (half + 1.0) / 3.0;
    design->slope_scale = rate_hz / (squares * design->slope_every);
    design->settling_ticks = (OC_SLOPE_POINTS - 1) * design->slope_every + design->delay_ticks + 1;
}

/* Filters the signals in place. */
static void lowpass(oc_lowpass_states *state, const oc_lowpass *design, double *signals) {
    const double b0 = design->b0, a1 = design->a1, a2 = design->a2;
    for (int32_t k = 0; k < OC_FILTERED_COUNT; ++k) {
        const double b0x = b0 * signals[k];
        const double y = b0x + state->s1[k];
        state->s1[k] = 2.0 * b0x - a1 * y + state->s2[k];
        state->s2[k] = b0x - a2 * y;
        signals[k] = y;
    }
}

double oc_lowpass_second_difference(const oc_lowpass *design, int32_t apart) {
    oc_lowpass_states state = {0};
    double sum = 0.0;
    for (int32_t k = 0; k < 12 * apart; ++k) { /* the last impulse response has decayed by then */
        const double impulse = k == 0 || k == 2 * apart ? 1.0 : 0.0;
        double response[OC_FILTERED_COUNT] = {k == apart ? -2.0 : impulse};
        lowpass(&state, design, response);
        sum += response[0] * response[0];
    }
    return sum;
}

/* Sets the steady state for constant signals. */
static void set_steady(oc_lowpass_states *state, const oc_lowpass *design, const double *signals) {
    for (int32_t k = 0; k < OC_FILTERED_COUNT; ++k) {
        state->s2[k] = (design->b0 - design->a2) * signals[k];
        state->s1[k] = (2.0 * design->b0 - design->a1) * signals[k] + state->s2[k];
    }
}

void oc_preprocess_restart(oc_preprocess_state *state, const oc_preprocess *design, double angle, double yaw_rate,
                           double speed, double lateral_acceleration, double rear_axle_angle) {
    const double signals[OC_FILTERED_COUNT] = {yaw_rate, speed, lateral_acceleration, rear_axle_angle};
    memset(state, 0, sizeof *state);
    set_steady(&state->lowpass, &design->lowpass, signals);
    for (int32_t k = 0; k < OC_DELAY_MAX; ++k) {
        state->angle[k] = angle;
    }
    for (int32_t k = 0; k < OC_SLOPE_POINTS; ++k) {
        state->speed[k] = speed;
    }
}

/* Stores every slope_every-th speed, and fits the slope of a line through them. */
static void differentiate(oc_preprocess_state *state, const oc_preprocess *design, double speed) {
    if (state->slope_wait > 0) {
        --state->slope_wait;
        return;
    }
    state->slope_wait = design->slope_every - 1;
    state->speed[state->speed_next] = speed;
    state->speed_next = state->speed_next + 1 < OC_SLOPE_POINTS ? state->speed_next + 1 : 0;
    double sum = 0.0;
    int32_t index = state->speed_next; /* the oldest */
    for (int32_t k = 0; k < OC_SLOPE_POINTS; ++k) {
        sum += (k - (OC_SLOPE_POINTS - 1) / 2) * state->speed[index];
        index = index + 1 < OC_SLOPE_POINTS ? index + 1 : 0;
    }
    state->speed_slope = sum * design->slope_scale;
}

/* The angle delay_ticks + delay_fraction ago. */
static double delayed(oc_preprocess_state *state, const oc_preprocess *design, double angle) {
    const int32_t ring = OC_DELAY_MAX - 1; /* bit mask of its index: OC_DELAY_MAX is a power of two */
    const int32_t now = state->angle_next;
    state->angle[now] = angle;
    state->angle_next = (now + 1) & ring;
    const double later = state->angle[(now + OC_DELAY_MAX - design->delay_ticks) & ring];
    const double earlier = state->angle[(now + OC_DELAY_MAX - design->delay_ticks - 1) & ring];
    return later + design->delay_fraction * (earlier - later);
}

oc_filtered oc_preprocess_update(oc_preprocess_state *state, const oc_preprocess *design, double angle,
                                 double yaw_rate, double speed, double lateral_acceleration, double rear_axle_angle) {
    double signals[OC_FILTERED_COUNT] = {yaw_rate, speed, lateral_acceleration, rear_axle_angle};
    lowpass(&state->lowpass, &design->lowpass, signals);
    differentiate(state, design, signals[OC_FILTERED_SPEED]);
    if (state->ticks < design->settling_ticks) {
        ++state->ticks;
    }
    return (oc_filtered){
        .steering_wheel_angle = delayed(state, design, angle),
        .yaw_rate = signals[OC_FILTERED_YAW_RATE],
        .vehicle_speed = signals[OC_FILTERED_SPEED],
        .lateral_acceleration = signals[OC_FILTERED_ACCELERATION],
        .rear_axle_angle = signals[OC_FILTERED_REAR_ANGLE],
        .longitudinal_acceleration = state->speed_slope,
    };
}

bool oc_preprocess_settled(const oc_preprocess_state *state, const oc_preprocess *design) {
    return state->ticks >= design->settling_ticks;
}

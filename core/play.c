#include "play.h"

#include <math.h>

static const float width_share = 0.1f;
static const float width_least = 0.1f * 0.017453292f; /* rad, of half the width */
static const float hardly = 1e-4f;                    /* rad, half of the least width */
static const float unloading_apart = 0.03f;           /* m/s^2 */
static const float friction_apart = 0.03f;            /* m/s^2 */
static const float creep_factor = 1.4f;
static const float creep_factors_apart = 0.6729f;     /* 2 ln 1.4 */
static const float unwinding_apart = 0.2f;            /* 1/s */

static float not_below(float value, float low) {
    return value > low ? value : low;
}

static float held_within(float value, float low, float high) {
    if (value < low) {
        return low;
    }
    return value > high ? high : value;
}

int32_t oc_play_slopes(const oc_play *play) {
    return play->friction >= 0.0f ? OC_SLOPE_COUNT : 1;
}

float oc_play_width_step(float half_width) {
    return not_below(width_share * half_width, width_least);
}

oc_play oc_play_moved(const oc_play *play, oc_slope slope, float sign) {
    oc_play to = *play;
    switch (slope) {
    case OC_SLOPE_WIDTH: to.half_width = not_below(to.half_width + sign * oc_play_width_step(to.half_width), hardly); break;
    case OC_SLOPE_UNLOADING: to.unloading += sign * unloading_apart; break;
    case OC_SLOPE_FRICTION: to.friction = not_below(to.friction + sign * friction_apart, 0.0f); break;
    case OC_SLOPE_CREEP: to.creep *= sign > 0.0f ? creep_factor : 1.0f / creep_factor; break;
    case OC_SLOPE_WINDUP: to.windup = not_below(to.windup + sign * oc_play_width_step(to.windup), hardly); break;
    default: to.unwinding = not_below(to.unwinding + sign * unwinding_apart, 0.0f); break;
    }
    return to;
}

float oc_play_between(const oc_play *more, const oc_play *less, oc_slope slope) {
    switch (slope) {
    case OC_SLOPE_WIDTH: return 2.0f * (more->half_width - less->half_width);
    case OC_SLOPE_UNLOADING: return more->unloading - less->unloading;
    case OC_SLOPE_FRICTION: return more->friction - less->friction;
    case OC_SLOPE_CREEP: return creep_factors_apart;
    case OC_SLOPE_WINDUP: return 2.0f * (more->windup - less->windup);
    default: return more->unwinding - less->unwinding;
    }
}

float oc_play_load(const oc_play *play, const oc_motion_sample *sample) {
    float load = sample->lateral_acceleration - play->unloading;
    for (int32_t k = 0; k < OC_WINDS; ++k) {
        load -= play->wind[k] * sample->wind[k];
    }
    return load;
}

float oc_place_wound(float wound, const oc_play *play, float angle, float centre, float step_s) {
    const float unwound = wound - play->unwinding * (wound - centre) * step_s;
    return held_within(unwound, angle - play->windup, angle + play->windup);
}

float oc_place_inner(float inner, const oc_play *play, float wound, float load, float step_s) {
    const float beyond = fabsf(load) - play->friction;
    if (play->friction >= 0.0f && beyond > 0.0f) {
        const float crept = play->creep * beyond * step_s;
        inner += load > 0.0f ? -crept : crept;
    }
    return held_within(inner, wound - play->half_width, wound + play->half_width);
}

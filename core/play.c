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

float *oc_play_parameter(oc_play *play, oc_slope slope) {
    switch (slope) {
    case OC_SLOPE_WIDTH: return &play->half_width;
    case OC_SLOPE_UNLOADING: return &play->unloading;
    case OC_SLOPE_FRICTION: return &play->friction;
    case OC_SLOPE_CREEP: return &play->creep;
    case OC_SLOPE_WINDUP: return &play->windup;
    default: return &play->unwinding;
    }
}

static oc_around stepped_around(float value, float step, float least) {
    const float more = value + step, less = not_below(value - step, least);
    return (oc_around){more, less, more - less};
}

oc_around oc_play_around(float value, oc_slope slope) {
    if (slope == OC_SLOPE_UNLOADING) {
        return stepped_around(value, unloading_apart, -1e9f);
    }
    if (slope == OC_SLOPE_FRICTION) {
        return stepped_around(value, friction_apart, 0.0f);
    }
    if (slope == OC_SLOPE_UNWINDING) {
        return stepped_around(value, unwinding_apart, 0.0f);
    }
    if (slope == OC_SLOPE_CREEP) {
        return (oc_around){value * creep_factor, value * (1.0f / creep_factor), creep_factors_apart};
    }
    oc_around halves = stepped_around(value, oc_play_width_step(value), hardly);
    halves.apart *= 2.0f;
    return halves;
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

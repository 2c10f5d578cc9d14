#include "play.h"

#include <stdbool.h>

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

/* Least and most without a jump, which none could foresee: which flank a wheel hangs on is what is asked. */
static float held_within(float value, float low, float high) {
    const float not_less = value < low ? low : value;
    return not_less > high ? high : not_less;
}

float oc_play_width_step(float half_width) {
    return not_below(width_share * half_width, width_least);
}

float oc_play_load(const oc_play *play, const oc_motion_sample *sample) {
    float load = sample->lateral_acceleration - play->unloading;
    for (int32_t k = 0; k < OC_WINDS; ++k) {
        load -= play->wind[k] * sample->wind[k];
    }
    return load;
}

/* A parameter's values as far to both sides as the model's slope is taken. */
typedef struct {
    float more, less;
} around;

static around around_of(float value, float step, float least) {
    return (around){value + step, not_below(value - step, least)};
}

static around around_width(float half_width) {
    return around_of(half_width, oc_play_width_step(half_width), hardly);
}

static float wound_up(float wound, const oc_play_motion *by, float windup, float unwinding) {
    const float unwound = wound - unwinding * (wound - by->centre) * by->step_s;
    return held_within(unwound, by->angle - windup, by->angle + windup);
}

/* rad, by which side force beyond friction carries the wheels, at so much creep in a step. */
static float crept(float load, float friction, float creep) {
    return creep * (held_within(load, -friction, friction) - load);
}

static float in_play(float inner, float wound, float half_width) {
    return held_within(inner, wound - half_width, wound + half_width);
}

/* At a little more and less width; no other parameter need be looked at. */
static float move_widths(oc_places *p, const oc_play *play, float by_load) {
    const around half = around_width(play->half_width);
    p->more[OC_SLOPE_WIDTH] = in_play(p->more[OC_SLOPE_WIDTH] + by_load, p->wound, half.more);
    p->less[OC_SLOPE_WIDTH] = in_play(p->less[OC_SLOPE_WIDTH] + by_load, p->wound, half.less);
    return p->less[OC_SLOPE_WIDTH] - p->more[OC_SLOPE_WIDTH];
}

/* Behind a play of the same width, where the side force carries the wheels by another way. */
static float move_loaded(oc_places *p, const oc_play *play, int32_t slope, float more, float less) {
    p->more[slope] = in_play(p->more[slope] + more, p->wound, play->half_width);
    p->less[slope] = in_play(p->less[slope] + less, p->wound, play->half_width);
    return p->less[slope] - p->more[slope];
}

/* Behind a wind-up of another width, or one that is unwound otherwise. */
static float move_wound(oc_places *p, const oc_play *play, int32_t slope, float by_load) {
    const int32_t winding = slope - (int32_t)OC_SLOPE_UNWINDING;
    p->more[slope] = in_play(p->more[slope] + by_load, p->wound_more[winding], play->half_width);
    p->less[slope] = in_play(p->less[slope] + by_load, p->wound_less[winding], play->half_width);
    return p->less[slope] - p->more[slope];
}

void oc_places_move(oc_places *p, const oc_play *play, const oc_play_motion *by, float *differences) {
    const bool creeps = play->friction >= 0.0f;
    const float load = by->load, friction = play->friction;
    const float creep = play->creep * by->step_s;
    const float by_load = creeps ? crept(load, friction, creep) : 0.0f;
    p->wound = wound_up(p->wound, by, play->windup, play->unwinding);
    p->inner = in_play(p->inner + by_load, p->wound, play->half_width);
    differences[OC_SLOPE_WIDTH] = move_widths(p, play, by_load);
    if (!creeps) {
        return;
    }
    differences[OC_SLOPE_UNLOADING] =
        move_loaded(p, play, OC_SLOPE_UNLOADING, crept(load - unloading_apart, friction, creep),
                    crept(load + unloading_apart, friction, creep));
    const around rubs = around_of(friction, friction_apart, 0.0f);
    differences[OC_SLOPE_FRICTION] =
        move_loaded(p, play, OC_SLOPE_FRICTION, crept(load, rubs.more, creep), crept(load, rubs.less, creep));
    differences[OC_SLOPE_CREEP] =
        move_loaded(p, play, OC_SLOPE_CREEP, by_load * creep_factor, by_load * (1.0f / creep_factor));
    const around unwinds = around_of(play->unwinding, unwinding_apart, 0.0f);
    p->wound_more[0] = wound_up(p->wound_more[0], by, play->windup, unwinds.more);
    p->wound_less[0] = wound_up(p->wound_less[0], by, play->windup, unwinds.less);
    differences[OC_SLOPE_UNWINDING] = move_wound(p, play, OC_SLOPE_UNWINDING, by_load);
    const around winds = around_width(play->windup);
    p->wound_more[1] = wound_up(p->wound_more[1], by, winds.more, play->unwinding);
    p->wound_less[1] = wound_up(p->wound_less[1], by, winds.less, play->unwinding);
    differences[OC_SLOPE_WINDUP] = move_wound(p, play, OC_SLOPE_WINDUP, by_load);
}

static float apart_of(float value, float step, float least) {
    const float below = value - least;
    return step + (below < step ? below : step);
}

void oc_play_apart(const oc_play *play, float *apart) {
    apart[OC_SLOPE_CREEP] = creep_factors_apart;
    apart[OC_SLOPE_FRICTION] = apart_of(play->friction, friction_apart, 0.0f);
    apart[OC_SLOPE_UNLOADING] = 2.0f * unloading_apart;
    apart[OC_SLOPE_WIDTH] = 2.0f * apart_of(play->half_width, oc_play_width_step(play->half_width), hardly);
    apart[OC_SLOPE_UNWINDING] = apart_of(play->unwinding, unwinding_apart, 0.0f);
    apart[OC_SLOPE_WINDUP] = 2.0f * apart_of(play->windup, oc_play_width_step(play->windup), hardly);
}

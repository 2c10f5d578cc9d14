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
    float load = sample->lateral_acceleration + sample->tandem - play->unloading;
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

/* Behind a play of another width, or where side force carries the wheels faster. */
static void move_played(oc_places *p, const oc_play *play, float by_load) {
    const around half = around_width(play->half_width);
    const float by[OC_BESIDE] = {by_load * creep_factor, by_load, by_load * (1.0f / creep_factor), by_load};
    const float half_width[OC_BESIDE] = {play->half_width, half.more, play->half_width, half.less};
    for (int32_t k = 0; k < OC_BESIDE; ++k) {
        p->played[k] = in_play(p->played[k] + by[k], p->wound, half_width[k]);
    }
}

/* Where side force carries the wheels beyond another friction, or from elsewhere on. */
static void move_loaded(oc_places *p, const oc_play *play, float load, float creep) {
    const around rubs = around_of(play->friction, friction_apart, 0.0f);
    const float friction[OC_BESIDE] = {rubs.more, play->friction, rubs.less, play->friction};
    const float loads[OC_BESIDE] = {load, load - unloading_apart, load, load + unloading_apart};
    for (int32_t k = 0; k < OC_BESIDE; ++k) {
        p->loaded[k] = in_play(p->loaded[k] + crept(loads[k], friction[k], creep), p->wound, play->half_width);
    }
}

/* Behind a wind-up that is unwound otherwise, or one of another width. */
static void move_unwound(oc_places *p, const oc_play *play, const oc_play_motion *by, float by_load) {
    const around unwinds = around_of(play->unwinding, unwinding_apart, 0.0f);
    const around winds = around_width(play->windup);
    const float unwinding[OC_BESIDE] = {unwinds.more, play->unwinding, unwinds.less, play->unwinding};
    const float windup[OC_BESIDE] = {play->windup, winds.more, play->windup, winds.less};
    for (int32_t k = 0; k < OC_BESIDE; ++k) {
        const float wound = wound_up(p->wound_beside[k], by, windup[k], unwinding[k]);
        p->wound_beside[k] = wound;
        p->unwound[k] = in_play(p->unwound[k] + by_load, wound, play->half_width);
    }
}

/* rad, by which side force carries the wheels in a step. */
static float carried(const oc_play *play, const oc_play_motion *by) {
    return play->friction >= 0.0f ? crept(by->load, play->friction, play->creep * by->step_s) : 0.0f;
}

void oc_play_follow(float *wound, float *inner, const oc_play *play, const oc_play_motion *by) {
    *wound = wound_up(*wound, by, play->windup, play->unwinding);
    *inner = in_play(*inner + carried(play, by), *wound, play->half_width);
}

float oc_places_move(oc_places *p, const oc_play *play, const oc_play_motion *by, float *sums) {
    const bool creeps = play->friction >= 0.0f;
    const float by_load = carried(play, by);
    oc_play_follow(&p->wound, &p->inner, play, by);
    move_played(p, play, by_load);
    sums[OC_SLOPE_WIDTH] += p->played[3] - p->played[1];
    if (!creeps) {
        return 0.0f;
    }
    move_loaded(p, play, by->load, play->creep * by->step_s);
    move_unwound(p, play, by, by_load);
    const float by_unloading = p->loaded[3] - p->loaded[1];
    sums[OC_SLOPE_UNLOADING] += by_unloading;
    sums[OC_SLOPE_CREEP] += p->played[2] - p->played[0];
    sums[OC_SLOPE_FRICTION] += p->loaded[2] - p->loaded[0];
    sums[OC_SLOPE_UNWINDING] += p->unwound[2] - p->unwound[0];
    sums[OC_SLOPE_WINDUP] += p->unwound[3] - p->unwound[1];
    return by_unloading;
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

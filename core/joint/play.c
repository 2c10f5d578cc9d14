#include "play.h"

#include <stdbool.h>

/* Derived. */
static const float creep_divisor = 0.6729f;        /* 2 ln creep_factor */

/* Numerical. */
/* Steps of the difference quotients, wide enough to average over the operators' kinks (docs/method.md, "Slopes"). */
static const float width_share = 0.1f;                   /* of half the width */
static const float width_step_min = 0.1f * 0.017453292f; /* rad, of half the width */
static const float half_width_min = 1e-4f;               /* rad, against a division by zero */
static const float unloading_difference = 0.03f;         /* m/s^2 */
static const float friction_difference = 0.03f;          /* m/s^2 */
static const float creep_factor = 1.4f;                  /* 1 */
static const float unwinding_difference = 0.2f;          /* 1/s */

static float not_below(float value, float low) {
    return value > low ? value : low;
}

/* Branch-free: the branch would mispredict, since the flank is unpredictable. */
static float clamped(float value, float low, float high) {
    const float raised = value < low ? low : value;
    return raised > high ? high : raised;
}

float oc_play_width_step(float half_width) {
    return not_below(width_share * half_width, width_step_min);
}

float oc_play_load(const oc_play *play, const oc_motion_sample *sample) {
    float load = sample->force + sample->tandem + play->fifth_wheel * sample->fifth_wheel -
                 play->unloading;
    for (int32_t k = 0; k < OC_WINDS; ++k) {
        load -= play->wind[k] * sample->wind[k];
    }
    return load;
}

/* Two values of a parameter, for a difference quotient. */
typedef struct {
    float more, less;
} value_pair;

static value_pair pair_of(float value, float step, float low) {
    return (value_pair){value + step, not_below(value - step, low)};
}

static value_pair width_pair(float half_width) {
    return pair_of(half_width, oc_play_width_step(half_width), half_width_min);
}

static float wound_up(float wound, const oc_play_motion *by, float windup, float unwinding) {
    const float unwound = wound - unwinding * (wound - by->centre) * by->step_s;
    return clamped(unwound, by->angle - windup, by->angle + windup);
}

/* rad, creep of the wheels in a step by lateral force beyond friction; `creep`: rad per m/s^2 and step. */
static float crept(float load, float friction, float creep) {
    return creep * (clamped(load, -friction, friction) - load);
}

static float in_play(float inner, float wound, float half_width) {
    return clamped(inner, wound - half_width, wound + half_width);
}

/* Places at varied creep and width of the play. */
static void move_played(oc_places *p, const oc_play *play, float by_load) {
    const value_pair half = width_pair(play->half_width);
    const float by[OC_VARIED] = {by_load * creep_factor, by_load, by_load * (1.0f / creep_factor), by_load};
    const float half_width[OC_VARIED] = {play->half_width, half.more, play->half_width, half.less};
    for (int32_t k = 0; k < OC_VARIED; ++k) {
        p->played[k] = in_play(p->played[k] + by[k], p->wound, half_width[k]);
    }
}

/* Places at varied friction and a_0. */
static void move_loaded(oc_places *p, const oc_play *play, float load, float creep) {
    const value_pair rubs = pair_of(play->friction, friction_difference, 0.0f);
    const float friction[OC_VARIED] = {rubs.more, play->friction, rubs.less, play->friction};
    const float loads[OC_VARIED] = {load, load - unloading_difference, load, load + unloading_difference};
    for (int32_t k = 0; k < OC_VARIED; ++k) {
        p->loaded[k] = in_play(p->loaded[k] + crept(loads[k], friction[k], creep), p->wound, play->half_width);
    }
}

/* Places at varied rate of unwinding and width of the wind-up. */
static void move_unwound(oc_places *p, const oc_play *play, const oc_play_motion *by, float by_load) {
    const value_pair unwinds = pair_of(play->unwinding, unwinding_difference, 0.0f);
    const value_pair winds = width_pair(play->windup);
    const float unwinding[OC_VARIED] = {unwinds.more, play->unwinding, unwinds.less, play->unwinding};
    const float windup[OC_VARIED] = {play->windup, winds.more, play->windup, winds.less};
    for (int32_t k = 0; k < OC_VARIED; ++k) {
        const float wound = wound_up(p->wound_varied[k], by, windup[k], unwinding[k]);
        p->wound_varied[k] = wound;
        p->unwound[k] = in_play(p->unwound[k] + by_load, wound, play->half_width);
    }
}

/* rad, motion of the wheels by lateral force in a step. */
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

static float divisor_of(float value, float step, float low) {
    const float below = value - low;
    return step + (below < step ? below : step);
}

void oc_play_divisors(const oc_play *play, float *divisors) {
    divisors[OC_SLOPE_CREEP] = creep_divisor;
    divisors[OC_SLOPE_FRICTION] = divisor_of(play->friction, friction_difference, 0.0f);
    divisors[OC_SLOPE_UNLOADING] = 2.0f * unloading_difference;
    divisors[OC_SLOPE_WIDTH] =
        2.0f * divisor_of(play->half_width, oc_play_width_step(play->half_width), half_width_min);
    divisors[OC_SLOPE_UNWINDING] = divisor_of(play->unwinding, unwinding_difference, 0.0f);
    divisors[OC_SLOPE_WINDUP] = 2.0f * divisor_of(play->windup, oc_play_width_step(play->windup), half_width_min);
}

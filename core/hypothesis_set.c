#include "hypothesis_set.h"

#include <math.h>

#include "bounds.h"

static const float one_degree = 0.017453292f; /* rad */

/* Little, some and much play; wheels that side force carries through it, sooner or later, or that stay where they rub;
 * and an accelerometer that may be off to either side. */
oc_play oc_joint_start_of(int32_t k) {
    static const float widths[3] = {2.0f, 6.0f, 12.0f}; /* deg */
    static const float unloadings[3] = {-0.2f, 0.0f, 0.2f};
    static const float creep = 100.0f * 0.017453292f;
    const int32_t kind = k % 4;
    oc_play play = {.half_width = 0.5f * widths[k / 4] * one_degree, .friction = -1.0f};
    if (kind > 0) {
        play.creep = creep;
        play.windup = 0.25f * one_degree;
        play.friction = 0.06f;
        play.unloading = unloadings[kind - 1];
    }
    return play;
}

/* Of those that begin anew every other three are wound up, and a motor unwinds it: who starts without does not find its
 * way there, since much wind-up that soon goes away passes for play. The next one has another width; wheels that stay
 * where they rub come last, for they pass for whatever drifts. */
static oc_play later_start_of(int32_t k) {
    static const uint8_t kinds[4] = {2, 1, 3, 0};
    oc_play play = oc_joint_start_of(4 * (k % 3) + kinds[k / 6]);
    if (k / 3 % 2 != 0 && play.friction >= 0.0f) {
        play.windup = one_degree;
        play.unwinding = 2.0f;
    }
    return play;
}

static int32_t best_of(const oc_joint *joint) {
    int32_t best = joint->best;
    for (int32_t k = 0; k < joint->count; ++k) {
        const oc_hypothesis *h = &joint->hypotheses[k];
        if (!oc_hypothesis_is_on_probation(h, &joint->second) && h->cost < joint->hypotheses[best].cost) {
            best = k;
        }
    }
    return best;
}

/* Two hypotheses that went the same way say the same twice. */
static bool are_twins(const oc_hypothesis *a, const oc_hypothesis *b) {
    static const float near = 0.1f * 0.017453292f; /* rad */
    return fabsf(a->play.half_width - b->play.half_width) < near && fabsf(a->play.windup - b->play.windup) < near &&
           fabsf(a->offset - b->offset) < near && (a->play.friction < 0.0f) == (b->play.friction < 0.0f);
}

/* The worst hypothesis if it is hopeless, or else one that another of the elder ones says as well. */
static int32_t dispensable(const oc_joint *joint) {
    int32_t worst = joint->best;
    for (int32_t k = 0; k < joint->count; ++k) {
        const oc_hypothesis *h = &joint->hypotheses[k];
        if (!oc_hypothesis_is_on_probation(h, &joint->second) && h->cost > joint->hypotheses[worst].cost) {
            worst = k;
        }
    }
    if (joint->hypotheses[worst].cost > joint->hypotheses[joint->best].cost + (float)OC_JOINT_HOPELESS) {
        return worst;
    }
    for (int32_t k = 0; k < joint->count; ++k) {
        const oc_hypothesis *h = &joint->hypotheses[k];
        if (k != joint->best && !oc_hypothesis_is_on_probation(h, &joint->second) &&
            are_twins(h, &joint->hypotheses[joint->best])) {
            return k;
        }
    }
    return -1;
}

/* The last one takes its place. None where k is negative. */
static void let_go(oc_joint *joint, int32_t k) {
    const int32_t last = joint->count - 1;
    if (k < 0) {
        return;
    }
    joint->hypotheses[k] = joint->hypotheses[last];
    joint->best = joint->best == last ? k : joint->best;
    joint->count = last;
}

/* What is later than the first day of side force: whoever learns so long has seen enough, and in single precision a
 * count that goes on would come to rest. */
static float mark_of(float seen_s) {
    return seen_s < 1e5f ? seen_s : 0.0f;
}

/* Now and then another hypothesis begins anew, lest all of them went astray at first; later half as often. Of those not
 * needed one goes for it, and later two, since ever fewer are. */
static void renew(oc_joint *joint) {
    static const float search_s = 300.0f, settle_s = 600.0f;
    const bool later = joint->second.used_s > search_s;
    const bool begins = joint->second.used_s < settle_s || joint->second.long_blocks % 2 == 0;
    const int32_t needless = dispensable(joint);
    if (begins && (needless >= 0 || joint->count < OC_JOINT_HYPOTHESES)) { /* in its place: to move one is more work */
        const oc_play play = later_start_of(joint->next_start);
        oc_hypothesis *h = &joint->hypotheses[needless >= 0 ? needless : joint->count++];
        joint->next_start = (joint->next_start + 1) % OC_JOINT_LATER_STARTS;
        oc_hypothesis_start(h, &play, (double)joint->hypotheses[joint->best].places.inner);
        h->left_before = mark_of(joint->to_left);
        h->right_before = mark_of(joint->to_right);
    } else {
        let_go(joint, needless);
    }
    if (later) {
        let_go(joint, dispensable(joint));
    }
}

float oc_joint_memory(const oc_joint *joint, const oc_joint_design *design) {
    const float first = 60.0f + 0.5f * joint->second.used_s;
    return oc_min(first, design->memory_s);
}

void oc_joint_turn_second(oc_joint *joint, const oc_joint_design *design) {
    oc_second *second = &joint->second;
    const float least = 0.05f * one_degree;
    joint->best = best_of(joint);
    second->best_cost = joint->hypotheses[joint->best].cost;
    const float noise = oc_hypothesis_noise(&joint->hypotheses[joint->best]);
    second->reference = noise > least * least ? noise : least * least;
    second->used_s += second->second_s;
    second->trial_s = oc_clamp(0.05f * second->used_s, 60.0f, 600.0f);
    if (second->long_block_ends) {
        renew(joint);
    }
    second->blocks += second->block_ends;
    second->long_blocks += second->long_block_ends;
    joint->in_block = second->block_ends ? 0 : joint->in_block + 1;
    joint->in_long_block = second->long_block_ends ? 0 : joint->in_long_block + 1;
    second->block_ends = joint->in_block + 1 == OC_SECONDS_PER_BLOCK;
    second->long_block_ends = joint->in_long_block + 1 == OC_SECONDS_PER_LONG_BLOCK;
    second->memory_share = 1.0f - second->second_s / oc_joint_memory(joint, design);
}

#include "hypothesis_set.h"

#include <math.h>

#include "bounds.h"
#include "joint_model.h"

/* Derived. */
static const float one_degree = 0.017453292f; /* rad, pi/180 */

/* Tuned, in tuned.toml: hypothesis_set */
static const float same_place = 0.1f * 0.017453292f; /* rad: maximum difference of B/2, W/2 and o of like hypotheses */
/* initial cost of a drifting zero, and of an offset that walks after an alarm: odds of 1 to 20 */
static const float assumption_cost = 3.0f;
static const float play_cost = 4.5f; /* initial cost of another play after an ignition: odds of 1 to 90 */
/* variance of the summed errors of a long block, over that of independent seconds, from which the offset may walk */
static const float walk_factor = 5.0f;
/* rad: way of an offset that walks, from which it is in the answer */
static const float walk_min = 1.0f * 0.017453292f;
static const float walk_proof = 12.0f; /* cost by which it must predict better than all hypotheses that stay */
/* s: used driving until two redundant hypotheses are removed at a time, and a hypothesis is checked for changes */
static const float single_until_s = 300.0f;
/* end */

/* Half the width of a start with a given play: its mean, and one standard deviation less and more. */
static float given_half_width(int32_t k, const oc_known_truck *known) {
    return oc_max(0.5f * (known->play + (float)(k - 1) / known->play_accuracy), 0.25f * one_degree);
}

/* docs/method.md, "Hypothesis set": three widths, each rubbing (friction < 0) or creeping at three a_0. Of 456 tuning
 * drives (bench/flanks.py, all rows) 286 answers are valid with an interval that holds; without the rubbing ones 280,
 * and 10 intervals fewer hold; without a_0 of 0 275, without the others 265, without the largest width 274. */
oc_play oc_joint_start_of(int32_t k, const oc_known_truck *known) {
    static const float widths[3] = {2.0f, 6.0f, 12.0f};     /* deg */
    static const float unloadings[3] = {-0.2f, 0.0f, 0.2f}; /* m/s^2 */
    const int32_t kind = k % 4;
    oc_play play = {.half_width = 0.5f * widths[k / 4] * one_degree, .friction = -1.0f};
    if (known->play_accuracy > 0.0f) {
        play.half_width = given_half_width(k / 4, known);
    }
    if (kind > 0) {
        play.creep = oc_joint_priors()[CREEP].mean;
        play.windup = 0.25f * one_degree;
        play.friction = 0.06f;
        play.unloading = unloadings[kind - 1];
    }
    return play;
}

/* Three of every six later starts have a wind-up that a motor unwinds. From a start without it, a hypothesis converges
 * to play instead (bench/accuracy.py, row `active_return`). Successive starts differ in width. Rubbing ones come last,
 * since they fit any drift. */
static oc_play later_start_of(int32_t k, const oc_known_truck *known) {
    static const uint8_t kinds[4] = {2, 1, 3, 0};
    oc_play play = oc_joint_start_of(4 * (k % 3) + kinds[k / 6], known);
    if (k / 3 % 2 != 0 && play.friction >= 0.0f) {
        play.windup = one_degree;
        play.unwinding = 2.0f;
    }
    return play;
}

float oc_joint_settled_s(void) {
    return single_until_s;
}

static int32_t best_of(const oc_joint *joint) {
    int32_t best = joint->best;
    for (int32_t k = 0; k < joint->count; ++k) {
        const oc_hypothesis *h = &joint->hypotheses[k];
        if (oc_hypothesis_counts(h, &joint->second) &&
            h->cost + h->prior_cost < joint->hypotheses[best].cost + joint->hypotheses[best].prior_cost) {
            best = k;
        }
    }
    return best;
}

/* Whether both have converged to the same parameters. */
static bool are_alike(const oc_hypothesis *a, const oc_hypothesis *b) {
    return fabsf(a->play.half_width - b->play.half_width) < same_place &&
           fabsf(a->play.windup - b->play.windup) < same_place && fabsf(a->offset - b->offset) < same_place &&
           (a->play.friction < 0.0f) == (b->play.friction < 0.0f) &&
           a->wanders == b->wanders && a->walks == b->walks;
}

/* The worst hypothesis if it is to be rejected, else one like the best; -1: none. */
static int32_t redundant(const oc_joint *joint) {
    int32_t worst = joint->best;
    for (int32_t k = 0; k < joint->count; ++k) {
        const oc_hypothesis *h = &joint->hypotheses[k];
        if (oc_hypothesis_counts(h, &joint->second) && h->cost > joint->hypotheses[worst].cost) {
            worst = k;
        }
    }
    if (joint->hypotheses[worst].cost > joint->hypotheses[joint->best].cost + (float)OC_JOINT_REJECT_COST) {
        return worst;
    }
    for (int32_t k = 0; k < joint->count; ++k) {
        const oc_hypothesis *h = &joint->hypotheses[k];
        if (k != joint->best && oc_hypothesis_counts(h, &joint->second) &&
            are_alike(h, &joint->hypotheses[joint->best])) {
            return k;
        }
    }
    return -1;
}

/* The last one moves to its place. No effect where k is negative. */
static void remove_hypothesis(oc_joint *joint, int32_t k) {
    const int32_t last = joint->count - 1;
    if (k < 0) {
        return;
    }
    joint->hypotheses[k] = joint->hypotheses[last];
    joint->best = joint->best == last ? k : joint->best;
    joint->count = last;
}

/* After a day of lateral force a new hypothesis counts from zero, since a sum in single precision would stall. */
static float flank_time_before(float loaded_s) {
    return loaded_s < 1e5f ? loaded_s : 0.0f;
}

/* Whether a hypothesis like the best, not yet rejected, makes the opposite assumption: the accelerometer's zero is a
 * random walk, or constant. */
static bool has_counterpart(const oc_joint *joint) {
    const oc_hypothesis *best = &joint->hypotheses[joint->best];
    for (int32_t k = 0; k < joint->count; ++k) {
        const oc_hypothesis *h = &joint->hypotheses[k];
        if (h->wanders != best->wanders && h->walks == best->walks &&
            h->cost < best->cost + (float)OC_JOINT_REJECT_COST) {
            return true;
        }
    }
    return false;
}

/* Starts a copy of the best hypothesis with the opposite assumption about the accelerometer's zero. Without it 267 of
 * the 286 are right. */
static void start_counterpart(oc_joint *joint) {
    if (joint->count == OC_JOINT_HYPOTHESES || has_counterpart(joint)) {
        return;
    }
    oc_hypothesis *h = &joint->hypotheses[joint->count];
    ++joint->count;
    *h = joint->hypotheses[joint->best];
    h->wanders = !h->wanders;
    h->cost += h->wanders ? assumption_cost : 0.0f;
}

/* Whether the offset walks is decided after an alarm, or where the errors of a long block have one sign. A
 * hypothesis that says so costs time, so that a drive without such a sign has none. Without it 15 of 32 intervals of
 * sensors that slip hold, 28 with it, and none is named, 18 with it (bench/drives_that_differ.py). */
static void start_walker(oc_joint *joint) {
    const oc_hypothesis *best = &joint->hypotheses[joint->best];
    const bool errs = best->long_blocks.factor > walk_factor && !best->wanders;
    if (!(joint->alarmed || errs) || joint->count == OC_JOINT_HYPOTHESES) {
        return;
    }
    joint->alarmed = 0;
    for (int32_t k = 0; k < joint->count; ++k) {
        if (joint->hypotheses[k].walks) {
            return;
        }
    }
    oc_hypothesis *h = &joint->hypotheses[joint->count];
    ++joint->count;
    *h = joint->hypotheses[joint->best];
    h->walks = 1;
    h->long_blocks.factor = h->blocks.factor;
    h->cost += assumption_cost;
}

/* A free place, else that of the worst hypothesis; -1 where none is worse than a play that has changed. */
static int32_t place_of_worst(oc_joint *joint) {
    int32_t worst = joint->best;
    if (joint->count < OC_JOINT_HYPOTHESES) {
        return joint->count++;
    }
    for (int32_t k = 0; k < joint->count; ++k) {
        worst = joint->hypotheses[k].cost > joint->hypotheses[worst].cost ? k : worst;
    }
    return joint->hypotheses[worst].cost > joint->hypotheses[joint->best].cost + play_cost ? worst : -1;
}

void oc_joint_open_play(oc_joint *joint, const oc_known_truck *known) {
    if (!(joint->second.used_s > single_until_s)) { /* until then all widths are among the hypotheses */
        return;
    }
    for (int32_t width = 0; width < OC_JOINT_HYPOTHESES / 4; ++width) {
        const int32_t k = place_of_worst(joint);
        if (k < 0) {
            return;
        }
        joint->hypotheses[k] = joint->hypotheses[joint->best];
        joint->hypotheses[k].cost += play_cost;
        joint->hypotheses[k].walks = 0; /* an alarm starts one whose offset walks */
        const oc_play creeping = oc_joint_start_of(4 * width + 2, known);
        oc_hypothesis_change_play(&joint->hypotheses[k], &creeping);
    }
}

/* Starts a new hypothesis at intervals, later half as often, since all early ones may have converged to a wrong play:
 * without it 12 of 40 drives of `self_correction`, 8 of `wrong_side`, 7 of `lift_axle` and of `active_return` lose a
 * right answer (bench/flanks.py). Removes one redundant hypothesis each time, later two. */
static void replace_redundant(oc_joint *joint, const oc_known_truck *known) {
    const bool later = joint->second.used_s > single_until_s;
    const bool begins = joint->second.used_s < 2.0f * single_until_s || joint->second.long_blocks % 2 == 0;
    const int32_t replaced = redundant(joint);
    if (begins && (replaced >= 0 || joint->count < OC_JOINT_HYPOTHESES)) { /* in its place, to save a copy */
        const oc_play play = later_start_of(joint->next_start, known);
        oc_hypothesis *h = &joint->hypotheses[replaced >= 0 ? replaced : joint->count++];
        joint->next_start = (joint->next_start + 1) % OC_JOINT_LATER_STARTS;
        const int32_t wanders = joint->hypotheses[joint->best].wanders, walks = joint->hypotheses[joint->best].walks;
        oc_hypothesis_start(h, &play, (double)joint->hypotheses[joint->best].places.inner);
        h->wanders = wanders;
        h->walks = walks;
        h->left_before = flank_time_before(joint->loaded_left_s);
        h->right_before = flank_time_before(joint->loaded_right_s);
    } else {
        remove_hypothesis(joint, replaced);
    }
    if (later) {
        remove_hypothesis(joint, redundant(joint));
    }
    start_walker(joint);
    start_counterpart(joint);
}

/* At the end of a long block: a walk is proved where it went far, and predicts much better than all that stay. In its
 * first blocks it catches up with what was slow before. */
static void prove_walk(const oc_joint *joint, oc_hypothesis *h) {
    if (h->walks < OC_WALK_SETTLED) {
        h->began = h->offset;
        ++h->walks;
    } else if (fabsf(h->offset - h->began) > walk_min && h->cost + walk_proof < joint->second.best_cost) {
        h->walks = OC_WALK_PROVED;
    }
}

static void prove_walks(oc_joint *joint) {
    for (int32_t k = 0; k < joint->count; ++k) {
        oc_hypothesis *h = &joint->hypotheses[k];
        if (h->walks != 0 && h->walks != OC_WALK_PROVED) {
            prove_walk(joint, h);
        }
    }
}

float oc_joint_memory(const oc_joint *joint, const oc_joint_design *design) {
    const float first = 60.0f + 0.5f * joint->second.used_s;
    return oc_min(first, design->memory_s);
}

void oc_joint_end_second(oc_joint *joint, const oc_joint_design *design) {
    oc_second *second = &joint->second;
    const float noise_min = 0.05f * one_degree;
    joint->best = best_of(joint);
    second->best_cost = joint->hypotheses[joint->best].cost;
    const float noise = oc_hypothesis_noise(&joint->hypotheses[joint->best]);
    second->reference = noise > noise_min * noise_min ? noise : noise_min * noise_min;
    second->used_s += second->second_s;
    second->probation_s = oc_clamp(0.05f * second->used_s, 60.0f, 600.0f);
    if (second->long_block_ends) {
        prove_walks(joint);
        replace_redundant(joint, &design->hypothesis.known);
    }
    second->blocks += second->block_ends;
    second->long_blocks += second->long_block_ends;
    joint->in_block = second->block_ends ? 0 : joint->in_block + 1;
    joint->in_long_block = second->long_block_ends ? 0 : joint->in_long_block + 1;
    second->block_ends = joint->in_block + 1 == OC_SECONDS_PER_BLOCK;
    second->long_block_ends = joint->in_long_block + 1 == OC_SECONDS_PER_LONG_BLOCK;
    second->memory_share = 1.0f - second->second_s / oc_joint_memory(joint, design);
}

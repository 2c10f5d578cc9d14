#include "signal_pair.h"

#include <math.h>

#include "bounds.h"

enum { MEANS = OC_MEAN_RING - 1, PAIR_STEPS_NEEDED = 2 * OC_LAGS + 7 };

/* Numerical. */
static const float no_motion = 1e-12f; /* (m/s^2)^2, against a division by zero */

/* Tuned, in tuned.toml: signal_pair */
static const float side_acceleration = 0.25f; /* m/s^2: minimum lateral acceleration that has a side */
static const float motion_max = 12.0f; /* (m/s^2)^2: sum of squared changes at which the sums are halved */
static const float steps_max = 3000.0f; /* number of steps at which the sums are halved */
static const float motion_min = 1.0f; /* (m/s^2)^2: minimum sum of squared changes of a comparison */
static const float steps_min = 600.0f; /* minimum number of steps of a comparison */
static const float typical_share = 0.003f; /* share of a step in the mean size of a change: 33 s */
static const float typical_growth = 4.0f; /* maximum of a change in this mean, over the mean */
static const float typical_min = 0.02f; /* m/s^2: the same, for signals at rest */
/* maximum likeness of two signals of different motion, and share of motion in their changes from which they are called
 * so */
static const float unlike = 0.3f;
static const float lag_cost = 0.03f; /* share of the likeness that a lag of a step costs */
static const float distinct = 0.92f; /* maximum likeness 0.4 s beside the lag over that at the lag */
static const float branch_like = 0.08f; /* minimum likeness on each side of a signal without sign */
/* end */

float oc_signal_side(void) {
    return side_acceleration;
}

void oc_witness_add(oc_witness *witness, int32_t place, bool has, float raw, float lateral, float step_s) {
    const int32_t now = place & MEANS;
    float *means = witness->means;
    means[now] = lateral;
    const float later = 0.5f * (means[now] + means[(now - 1) & MEANS]);
    const float earlier = 0.5f * (means[(now - 5) & MEANS] + means[(now - 6) & MEANS]);
    witness->change = later - earlier;
    witness->steps = has ? witness->steps + 1 : 0;
    if (witness->steps > 2) { /* a truck's motion is nearly linear over three steps */
        const float bent = lateral - 2.0f * means[(now - 1) & MEANS] + means[(now - 2) & MEANS];
        const float most = typical_growth * witness->typical + typical_min;
        witness->noise += typical_share * (oc_min(bent * bent / 6.0f, most * most) - witness->noise); /* 1 + 4 + 1 */
    }
    if (has) {
        const float size = fabsf(witness->change), largest = typical_growth * witness->typical + typical_min;
        witness->typical += typical_share * (oc_min(size, largest) - witness->typical);
        witness->low = oc_min(witness->low, raw);
        witness->high = oc_max(witness->high, raw);
        witness->left_s += lateral > side_acceleration ? step_s : 0.0f;
        witness->right_s += lateral < -side_acceleration ? step_s : 0.0f;
    }
}

static void halve_pair(oc_signal_pair *pair) {
    for (int32_t l = 0; l < OC_LAG_COUNT; ++l) {
        pair->products[l] *= 0.5f;
    }
    pair->first *= 0.5f;
    pair->second *= 0.5f;
    pair->slow_first *= 0.5f;
    pair->slow_second *= 0.5f;
    pair->left_of_first *= 0.5f;
    pair->right_of_first *= 0.5f;
    pair->left_of_second *= 0.5f;
    pair->right_of_second *= 0.5f;
    pair->steps *= 0.5f;
    pair->slow_steps *= 0.5f;
    pair->halved = 1;
}

static void add_by_side(float *left, float *right, float side, float product) {
    *left += side > side_acceleration ? product : 0.0f;
    *right += side < -side_acceleration ? product : 0.0f;
}

/* What a step counts: less where one of both moves unusually. */
static float step_weight(const oc_witness *first, const oc_witness *second) {
    const float most = oc_max(fabsf(first->change) / (first->typical + typical_min),
                              fabsf(second->change) / (second->typical + typical_min));
    return most > (float)OC_OUTLIER_SDS ? (float)OC_OUTLIER_SDS / most : 1.0f;
}

/* The middle of the history is compared with all of it. */
void oc_signal_pair_add(oc_signal_pair *pair, const oc_witness *first, const oc_witness *second, int32_t place,
                        bool slow) {
    const float weight = step_weight(first, second);
    pair->firsts[place & MEANS] = weight * first->change;
    const bool compares = first->steps >= PAIR_STEPS_NEEDED && second->steps >= PAIR_STEPS_NEEDED;
    const int32_t middle = (place - OC_LAGS) & MEANS;
    const float x = pair->firsts[middle];
    pair->seconds[pair->oldest] = pair->seconds[pair->oldest + OC_LAG_COUNT] = weight * second->change;
    pair->oldest = pair->oldest + 1 < OC_LAG_COUNT ? pair->oldest + 1 : 0;
    if (!compares) {
        return;
    }
    const float *history = &pair->seconds[pair->oldest]; /* the oldest first */
    for (int32_t l = 0; l < OC_LAG_COUNT; ++l) {
        pair->products[l] += x * history[l];
    }
    const float y = history[OC_LAGS];
    pair->first += x * x;
    pair->second += y * y;
    pair->steps += 1.0f;
    if (slow) {
        pair->slow_first += x * x;
        pair->slow_second += y * y;
        pair->slow_steps += 1.0f;
    }
    add_by_side(&pair->left_of_first, &pair->right_of_first, first->means[middle], x * y);
    add_by_side(&pair->left_of_second, &pair->right_of_second, second->means[middle], x * y);
    if (oc_min(pair->first, pair->second) > motion_max || pair->steps > steps_max) {
        halve_pair(pair);
    }
}

/* A product of the sign at the summit; none outside. */
static float height(const oc_signal_pair *pair, int32_t lag, float sign) {
    return lag < 0 || lag >= OC_LAG_COUNT ? 0.0f : sign * pair->products[lag];
}

/* The lag with the largest product of the same sign, from a lag on its slope. */
static int32_t summit_near(const oc_signal_pair *pair, int32_t lag) {
    const float sign = height(pair, lag, 1.0f) < 0.0f ? -1.0f : 1.0f;
    while (height(pair, lag - 1, sign) > height(pair, lag, sign)) {
        --lag;
    }
    while (height(pair, lag + 1, sign) > height(pair, lag, sign)) {
        ++lag;
    }
    return lag;
}

/* Whether the product falls on both sides of its largest size. */
static bool is_distinct(const oc_signal_pair *pair, int32_t lag) {
    enum { BESIDE = 4 };
    const float limit = distinct * fabsf(pair->products[lag]);
    return lag >= BESIDE && lag < OC_LAG_COUNT - BESIDE && fabsf(pair->products[lag - BESIDE]) < limit &&
           fabsf(pair->products[lag + BESIDE]) < limit;
}

/* A small lag is preferred: a truck that weaves is as like itself, with the other sign, half a period later. */
static int32_t best_lag(const oc_signal_pair *pair) {
    int32_t best = OC_LAGS;
    float best_size = fabsf(pair->products[OC_LAGS]);
    for (int32_t l = 0; l < OC_LAG_COUNT; ++l) {
        const float size = fabsf(pair->products[l]) * (1.0f - lag_cost * fabsf((float)(l - OC_LAGS)));
        best = size > best_size ? l : best;
        best_size = oc_max(size, best_size);
    }
    return summit_near(pair, best);
}

/* Share of a signal's squared changes that is not noise. */
static float motion_of(const oc_witness *witness, float squares, float steps) {
    return oc_clamp(1.0f - witness->noise * steps / (squares + no_motion), 0.0f, 1.0f);
}

void oc_signal_pair_compare(oc_pair_comparison *comparison, const oc_signal_pair *pair, const oc_witness *of_first,
                            const oc_witness *of_second, float step_s) {
    const int32_t best = best_lag(pair);
    const bool slow = pair->slow_steps >= (pair->halved != 0 ? 0.5f : 1.0f) * 0.5f * steps_min &&
                      oc_max(pair->slow_first, pair->slow_second) > motion_min;
    const float first = slow ? pair->slow_first : pair->first, second = slow ? pair->slow_second : pair->second;
    *comparison = (oc_pair_comparison){
        .likeness = pair->products[best] / (sqrtf(pair->first * pair->second) + no_motion),
        .motion = sqrtf(motion_of(of_first, pair->first, pair->steps) *
                        motion_of(of_second, pair->second, pair->steps)),
        .lag_s = (float)(best - OC_LAGS) * step_s,
        .size = sqrtf(first / (second + no_motion)),
        .is_slow = slow,
        .enough = pair->steps >= (pair->halved != 0 ? 0.1f : 1.0f) * steps_min &&
                  oc_max(pair->first, pair->second) > motion_min,
        .has_lag = is_distinct(pair, best),
    };
}

int32_t oc_pair_agreement(const oc_pair_comparison *pair) {
    return !pair->enough || fabsf(pair->likeness) < 0.5f ? 0 : pair->likeness > 0.0f ? 1 : -1;
}

/* Noise in one of them lowers the likeness to the ratio of their sizes, but makes it no smaller than a trusted one. */
bool oc_pair_is_unlike(const oc_pair_comparison *pair, bool trusts_first, bool trusts_second) {
    const float expected = oc_min(pair->size, 1.0f / oc_max(pair->size, no_motion));
    const bool too_small = (trusts_first && pair->size > 1.0f) || (trusts_second && pair->size < 1.0f);
    const bool comparable = expected > unlike || too_small;
    const bool is_motion = pair->motion > unlike;
    return pair->enough && is_motion && comparable &&
           fabsf(pair->likeness) < unlike * pair->motion * oc_max(expected, unlike);
}

bool oc_witness_is_one_sided(const oc_witness *witness) {
    return !(oc_min(witness->high, -witness->low) > 0.0f);
}

bool oc_witness_is_two_sided(const oc_witness *witness) {
    return oc_min(witness->left_s, witness->right_s) > 0.0f;
}

bool oc_pair_is_folded(const oc_signal_pair *pair, float left, float right) {
    const float share = branch_like * sqrtf(pair->first * pair->second);
    return left * right < 0.0f && oc_min(fabsf(left), fabsf(right)) > share;
}

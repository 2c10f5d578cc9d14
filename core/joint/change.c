#include "change.h"

#include <math.h>

#include "bounds.h"

/* Tuned, in tuned.toml: change */
static const float slack = 0.75f; /* subtracted from each error before it is summed */
static const float proof_limit = 10.0f; /* sd s: sum above which a change is proved, after proof_s */
static const float error_max = 6.0f; /* sd: maximum of a second's error, so that one outlier proves no change */
static const float size_min = 0.8f * 0.017453292f; /* rad: minimum size of a change */
static const float curvature_scale = 0.002f; /* 1/m: curvature from which on all bends have the same weight */
static const float pause_after_change_s = 60.0f; /* s: no change is suspected after one: the evidence settles */
static const float proof_s = 40.0f; /* s: minimum duration; a shorter disturbance is no change */
static const float sd_min = 0.5f * 0.017453292f; /* rad: minimum of the usual error: the effect of passing wind */
/* end */

static void accumulate(oc_cusum *sums, float error) {
    /* twice the limit at most, so that a sum decays soon after a change */
    sums->up = oc_clamp_size(sums->up + error - slack, 2.0f * proof_limit);
    sums->down = oc_clamp_size(sums->down - error - slack, 2.0f * proof_limit);
    sums->seconds_up += 1.0f;
    sums->seconds_down += 1.0f;
    if (!(sums->up > 0.0f)) {
        sums->up = sums->seconds_up = 0.0f;
    }
    if (!(sums->down > 0.0f)) {
        sums->down = sums->seconds_down = 0.0f;
    }
}

static float higher_sum(const oc_cusum *sums) {
    return oc_max(sums->up, sums->down);
}

static float duration_of(const oc_cusum *sums) {
    return sums->up > sums->down ? sums->seconds_up : sums->seconds_down;
}

void oc_change_settle(oc_change_watch *watch) {
    *watch = (oc_change_watch){.pause_s = oc_max(watch->pause_s, 0.5f * proof_s)};
}

bool oc_change_suspected(const oc_change_watch *watch) {
    return oc_max(higher_sum(&watch->offset), higher_sum(&watch->bends)) > 0.5f * proof_limit;
}

/* A constant error, or one proportional to curvature, by which explains more of the squared errors. */
static oc_change classify(const oc_change_watch *watch, float sd) {
    const float by_offset = watch->error * watch->error / watch->seconds;
    const float by_bends = watch->curvature_squares > 10.0f * curvature_scale * curvature_scale
                                ? watch->error_curvature * watch->error_curvature / watch->curvature_squares
                                : 0.0f;
    oc_change change = {
        .kind = by_bends > by_offset ? OC_CHANGE_BENDS : OC_CHANGE_OFFSET,
        .size = watch->error / watch->seconds,
        .size_sd = sd / sqrtf(watch->seconds),
    };
    const float explained = by_bends > by_offset ? by_bends : by_offset;
    const float size = by_bends > by_offset
                            ? watch->error_curvature / watch->curvature_squares * curvature_scale
                            : change.size;
    if (explained < 16.0f * sd * sd || fabsf(size) < size_min) {
        change.kind = OC_CHANGE_NONE;
    }
    return change;
}

oc_change oc_change_update(oc_change_watch *watch, float error, float min_error, float noise_sd, float curvature,
                           float weight) {
    const float sd = oc_max(noise_sd, sd_min);
    if (watch->pause_s > 0.0f) {
        watch->pause_s -= 1.0f;
        return (oc_change){0};
    }
    const float relative = oc_clamp_size(sqrtf(weight) * min_error / sd, error_max);
    accumulate(&watch->offset, relative);
    accumulate(&watch->bends, relative * oc_clamp_size(curvature / curvature_scale, 1.0f));
    if (!oc_change_suspected(watch)) {
        watch->seconds = watch->error = watch->error_curvature = watch->curvature_squares = 0.0f;
        return (oc_change){0};
    }
    watch->seconds += weight;
    watch->error += weight * error;
    watch->error_curvature += weight * error * curvature;
    watch->curvature_squares += weight * curvature * curvature;
    const float offset = higher_sum(&watch->offset), bends = higher_sum(&watch->bends);
    if ((offset < proof_limit && bends < proof_limit) || watch->seconds < proof_s) {
        return (oc_change){0};
    }
    oc_change change = classify(watch, sd);
    change.seconds = duration_of(offset > bends ? &watch->offset : &watch->bends);
    *watch = (oc_change_watch){.pause_s = pause_after_change_s};
    return change;
}

#include "change.h"

#include <math.h>

#include "bounds.h"

/* In units of usual errors, a second each. */
static const float tolerated = 0.75f;
static const float suspicious = 5.0f;
static const float proven = 10.0f;
static const float highest = 20.0f;           /* lest what has passed stay proven */
static const float error_max = 6.0f;          /* one wild second proves nothing */
static const float curvature_scale = 0.002f;  /* 1/m: from here on a bend tells as much as any */
static const float rest_s = 60.0f;            /* for what was learned anew, or was not to be doubted */
static const float proof_s = 40.0f;           /* what passes sooner is no change */
static const float size_min = 0.8f * 0.017453292f; /* rad: less is left to forgetting */

static void accumulate(oc_cusum *sums, float error) {
    sums->up = oc_clamp_size(sums->up + error - tolerated, highest);
    sums->down = oc_clamp_size(sums->down - error - tolerated, highest);
    sums->seconds_up += 1.0f;
    sums->seconds_down += 1.0f;
    if (!(sums->up > 0.0f)) {
        sums->up = sums->seconds_up = 0.0f;
    }
    if (!(sums->down > 0.0f)) {
        sums->down = sums->seconds_down = 0.0f;
    }
}

static float height(const oc_cusum *sums) {
    return oc_max(sums->up, sums->down);
}

static float age(const oc_cusum *sums) {
    return sums->up > sums->down ? sums->seconds_up : sums->seconds_down;
}

bool oc_change_suspected(const oc_change_watch *watch) {
    return height(&watch->offset) > suspicious || height(&watch->bends) > suspicious;
}

/* An error that is the same at all times, or one that goes with curvature, whichever takes away more. */
static oc_change judged(const oc_change_watch *watch, float usual) {
    const float by_offset = watch->error * watch->error / watch->seconds;
    const float by_bends = watch->curvature_squares > 10.0f * curvature_scale * curvature_scale
                                ? watch->error_curvature * watch->error_curvature / watch->curvature_squares
                                : 0.0f;
    oc_change change = {
        .kind = by_bends > by_offset ? OC_CHANGE_BENDS : OC_CHANGE_OFFSET,
        .size = watch->error / watch->seconds,
        .size_sd = usual / sqrtf(watch->seconds),
    };
    const float taken = by_bends > by_offset ? by_bends : by_offset;
    const float size = by_bends > by_offset
                            ? watch->error_curvature / watch->curvature_squares * curvature_scale
                            : change.size;
    if (taken < 16.0f * usual * usual || fabsf(size) < size_min) {
        change.kind = OC_CHANGE_NONE;
    }
    return change;
}

oc_change oc_change_update(oc_change_watch *watch, float error, float least, float usual, float curvature) {
    if (watch->rest > 0.0f) {
        watch->rest -= 1.0f;
        return (oc_change){0};
    }
    const float relative = oc_clamp_size(least / usual, error_max);
    accumulate(&watch->offset, relative);
    accumulate(&watch->bends, relative * oc_clamp_size(curvature / curvature_scale, 1.0f));
    if (!oc_change_suspected(watch)) {
        watch->seconds = watch->error = watch->error_curvature = watch->curvature_squares = 0.0f;
        return (oc_change){0};
    }
    watch->seconds += 1.0f;
    watch->error += error;
    watch->error_curvature += error * curvature;
    watch->curvature_squares += curvature * curvature;
    const float offset = height(&watch->offset), bends = height(&watch->bends);
    if ((offset < proven && bends < proven) || watch->seconds < proof_s) {
        return (oc_change){0};
    }
    oc_change change = judged(watch, usual);
    change.seconds = age(offset > bends ? &watch->offset : &watch->bends);
    *watch = (oc_change_watch){.rest = rest_s};
    return change;
}

#include "change.h"

#include <math.h>

/* In units of usual errors, a second each. */
static const double tolerated = 0.75;
static const double suspicious = 5.0;
static const double proven = 10.0;
static const double highest = 20.0;           /* lest what has passed stay proven */
static const double error_max = 6.0;          /* one wild second proves nothing */
static const double curvature_scale = 0.002;  /* 1/m: from here on a bend tells as much as any */
static const double rest_s = 60.0;            /* for what was learned anew, or was not to be doubted */
static const double proof_s = 40.0;           /* what passes sooner is no change */
static const double size_min = 0.8 * 0.017453292519943295; /* rad: less is left to forgetting */

static double bounded(double value, double limit) {
    if (value < -limit) {
        return -limit;
    }
    return value > limit ? limit : value;
}

static void accumulate(oc_cusum *sums, double error) {
    sums->up = bounded(sums->up + error - tolerated, highest);
    sums->down = bounded(sums->down - error - tolerated, highest);
    sums->seconds_up += 1.0;
    sums->seconds_down += 1.0;
    if (!(sums->up > 0.0)) {
        sums->up = sums->seconds_up = 0.0;
    }
    if (!(sums->down > 0.0)) {
        sums->down = sums->seconds_down = 0.0;
    }
}

static double height(const oc_cusum *sums) {
    return sums->up > sums->down ? sums->up : sums->down;
}

static double age(const oc_cusum *sums) {
    return sums->up > sums->down ? sums->seconds_up : sums->seconds_down;
}

bool oc_change_suspected(const oc_change_watch *watch) {
    return height(&watch->offset) > suspicious || height(&watch->bends) > suspicious;
}

/* An error that is the same at all times, or one that goes with curvature, whichever takes away more. */
static oc_change judged(const oc_change_watch *watch, double usual) {
    const double by_offset = watch->error * watch->error / watch->seconds;
    const double by_bends = watch->curvature_squares > 10.0 * curvature_scale * curvature_scale
                                ? watch->error_curvature * watch->error_curvature / watch->curvature_squares
                                : 0.0;
    oc_change change = {
        .kind = by_bends > by_offset ? OC_CHANGE_BENDS : OC_CHANGE_OFFSET,
        .size = watch->error / watch->seconds,
        .size_sd = usual / sqrt(watch->seconds),
    };
    const double taken = by_bends > by_offset ? by_bends : by_offset;
    const double size = by_bends > by_offset
                            ? watch->error_curvature / watch->curvature_squares * curvature_scale
                            : change.size;
    if (taken < 16.0 * usual * usual || fabs(size) < size_min) {
        change.kind = OC_CHANGE_NONE;
    }
    return change;
}

oc_change oc_change_update(oc_change_watch *watch, double error, double usual, double curvature) {
    if (watch->rest > 0.0) {
        watch->rest -= 1.0;
        return (oc_change){0};
    }
    const double relative = bounded(error / usual, error_max);
    accumulate(&watch->offset, relative);
    accumulate(&watch->bends, relative * bounded(curvature / curvature_scale, 1.0));
    if (!oc_change_suspected(watch)) {
        watch->seconds = watch->error = watch->error_curvature = watch->curvature_squares = 0.0;
        return (oc_change){0};
    }
    watch->seconds += 1.0;
    watch->error += error;
    watch->error_curvature += error * curvature;
    watch->curvature_squares += curvature * curvature;
    const double offset = height(&watch->offset), bends = height(&watch->bends);
    if ((offset < proven && bends < proven) || watch->seconds < proof_s) {
        return (oc_change){0};
    }
    oc_change change = judged(watch, usual);
    change.seconds = age(offset > bends ? &watch->offset : &watch->bends);
    *watch = (oc_change_watch){.rest = rest_s};
    return change;
}

#include "signal_level.h"

#include <math.h>

#include "bounds.h"

/* Tuned, in tuned.toml: signal_level */
static const float level_means = 120.0f; /* memory of the means over 0.5 s, in means */
static const float noise_share = 0.7f; /* share of the differences of successive means in the variance of a noise */
static const float stuck_s = 10.0f; /* s: minimum time of a stuck value */
static const float followed_s = 0.6f; /* s: after which the others have followed the signal to its last value */
static const float alone_varied_s = 60.0f; /* s: minimum time of changing values before */
/* number of times that is no chance: in which a signal misses a change, or an angle jumps by a turn */
static const float missed_times = 5.0f;
static const float same_end = 0.01f; /* share of a value within which two ends of a range are the same */
/* end */

/* Whether a signal that does not change misses a change that others show. */
static bool misses_change(const oc_signal_level *level, const oc_signal_watch *watch, float missed_min) {
    return level->steps > 0.0f && level->high - level->low > missed_min + 2.0f * oc_signal_resolution(watch);
}

static void note_missed(oc_signal_level *level) {
    const float apart = fabsf(fabsf(level->held_value) - fabsf(level->missed_value));
    level->missed_there += apart <= same_end * fabsf(level->held_value) ? 1.0f : 0.0f;
    level->missed += 1.0f;
    level->missed_value = level->held_value;
}

/* The longest time at one value before this one; a vehicle may stand for hours. */
static void follow_held(oc_signal_level *level, float value, float held_s, float step_s) {
    const bool changes = held_s < step_s && value != 0.0f;
    level->held_max_s = changes ? oc_max(level->held_max_s, level->held_s) : level->held_max_s;
    level->held_s = value != 0.0f ? held_s : 0.0f;
    level->varied_s += changes ? step_s : 0.0f;
    if (level->varied_s > oc_signal_memory_s()) {
        level->varied_s *= 0.5f;
        level->missed *= 0.5f;
        level->missed_there *= 0.5f;
    }
}

void oc_signal_level_follow(oc_signal_level *level, const oc_signal_watch *watch, float held_s, float step_s,
                            bool has_prediction, float prediction, float missed_min) {
    const bool held_long = level->held_s > 2.0f * followed_s; /* until this step */
    follow_held(level, watch->last, held_s, step_s);
    if (held_s < step_s) {
        if (held_long && misses_change(level, watch, missed_min)) {
            note_missed(level);
        }
        level->steps = 0.0f;
    }
    if (!has_prediction || held_s < followed_s) {
        return;
    }
    level->held_value = watch->last;
    const bool begins = !(level->steps > 0.0f);
    const float innovation = prediction - level->prediction;
    level->prediction = begins ? prediction : level->prediction + innovation * step_s / (2.0f * followed_s);
    level->low = begins ? level->prediction : oc_min(level->low, level->prediction);
    level->high = begins ? level->prediction : oc_max(level->high, level->prediction);
    level->steps += 1.0f;
}

void oc_signal_level_add(oc_signal_level *level, float mean) {
    const float difference = mean - level->last, innovation = mean - level->mean;
    level->means = oc_min(level->means + 1.0f, level_means);
    level->last = mean;
    level->mean += innovation / level->means;
    level->variance += (innovation * innovation - level->variance) / level->means;
    level->half_squares += (0.5f * difference * difference - level->half_squares) / level->means;
}

bool oc_signal_is_stuck(const oc_signal_level *level, const oc_signal_watch *watch, float held_s, float step_s,
                        float missed_min, bool alone) {
    if (alone && held_s > 2.0f * stuck_s && level->held_max_s < 1.0f && level->varied_s > alone_varied_s) {
        return true;
    }
    const bool long_enough = held_s >= stuck_s && level->steps * step_s >= stuck_s - followed_s;
    return long_enough && misses_change(level, watch, missed_min);
}

float oc_signal_stuck_s(void) {
    return stuck_s;
}

float oc_signal_same_end(void) {
    return same_end;
}

float oc_signal_often(void) {
    return missed_times;
}

bool oc_signal_misses(const oc_signal_level *level) {
    return level->missed >= missed_times;
}

bool oc_signal_is_clipped(const oc_signal_level *level) {
    return oc_signal_misses(level) && level->missed_there > 0.5f * level->missed;
}

bool oc_signal_is_noise(const oc_signal_level *level, float noise_min) {
    return level->means >= level_means && level->variance > noise_min * noise_min &&
           level->half_squares > noise_share * level->variance;
}

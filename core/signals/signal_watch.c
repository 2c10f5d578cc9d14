#include "signal_watch.h"

#include <math.h>

#include "bounds.h"

/* Numerical. */
static const float never_changed = 1e9f; /* resolution of a signal that has not changed yet */

/* Tuned, in tuned.toml: signal_watch */
static const float jump_changes = 8.0f; /* minimum of a jump, over the mean change in a tick */
static const float change_s = 20.0f; /* s: memory of the mean change */
static const float abrupt = 5.0f; /* minimum of a jump, over the change in the tick before */
static const float back_share = 0.3f; /* share of a jump by which the way back may differ from it */
static const float same_share = 0.002f; /* share of a jump within which two values are the same */
static const float memory_s = 300.0f; /* s: memory of the jumps, and of missed changes */
static const float landed_share = 0.4f; /* share of these among all jumps; half of the jumps lead back */
static const float filled_share = 0.004f; /* minimum share of the time at this value */
static const float alternate_zeros = 0.35f; /* minimum share of zeros, where every second sample is filled */
static const float jumps_min = 20.0f; /* minimum number of jumps that no truck makes */
static const float jumps_per_s = 0.1f; /* 1/s: the same, in the mean; share of the time with values that no truck has */
/* end */

float oc_signal_memory_s(void) {
    return memory_s;
}

float oc_signal_resolution(const oc_signal_watch *w) {
    return w->resolution < never_changed ? w->resolution : 0.0f;
}

void oc_signal_watch_begin(oc_signal_watch *w, float value, float jump_min) {
    *w = (oc_signal_watch){.last = value,
                           .before_last = value,
                           .filled = value,
                           .jump = jump_min,
                           .resolution = never_changed,
                           .alternation = 1.0f};
}

/* A value that more jumps miss than hit is replaced. */
static void land(oc_signal_watch *w, float value, float jump) {
    const float apart = fabsf(value - w->before_last);
    w->resolution = apart > 0.0f ? oc_min(apart, w->resolution) : w->resolution;
    w->jumped = jump;
    if (fabsf(value - w->filled) <= same_share * jump) {
        w->landed += 1.0f;
        return;
    }
    w->missed += 1.0f;
    if (w->missed > w->landed + 2.0f) {
        w->filled = value;
        w->landed = w->missed = w->filled_s = 0.0f;
    }
}

/* A jump begins from rest, or goes back: a hand that turns fast does neither. */
static bool is_abrupt(float change, float before) {
    return fabsf(change) > abrupt * fabsf(before) || fabsf(change + before) < back_share * fabsf(change);
}

/* 1; 0 if the ticks at the value before explain it, as of a slow signal; less the jump before at the end of a spike. */
static float jumps_counted(const oc_signal_watch *w, float value, float impossible) {
    const float moved = fabsf(value - w->last);
    const bool is_back = fabsf(value - w->before_last) < back_share * moved;
    return moved <= impossible * (float)(1 + w->held_ticks) ? 0.0f : is_back && w->counted > 0.0f ? -1.0f : 1.0f;
}

static void jump_to(oc_signal_watch *w, float value, float change, float impossible) {
    const float moved = fabsf(change);
    if (is_abrupt(change, w->last - w->before_last)) {
        land(w, value, moved);
        w->counted = jumps_counted(w, value, impossible);
        w->jumps += w->counted;
    }
    w->jumped_in_step += moved;
}

void oc_signal_watch_update(oc_signal_watch *w, float value, float impossible) {
    const float change = value - w->last, moved = fabsf(change);
    w->moved_by_two += fabsf(value - w->before_last);
    if (moved > w->jump) {
        jump_to(w, value, change, impossible);
    } else {
        w->moved += moved;
    }
    w->held_ticks = moved > 0.0f ? 0 : w->held_ticks + 1;
    w->before_last = w->last;
    w->last = value;
}

/* At the last two ticks, since every second sample may be filled. */
static float share_at(const oc_signal_watch *w, float value) {
    return 0.5f * ((w->last == value ? 1.0f : 0.0f) + (w->before_last == value ? 1.0f : 0.0f));
}

static void forget(oc_signal_watch *w) {
    if (w->observed_s > memory_s) {
        w->observed_s *= 0.5f;
        w->impossible_s *= 0.5f;
        w->filled_s *= 0.5f;
        w->landed *= 0.5f;
        w->missed *= 0.5f;
        w->jumps *= 0.5f;
    }
}

void oc_signal_watch_end_step(oc_signal_watch *w, float jump_min, float ticks, float step_s) {
    const float share = step_s / oc_min(w->observed_s + step_s, change_s);
    const float moved = w->moved + w->jumped_in_step;
    if (moved > 0.0f) {
        w->alternation += (w->moved_by_two / moved - w->alternation) * share;
        w->zero_share += (share_at(w, 0.0f) - w->zero_share) * share;
    }
    const float last_change = fabsf(w->last - w->before_last);
    w->resolution = last_change > 0.0f ? oc_min(last_change, w->resolution) : w->resolution;
    w->change += (w->moved / ticks - w->change) * share;
    w->jump = oc_max(oc_max(jump_min, jump_changes * w->change), 2.0f * oc_signal_resolution(w));
    w->observed_s += step_s;
    w->filled_s += w->landed > 0.0f ? share_at(w, w->filled) * step_s : 0.0f;
    w->moved = w->jumped_in_step = w->moved_by_two = 0.0f;
    forget(w);
}

static bool alternates_with_zero(const oc_signal_watch *w) {
    return w->observed_s > change_s && w->alternation < 0.5f && w->zero_share > alternate_zeros;
}

float oc_signal_filled_with(const oc_signal_watch *w) {
    return alternates_with_zero(w) ? 0.0f : w->filled;
}

bool oc_signal_is_filled(const oc_signal_watch *w) {
    const bool often = w->landed >= 0.5f * jumps_min && w->landed >= landed_share * (w->landed + w->missed);
    return alternates_with_zero(w) || (often && w->filled_s >= filled_share * w->observed_s);
}

bool oc_signal_jumps(const oc_signal_watch *w) {
    return (w->jumps >= jumps_min && w->jumps >= jumps_per_s * w->observed_s) ||
           (w->impossible_s > 1.0f && w->impossible_s > jumps_per_s * w->observed_s);
}

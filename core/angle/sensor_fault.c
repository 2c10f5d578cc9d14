#include "sensor_fault.h"

#include <math.h>

#include "bounds.h"

/* Derived. */
static const float rad_in_deg = 0.017453292f; /* pi/180 */

/* Tuned, in tuned.toml: sensor_fault */
/* deg: minimum of the limit of the difference, which is the larger of this and limit_sds */
static const float limit_deg = 10.0f;
static const float limit_sds = 5.5f; /* sd: the limit, in standard deviations of the estimate */
/* of the limit, beyond which a difference is summed, up to as far beyond the limit */
static const float borderline = 0.8f;
static const float fault_s = 0.9f; /* s: sum, in limits, that is a fault */
static const float fault_mean = 0.6f; /* mean difference that is a fault, in limits; the play can mask a lasting one */
static const float suspended_max_s = 60.0f; /* s: maximum time without learning by suspicion */
static const float suspension_recovery = 0.05f; /* of the time within the limit */
static const float same_deg = 0.25f; /* deg: noise of a stuck sensor: smaller changes are none */
static const float still_s = 10.0f; /* s: maximum stillness of a driver at speed, in bends of a few deg */
static const float frozen_s = 30.0f; /* s: maximum stillness of a driver anywhere */
static const float recovered_s = 20.0f; /* s: time well within the limit after which a fault ends */
static const float lost_s = 4.95f; /* s: without signal above 1 m/s; 5 s, less the rounding of summed ticks */
static const float hand_rate_deg_s = 800.0f; /* deg/s: maximum steering rate of a driver */
/* s: until a sensor that is back, a stuck value or the signs of both angles count */
static const float settled_s = 1.0f;
static const float unpaired_factor = 10.0f; /* time that a gap takes from it, over the gap's */
static const float mean_s = 8.0f; /* s: memory of the means that signs are compared about; longer than bends */
static const float noise_deg = 2.0f; /* deg: noise of both angles, in addition to the sd */
static const float reversed_min = 20.0f; /* log of the odds that is a wrong sign */
static const float reversed_rate = 8.0f; /* 1/s: maximum rate of the log of the odds; a kerb's kick is no bend */
static const double onset_s = 3.0; /* s: maximum time from a step or stop to the last small difference */
static const float offset_memory_s = 200.0f; /* s: delay of the offset that the sensor is compared with */
static const float sd_memory_factor = 2.0f; /* growth of the offset's sd is delayed this much more */
static const float drifting_mean = 0.2f; /* mean difference of a possible drift, in limits */
static const float drifting_factor = 4.0f; /* by which the offset is then delayed more */
static const float replaced_s = 300.0f; /* s: constant difference until a faulty sensor counts as remounted */
/* end */

const char *oc_fault_name(oc_fault fault) {
    static const char *const names[OC_FAULT_COUNT] = {"none",     "lost",       "stuck",    "jumped",
                                                      "drifting", "wrong_sign", "remounted"};
    return (unsigned)fault < OC_FAULT_COUNT ? names[fault] : "unknown";
}

static bool excludes_learning(oc_fault fault) {
    return fault == OC_FAULT_STUCK || fault == OC_FAULT_DRIFTING || fault == OC_FAULT_WRONG_SIGN;
}

static void set_fault(oc_fault_watch *w, oc_fault fault, double since, float difference, float sd) {
    const float sds = fabsf(difference) / oc_max(sd, 1e-6f);
    w->fault = fault;
    w->since = since;
    w->confidence = 1.0f - 1.0f / oc_max(sds * sds, 1.0f);
    w->within_s = 0.0f;
}

static void clear_fault(oc_fault_watch *w) {
    w->fault = OC_FAULT_NONE;
    w->left = w->right = w->mean = w->steady_s = 0.0f;
}

/* Detects loss and return of the signal; true while it is missing. */
static bool watch_presence(oc_fault_watch *w, const oc_fault_tick *tick) {
    if (tick->after_hole) {
        w->interruption_time = tick->time;
        w->present_s = w->paired_s = 0.0f;
    }
    if (!tick->has_measured) {
        w->missing_s += tick->speed > 1.0f ? tick->tick_s : 0.0f;
        w->present_s = 0.0f;
        w->interruption_time = tick->time;
        if (w->missing_s > lost_s && w->fault == OC_FAULT_NONE) {
            set_fault(w, OC_FAULT_LOST, tick->time - (double)w->missing_s, 1.0f, 0.0f);
        }
        return true;
    }
    w->present_s += tick->tick_s;
    w->missing_s = 0.0f;
    if (w->fault == OC_FAULT_LOST && w->present_s > settled_s) {
        clear_fault(w);
    }
    return false;
}

/* Whether the angle has changed faster than a driver steers. */
static bool moves_fast(const oc_fault_watch *w, const oc_fault_tick *tick) {
    return fabsf(tick->measured - w->last) > hand_rate_deg_s * rad_in_deg * tick->tick_s;
}

/* Detects steps too fast for a driver. */
static bool watch_steps(oc_fault_watch *w, const oc_fault_tick *tick) {
    const bool returned = w->present_s < 2.0f * tick->tick_s;
    const bool steps = moves_fast(w, tick) && !returned;
    if (steps) {
        w->step_time = tick->time;
        w->paired_s = 0.0f;
    }
    w->last = tick->measured;
    return steps;
}

/* Detects constant values. */
static void watch_value(oc_fault_watch *w, const oc_fault_tick *tick) {
    if (tick->assisted || fabsf(tick->measured - w->held_value) > same_deg * rad_in_deg) {
        w->held_value = tick->measured;
        w->held_estimate = tick->estimate;
        w->held_s = w->held_fast_s = 0.0f;
    }
    w->held_s += tick->judged_s;
}

/* Odds of a reversed sign, by both angles less their means over the last seconds. With a common noise the log of the
 * odds grows by 2 m e / sd^2 for each independent pair, one a second: the estimate's error is correlated so long. */
static void compare_signs(oc_fault_watch *w, const oc_fault_tick *tick) {
    const float share = tick->judged_s / mean_s;
    const float noise = noise_deg * rad_in_deg;
    if (w->paired_s < settled_s) {
        w->mean_measured = tick->measured;
        w->mean_estimate = tick->estimate;
    }
    const float m = tick->measured - w->mean_measured, e = tick->estimate - w->mean_estimate;
    w->mean_measured += share * oc_clamp_size(m, limit_deg * rad_in_deg);
    w->mean_estimate += share * oc_clamp_size(e, limit_deg * rad_in_deg);
    const float agreement = 2.0f * m * e / (tick->sd * tick->sd + noise * noise);
    w->reversed -= oc_clamp_size(agreement, reversed_rate) * tick->judged_s;
    w->reversed = oc_clamp(w->reversed, 0.0f, 2.0f * reversed_min);
    if (w->reversed <= 0.0f) {
        w->last_agreement = tick->time;
    }
}

static bool has_recent_step(const oc_fault_watch *w) {
    return w->step_time > w->last_within - onset_s;
}

static oc_fault fault_kind(const oc_fault_watch *w) {
    if (w->reversed > 0.5f * reversed_min) {
        return OC_FAULT_WRONG_SIGN;
    }
    if (has_recent_step(w)) {
        return OC_FAULT_JUMPED;
    }
    if (w->held_s > settled_s) {
        return OC_FAULT_STUCK;
    }
    if (w->interruption_time > w->last_within - onset_s) {
        return OC_FAULT_REMOUNTED;
    }
    return OC_FAULT_DRIFTING;
}

static float summed(float sum, float share, float weight, float tick_s) {
    const float beyond = share - borderline;
    return oc_max(sum + (beyond < 0.0f ? weight * beyond : beyond) * tick_s, 0.0f);
}

/* A difference below a wide limit reduces the sum less than one below a narrow limit. */
static void sum_excess(oc_fault_watch *w, const oc_fault_tick *tick, float share, float limit) {
    const bool counting = w->left > 0.0f || w->right > 0.0f;
    if (!counting && fabsf(share) <= borderline) {
        return;
    }
    if (!counting) {
        w->suspicious_since = tick->time;
    }
    const float weight = (1.0f + w->limit_growth) * limit_deg * rad_in_deg / limit;
    w->left = summed(w->left, share, weight, tick->judged_s);
    w->right = summed(w->right, -share, weight, tick->judged_s);
}

static void follow_difference(oc_fault_watch *w, const oc_fault_tick *tick, float difference, float limit) {
    const float share = oc_clamp_size(difference / limit, 2.0f - borderline);
    sum_excess(w, tick, share, limit);
    w->mean += (share - w->mean) * tick->judged_s / recovered_s;
    w->exceeds_limit = fabsf(share) > 1.0f;
    if (fabsf(share) < 0.5f) {
        w->last_within = tick->time;
        w->within_s += tick->judged_s;
        w->suspended_s = oc_max(w->suspended_s - suspension_recovery * tick->judged_s, 0.0f);
    } else {
        w->within_s = 0.0f;
        w->suspended_s = oc_min(w->suspended_s + tick->judged_s, suspended_max_s);
    }
}

static bool is_stuck(oc_fault_watch *w, const oc_fault_tick *tick, float limit) {
    const float turned = fabsf(tick->estimate - w->held_estimate);
    const bool misses_bend = w->exceeds_limit && turned > limit && w->held_s > settled_s;
    const bool is_still = w->held_s > still_s && turned > (float)OC_OUTLIER_SDS * tick->sd;
    w->held_fast_s += tick->judged_s;
    w->stuck_s = misses_bend || is_still ? w->stuck_s + tick->judged_s : 0.0f;
    return w->stuck_s > settled_s || w->held_fast_s > frozen_s;
}

static bool follows_truck(const oc_fault_watch *w) {
    return w->held_s < recovered_s && w->reversed < 0.5f * reversed_min;
}

/* rad; with the delayed offset's sd, since the present one grows while the offset follows a drifting sensor. */
static float judged_sd(const oc_fault_watch *w, const oc_fault_tick *tick) {
    const float grown = tick->offset_sd * tick->offset_sd - w->offset_sd * w->offset_sd;
    return grown > 0.0f ? sqrtf(oc_max(tick->sd * tick->sd - grown, 0.0f)) : tick->sd;
}

/* A faulty sensor that follows the truck at a constant difference was replaced or repaired, or its drift has ended. It
 * counts as remounted, and its offset is learned. A second at another difference reduces the steady time, so that a
 * drift resets it. */
static bool is_replaced(oc_fault_watch *w, const oc_fault_tick *tick, float difference, float limit, bool follows) {
    if (!excludes_learning(w->fault)) {
        w->steady_s = 0.0f;
        return false;
    }
    if (!(w->steady_s > 0.0f)) {
        w->steady_difference = difference;
    }
    const bool steady = follows && fabsf(difference - w->steady_difference) < 0.5f * limit;
    w->steady_difference += steady ? (difference - w->steady_difference) * tick->judged_s / (2.0f * replaced_s) : 0.0f;
    w->steady_s = oc_max(w->steady_s + (steady ? tick->judged_s : -tick->judged_s), 0.0f);
    return w->steady_s > replaced_s;
}

static void judge(oc_fault_watch *w, const oc_fault_tick *tick) {
    const float limit = (1.0f + w->limit_growth) * oc_max(limit_deg * rad_in_deg, limit_sds * judged_sd(w, tick)) +
                        limit_deg * rad_in_deg * tick->flank_deficit;
    const float difference = tick->measured - w->offset - tick->estimate;
    follow_difference(w, tick, difference, limit);
    compare_signs(w, tick);
    const bool stuck = is_stuck(w, tick, limit);
    const bool follows = follows_truck(w);
    if (w->fault == OC_FAULT_NONE) {
        if (stuck) {
            set_fault(w, OC_FAULT_STUCK, tick->time - (double)w->held_s, difference, tick->sd);
        } else if (w->reversed > reversed_min) {
            set_fault(w, OC_FAULT_WRONG_SIGN, w->last_agreement, 2.0f * reversed_min, 1.0f);
        } else if (oc_max(w->left, w->right) > (has_recent_step(w) ? 0.5f * fault_s : fault_s)) {
            const oc_fault kind = fault_kind(w);
            set_fault(w, kind, kind == OC_FAULT_JUMPED ? w->step_time : w->suspicious_since, difference, tick->sd);
        } else if (fabsf(w->mean) > fault_mean) {
            set_fault(w, fault_kind(w), tick->time - (double)recovered_s, difference, tick->sd);
        }
    } else if (w->fault != OC_FAULT_LOST && w->fault != OC_FAULT_STUCK && w->reversed > reversed_min) {
        w->fault = OC_FAULT_WRONG_SIGN;
    } else if (is_replaced(w, tick, difference, limit, follows)) {
        w->fault = OC_FAULT_REMOUNTED;
    } else if (w->within_s > recovered_s && follows) {
        if (w->fault == OC_FAULT_DRIFTING) {
            w->limit_growth = oc_min(w->limit_growth + 0.5f, 2.0f); /* the truck has changed */
        }
        clear_fault(w);
    }
}

bool oc_fault_excludes_angle(const oc_fault_watch *w) {
    return w->fault != OC_FAULT_NONE || w->exceeds_limit != 0;
}

bool oc_fault_suspected(const oc_fault_watch *w) {
    const bool differs = w->suspended_s > 0.0f && w->suspended_s < suspended_max_s && w->within_s <= 0.0f;
    return w->reversed > 0.5f * reversed_min || (w->fault == OC_FAULT_NONE && (differs || w->held_fast_s > still_s));
}

/* Delays the learned offset; its sd decreases without delay. */
static void follow_offset(oc_fault_watch *w, const oc_fault_tick *tick) {
    if (excludes_learning(w->fault)) {
        return;
    }
    w->offset_s += tick->judged_s;
    const float later = fabsf(w->mean) > drifting_mean ? drifting_factor : 1.0f;
    const float share = tick->judged_s / oc_min(w->offset_s, later * offset_memory_s);
    const float grown = tick->offset_sd - w->offset_sd;
    w->offset += (tick->offset - w->offset) * share;
    w->offset_sd += grown > 0.0f ? grown * share / sd_memory_factor : grown;
}

static void begin_watch(oc_fault_watch *w, const oc_fault_evidence *kept, const oc_fault_tick *tick) {
    *w = (oc_fault_watch){
        .running = 1,
        .fault = kept->fault,
        .since = tick->time,
        .confidence = kept->confidence,
        .limit_growth = kept->limit_growth,
        .offset = tick->offset,
        .offset_sd = tick->offset_sd,
        .step_time = -1e18,
        .interruption_time = tick->time,
        .last_within = tick->time,
        .last_agreement = tick->time,
        .last = tick->measured,
    };
}

static void watch_sensor(oc_fault_watch *w, const oc_fault_tick *tick) {
    const bool judges = tick->has_measured && tick->can_judge && tick->is_accurate;
    if (tick->judged_s > 0.0f) {
        const float paired_s = w->paired_s + (judges ? tick->judged_s : -unpaired_factor * tick->judged_s);
        w->paired_s = oc_clamp(paired_s, 0.0f, 2.0f * settled_s);
    }
    if (tick->speed < 1.0f) {
        w->interruption_time = tick->time;
    }
    if (watch_presence(w, tick)) {
        return;
    }
    const bool steps = watch_steps(w, tick);
    const bool is_due = tick->judged_s > 0.0f;
    if (!is_due && !steps) { /* a step is judged at once, before the angle uses it */
        return;
    }
    watch_value(w, tick);
    if (tick->can_judge && is_due) {
        follow_offset(w, tick);
    }
    w->exceeds_limit = 0;
    if (judges) {
        judge(w, tick);
    }
}

bool oc_fault_may_judge(const oc_fault_watch *w, const oc_fault_tick *tick) {
    return !w->running || tick->judged_s > 0.0f || moves_fast(w, tick);
}

oc_fault oc_fault_update(oc_fault_watch *w, oc_fault_evidence *kept, const oc_fault_tick *tick) {
    if (!w->running) {
        begin_watch(w, kept, tick);
    }
    watch_sensor(w, tick);
    w->last_time = tick->time;
    *kept = (oc_fault_evidence){.fault = w->fault, .confidence = w->confidence, .limit_growth = w->limit_growth};
    return w->fault;
}

#include "sensor_fault.h"

#include <math.h>

#include "bounds.h"

static const float rad_in_deg = 0.017453292f;
static const float limit_deg = 10.0f, limit_sds = 5.5f; /* the larger of both is the limit */
static const float well = 0.5f;           /* of the limit */
static const float borderline = 0.8f;     /* of the limit: what a healthy sensor's estimate is hardly ever off */
static const float counted_max = 1.2f;    /* of the limit: through a play that is large the estimate lags by a second */
static const float wrong_s = 0.9f;        /* limits x s beyond the borderline: 2.3 s when far off, 4.5 s at the limit */
static const float wrong_after_step_s = 0.5f; /* the same after a step, which no hand makes */
static const float hidden_deg = 10.0f;    /* beyond the limit, where a flank was hardly seen: there may be more play */
static const float wrong_mean = 0.6f;     /* of the limit: hidden now and then by a flank of the play, but it lasts */
static const float mean_of_s = 20.0f;
static const float suspended_max_s = 60.0f; /* then the truck is believed to have changed, not the sensor; */
static const float regained = 0.05f;      /* of the time: a flank of the play seen now and then must be learned */
static const float wider = 0.5f;          /* of the limit, for each drift that went away: the truck is not as learned */
static const float wider_max = 2.0f;
static const float stuck_min_s = 1.0f;
static const float same_deg = 0.25f;      /* a stuck sensor's noise */
static const float still_s = 10.0f;       /* at speed no hand is so still through bends of a few deg; */
static const float still_sds = 3.0f, still_deg = 4.0f;
static const float frozen_s = 30.0f;      /* nor so long anywhere */
static const float healed_s = 20.0f;
static const float lost_s = 0.1f, back_s = 1.0f;
static const float judging_speed = 8.0f;  /* m/s */
static const float step_deg = 8.0f, hand_rate_deg_s = 800.0f;
static const float settled_s = 1.0f;      /* after a hole, or a step of both, one of which the filter is behind */
static const float alike_max_s = 2.0f, unlike_factor = 10.0f; /* so that 0.1 s of a hole begins anew */
static const float mean_s = 8.0f;         /* bends are shorter */
static const float noise_deg = 2.0f;      /* of measured and estimate, where the sd would say less */
static const float flipped_min = 20.0f;   /* log of the odds */
static const float flipped_some = 5.0f;   /* the same, of no bend but now and then */
static const float flipped_rate = 8.0f;   /* of it, 1/s: a kick of either is no bend, however far */
static const float kick_max_deg = 10.0f;  /* that a mean follows: more, and the end of a kick would be a bend */
static const float fades_s = 1.0f;   /* errors of the estimate last so long */
static const double sudden_s = 3.0;
static const float offset_memory_s = 200.0f;
static const float sd_memory_factor = 2.0f;
static const float leaning = 0.2f;        /* of the limit, in the mean: what may be a drift */
static const float leaning_factor = 4.0f; /* is followed so much later */
static const float replaced_s = 300.0f;   /* over which a sensor that was at fault goes with the truck, as far apart */
static const float undone = 5.0f;         /* s of it, by a second elsewhere: kicks pass, drifts stay away */
static const float apart_mean_s = 600.0f; /* so long that it stays behind a drift */

const char *oc_fault_name(oc_fault fault) {
    static const char *const names[OC_FAULT_COUNT] = {"none",     "lost",       "stuck",    "jumped",
                                                      "drifting", "wrong_sign", "remounted"};
    return (unsigned)fault < OC_FAULT_COUNT ? names[fault] : "unknown";
}

static float no_further_than(float value, float most) {
    const float size = oc_min(fabsf(value), most);
    return value < 0.0f ? -size : size;
}

static bool teaches_nothing(oc_fault fault) {
    return fault == OC_FAULT_STUCK || fault == OC_FAULT_DRIFTING || fault == OC_FAULT_WRONG_SIGN;
}

static void name_it(oc_fault_watch *w, oc_fault fault, double since, float difference, float sd) {
    const float sds = fabsf(difference) / oc_max(sd, 1e-6f);
    w->fault = fault;
    w->since = since;
    w->confidence = 1.0f - 1.0f / oc_max(sds * sds, 1.0f);
    w->well_s = 0.0f;
}

static void acquit(oc_fault_watch *w) {
    w->fault = OC_FAULT_NONE;
    w->left = w->right = w->mean = w->steady_s = 0.0f;
}

/* A signal that goes away, and comes back. True while there is none. */
static bool is_missing(oc_fault_watch *w, const oc_fault_tick *tick) {
    if (tick->after_hole) {
        w->interruption_time = tick->time;
        w->present_s = w->alike_s = 0.0f;
    }
    if (!tick->has_measured) {
        w->missing_s += tick->tick_s;
        w->present_s = 0.0f;
        w->interruption_time = tick->time;
        if (w->missing_s > lost_s && w->fault == OC_FAULT_NONE) {
            name_it(w, OC_FAULT_LOST, tick->time - (double)w->missing_s, 1.0f, 0.0f);
        }
        return true;
    }
    w->present_s += tick->tick_s;
    w->missing_s = 0.0f;
    if (w->fault == OC_FAULT_LOST && w->present_s > back_s) {
        acquit(w);
    }
    return false;
}

/* How the measured value goes: steps that no hand makes, for which it is true, and values that stay. */
static bool follow(oc_fault_watch *w, const oc_fault_tick *tick) {
    const float moved = fabsf(tick->measured - w->last);
    const bool returned = w->present_s < 2.0f * tick->tick_s;
    const bool steps = moved > step_deg * rad_in_deg && moved > hand_rate_deg_s * rad_in_deg * tick->tick_s;
    if (steps && !returned) {
        w->step_time = tick->time;
        w->alike_s = 0.0f;
    }
    w->last = tick->measured;
    if (fabsf(tick->measured - w->held_value) > same_deg * rad_in_deg) {
        w->held_value = tick->measured;
        w->held_estimate = tick->estimate;
        w->held_s = w->held_fast_s = 0.0f;
    }
    w->held_s += tick->tick_s;
    return steps && !returned;
}

/* Odds of left being right, by what both do about their means of the last seconds: with one noise the log of the odds
 * grows by 2 m e / sd^2 for each independent pair of them. */
static void compare_signs(oc_fault_watch *w, const oc_fault_tick *tick) {
    const float share = tick->judged_s / mean_s;
    const float noise = noise_deg * rad_in_deg;
    if (w->alike_s < settled_s) {
        w->mean_measured = tick->measured;
        w->mean_estimate = tick->estimate;
    }
    const float m = tick->measured - w->mean_measured, e = tick->estimate - w->mean_estimate;
    w->mean_measured += share * no_further_than(m, kick_max_deg * rad_in_deg);
    w->mean_estimate += share * no_further_than(e, kick_max_deg * rad_in_deg);
    const float right = 2.0f * m * e / (tick->sd * tick->sd + noise * noise) / fades_s;
    w->flipped -= no_further_than(right, flipped_rate) * tick->judged_s;
    w->flipped = oc_min(oc_max(w->flipped, 0.0f), 2.0f * flipped_min);
    if (w->flipped <= 0.0f) {
        w->last_right = tick->time;
    }
}

static bool has_stepped(const oc_fault_watch *w) {
    return w->step_time > w->last_well - sudden_s;
}

static oc_fault kind_of(const oc_fault_watch *w) {
    if (w->flipped > 0.5f * flipped_min) {
        return OC_FAULT_WRONG_SIGN;
    }
    if (has_stepped(w)) {
        return OC_FAULT_JUMPED;
    }
    if (w->held_s > stuck_min_s) {
        return OC_FAULT_STUCK;
    }
    if (w->interruption_time > w->last_well - sudden_s) {
        return OC_FAULT_REMOUNTED;
    }
    return OC_FAULT_DRIFTING;
}

static float counted(float sum, float share, float sure, float tick_s) {
    const float beyond = share - borderline;
    return oc_max(sum + (beyond < 0.0f ? sure * beyond : beyond) * tick_s, 0.0f);
}

/* A difference that is within a wide limit says less for the sensor than one within a narrow one. */
static void count_beyond(oc_fault_watch *w, const oc_fault_tick *tick, float share, float limit) {
    const bool counting = w->left > 0.0f || w->right > 0.0f;
    if (!counting && fabsf(share) <= borderline) {
        return;
    }
    if (!counting) {
        w->suspicious_since = tick->time;
    }
    const float sure = (1.0f + w->wider) * limit_deg * rad_in_deg / limit;
    w->left = counted(w->left, share, sure, tick->judged_s);
    w->right = counted(w->right, -share, sure, tick->judged_s);
}

static void count_wrong(oc_fault_watch *w, const oc_fault_tick *tick, float difference, float limit) {
    const float share = no_further_than(difference / limit, counted_max);
    count_beyond(w, tick, share, limit);
    w->mean += (share - w->mean) * tick->judged_s / mean_of_s;
    w->beyond = fabsf(share) > 1.0f;
    if (fabsf(share) < well) {
        w->last_well = tick->time;
        w->well_s += tick->judged_s;
        w->suspended_s = oc_max(w->suspended_s - regained * tick->judged_s, 0.0f);
    } else {
        w->well_s = 0.0f;
        w->suspended_s = oc_min(w->suspended_s + tick->judged_s, suspended_max_s);
    }
}

static bool is_stuck(oc_fault_watch *w, const oc_fault_tick *tick, float limit) {
    const float turned = fabsf(tick->estimate - w->held_estimate);
    const bool bent = w->beyond && turned > limit && w->held_s > stuck_min_s;
    const bool still = w->held_s > still_s && turned > oc_max(still_deg * rad_in_deg, still_sds * tick->sd);
    w->held_fast_s += tick->judged_s;
    w->stuck_s = bent || still ? w->stuck_s + tick->judged_s : 0.0f;
    return w->stuck_s > stuck_min_s || w->held_fast_s > frozen_s;
}

/* Neither stuck nor the other way round. */
static bool goes_along(const oc_fault_watch *w) {
    return w->held_s < healed_s && w->flipped < flipped_some;
}

/* rad; with the offset as late as it is judged by, for the sd grows while learning follows a sensor that drifts. */
static float judged_sd(const oc_fault_watch *w, const oc_fault_tick *tick) {
    const float grown = tick->offset_sd * tick->offset_sd - w->offset_sd * w->offset_sd;
    return grown > 0.0f ? sqrtf(oc_max(tick->sd * tick->sd - grown, 0.0f)) : tick->sd;
}

/* A sensor at fault that goes with the truck again, however far apart: it is another one since this ignition, or rests
 * where a drift or a repair had moved it. It is one that sits elsewhere then, and is learned from; what is no better is
 * found again. To be elsewhere for a moment undoes some of the time that it rested, to stay there all of it. */
static bool was_replaced(oc_fault_watch *w, const oc_fault_tick *tick, float difference, float limit, bool along) {
    if (!teaches_nothing(w->fault)) {
        w->steady_s = 0.0f;
        return false;
    }
    if (!(w->steady_s > 0.0f)) {
        w->apart = difference;
    }
    const bool steady = along && fabsf(difference - w->apart) < well * limit;
    w->apart += steady ? (difference - w->apart) * tick->judged_s / apart_mean_s : 0.0f;
    w->steady_s = oc_max(w->steady_s + (steady ? tick->judged_s : -undone * tick->judged_s), 0.0f);
    return w->steady_s > replaced_s;
}

static void judge(oc_fault_watch *w, const oc_fault_tick *tick) {
    const float limit = (1.0f + w->wider) * oc_max(limit_deg * rad_in_deg, limit_sds * judged_sd(w, tick)) +
                        hidden_deg * rad_in_deg * tick->hidden;
    const float difference = tick->measured - w->offset - tick->estimate;
    count_wrong(w, tick, difference, limit);
    compare_signs(w, tick);
    const bool stuck = is_stuck(w, tick, limit);
    const bool along = goes_along(w);
    if (w->fault == OC_FAULT_NONE) {
        if (stuck) {
            name_it(w, OC_FAULT_STUCK, tick->time - (double)w->held_s, difference, tick->sd);
        } else if (w->flipped > flipped_min) {
            name_it(w, OC_FAULT_WRONG_SIGN, w->last_right, 2.0f * flipped_min, 1.0f);
        } else if (oc_max(w->left, w->right) > (has_stepped(w) ? wrong_after_step_s : wrong_s)) {
            const oc_fault kind = kind_of(w);
            name_it(w, kind, kind == OC_FAULT_JUMPED ? w->step_time : w->suspicious_since, difference, tick->sd);
        } else if (fabsf(w->mean) > wrong_mean) {
            name_it(w, kind_of(w), tick->time - (double)mean_of_s, difference, tick->sd);
        }
    } else if (w->fault != OC_FAULT_LOST && w->fault != OC_FAULT_STUCK && w->flipped > flipped_min) {
        w->fault = OC_FAULT_WRONG_SIGN;
    } else if (was_replaced(w, tick, difference, limit, along)) {
        w->fault = OC_FAULT_REMOUNTED;
    } else if (w->well_s > healed_s && along) {
        if (w->fault == OC_FAULT_DRIFTING) {
            w->wider = oc_min(w->wider + wider, wider_max);
        }
        acquit(w);
    }
}

bool oc_fault_beyond(const oc_fault_watch *w) {
    return w->fault != OC_FAULT_NONE || w->beyond != 0;
}

bool oc_fault_suspected(const oc_fault_watch *w) {
    const bool off = w->suspended_s > 0.0f && w->suspended_s < suspended_max_s && w->well_s <= 0.0f;
    return w->flipped > flipped_some || (w->fault == OC_FAULT_NONE && (off || w->held_fast_s > still_s));
}

/* The learned offset, late; its sd falls at once. */
static void follow_offset(oc_fault_watch *w, const oc_fault_tick *tick) {
    if (teaches_nothing(w->fault)) {
        return;
    }
    w->offset_s += tick->judged_s;
    const float later = fabsf(w->mean) > leaning ? leaning_factor : 1.0f;
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
        .wider = kept->wider,
        .offset = tick->offset,
        .offset_sd = tick->offset_sd,
        .step_time = -1e18,
        .interruption_time = tick->time,
        .last_well = tick->time,
        .last_right = tick->time,
        .last = tick->measured,
    };
}

static void watch_sensor(oc_fault_watch *w, const oc_fault_tick *tick) {
    const bool judges = tick->has_measured && tick->can_judge && tick->speed > judging_speed;
    if (tick->judged_s > 0.0f) {
        const float alike_s = w->alike_s + (judges ? tick->judged_s : -unlike_factor * tick->judged_s);
        w->alike_s = oc_min(oc_max(alike_s, 0.0f), alike_max_s);
    }
    if (tick->speed < 1.0f) {
        w->interruption_time = tick->time;
    }
    if (is_missing(w, tick)) {
        return;
    }
    const bool steps = follow(w, tick);
    const bool is_due = tick->judged_s > 0.0f;
    if (!is_due && !steps) { /* a step is looked at at once: it is not to be believed for a moment */
        return;
    }
    if (tick->can_judge && is_due) {
        follow_offset(w, tick);
    }
    w->beyond = 0;
    if (judges) {
        judge(w, tick);
    }
}

oc_fault oc_fault_update(oc_fault_watch *w, oc_fault_evidence *kept, const oc_fault_tick *tick) {
    if (!w->running) {
        begin_watch(w, kept, tick);
    }
    watch_sensor(w, tick);
    w->last_time = tick->time;
    *kept = (oc_fault_evidence){.fault = w->fault, .confidence = w->confidence, .wider = w->wider};
    return w->fault;
}

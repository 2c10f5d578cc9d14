#include "sensor_fault.h"

#include <math.h>

static const double rad_in_deg = 3.14159265358979323846 / 180.0;
static const double limit_deg = 10.0, limit_sds = 5.5; /* the larger of both is the limit */
static const double well = 0.5;           /* of the limit */
static const double borderline = 0.7;     /* of the limit: what a healthy sensor's estimate is hardly ever off */
static const double counted_max = 1.2;    /* of the limit: through a play that is large the estimate lags by a second */
static const double wrong_s = 1.0;        /* limits x s beyond the borderline: 2 s when far off, 5 s at 0.9 */
static const double suspended_max_s = 60.0; /* then the truck is believed to have changed, not the sensor; */
static const double regained = 0.05;      /* of the time: a flank of the play that is seen now and then must be learned */
static const double wider = 0.5;          /* of the limit, for each drift that went away: the truck is not as learned */
static const double wider_max = 2.0;
static const double stuck_min_s = 1.0;
static const double same_deg = 0.25;      /* a stuck sensor's noise */
static const double still_s = 10.0;       /* at speed no hand is so still through bends of a few deg; */
static const double still_sds = 3.0, still_deg = 4.0;
static const double frozen_s = 30.0;      /* nor so long anywhere */
static const double healed_s = 20.0;
static const double lost_s = 0.1, back_s = 1.0;
static const double judging_speed = 8.0;  /* m/s */
static const double step_deg = 8.0, hand_rate_deg_s = 800.0;
static const double mean_s = 8.0;         /* bends are shorter */
static const double noise_deg = 2.0;      /* of measured and estimate, where the sd would say less */
static const double flipped_min = 20.0;   /* log of the odds */
static const double fades_s = 1.0;   /* errors of the estimate last so long */
static const double sudden_s = 3.0;
static const double offset_memory_s = 200.0;

const char *oc_fault_name(oc_fault fault) {
    static const char *const names[OC_FAULT_COUNT] = {"none",     "lost",       "stuck",    "jumped",
                                                      "drifting", "wrong_sign", "remounted"};
    return (unsigned)fault < OC_FAULT_COUNT ? names[fault] : "unknown";
}

static double at_least(double a, double b) {
    return a > b ? a : b;
}

static double no_more_than(double a, double b) {
    return a < b ? a : b;
}

static void name_it(oc_fault_watch *w, oc_fault fault, double since, double difference, double sd) {
    const double sds = fabs(difference) / at_least(sd, 1e-6);
    w->fault = fault;
    w->since = since;
    w->confidence = sds > 1.0 ? 1.0 - 1.0 / (sds * sds) : 0.0;
    w->well_s = 0.0;
}

/* A signal that goes away, and comes back. True while there is none. */
static bool is_missing(oc_fault_watch *w, const oc_fault_tick *tick) {
    if (!tick->has_measured) {
        w->missing_s += tick->tick_s;
        w->present_s = 0.0;
        w->interruption_time = tick->time;
        if (w->missing_s > lost_s && w->fault == OC_FAULT_NONE) {
            name_it(w, OC_FAULT_LOST, tick->time - w->missing_s, 1.0, 0.0);
        }
        return true;
    }
    w->present_s += tick->tick_s;
    w->missing_s = 0.0;
    if (w->fault == OC_FAULT_LOST && w->present_s > back_s) {
        w->fault = OC_FAULT_NONE;
        w->left = w->right = 0.0;
    }
    return false;
}

/* How the measured value goes: steps that no hand makes, and values that stay. */
static void forget_means(oc_fault_watch *w, const oc_fault_tick *tick) {
    w->mean_measured = tick->measured;
    w->mean_estimate = tick->estimate;
}

static void follow(oc_fault_watch *w, const oc_fault_tick *tick) {
    const double moved = fabs(tick->measured - w->last);
    const bool returned = w->present_s < 2.0 * tick->tick_s;
    if (moved > at_least(step_deg, hand_rate_deg_s * tick->tick_s) * rad_in_deg && !returned) {
        w->step_time = tick->time;
        forget_means(w, tick);
    }
    if (returned) {
        forget_means(w, tick);
    }
    w->last = tick->measured;
    if (fabs(tick->measured - w->held_value) > same_deg * rad_in_deg) {
        w->held_value = tick->measured;
        w->held_estimate = tick->estimate;
        w->held_s = w->held_fast_s = 0.0;
    }
    w->held_s += tick->tick_s;
}

/* Odds of left being right, by what both do about their means of the last seconds: with one noise the log of the odds
 * grows by 2 m e / sd^2 for each independent pair of them. */
static void compare_signs(oc_fault_watch *w, const oc_fault_tick *tick) {
    const double share = tick->tick_s / mean_s;
    const double m = tick->measured - w->mean_measured, e = tick->estimate - w->mean_estimate;
    const double noise = noise_deg * rad_in_deg;
    w->mean_measured += share * m;
    w->mean_estimate += share * e;
    w->flipped -= 2.0 * m * e / (tick->sd * tick->sd + noise * noise) * tick->tick_s / fades_s;
    w->flipped = no_more_than(at_least(w->flipped, 0.0), 2.0 * flipped_min);
    if (w->flipped <= 0.0) {
        w->last_right = tick->time;
    }
}

static oc_fault kind_of(const oc_fault_watch *w) {
    if (w->flipped > 0.5 * flipped_min) {
        return OC_FAULT_WRONG_SIGN;
    }
    if (w->step_time > w->last_well - sudden_s) {
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

static void count_wrong(oc_fault_watch *w, const oc_fault_tick *tick, double difference, double limit) {
    const double share = no_more_than(at_least(difference / limit, -counted_max), counted_max);
    if (fabs(share) > borderline && w->left <= 0.0 && w->right <= 0.0) {
        w->suspicious_since = tick->time;
    }
    w->left = at_least(w->left + (share - borderline) * tick->tick_s, 0.0);
    w->right = at_least(w->right + (-share - borderline) * tick->tick_s, 0.0);
    w->beyond = fabs(share) > 1.0;
    if (fabs(share) < well) {
        w->last_well = tick->time;
        w->well_s += tick->tick_s;
        w->suspended_s = at_least(w->suspended_s - regained * tick->tick_s, 0.0);
    } else {
        w->well_s = 0.0;
        w->suspended_s = no_more_than(w->suspended_s + tick->tick_s, suspended_max_s);
    }
}

static bool is_stuck(oc_fault_watch *w, const oc_fault_tick *tick, double difference, double limit) {
    const double turned = fabs(tick->estimate - w->held_estimate);
    const bool bent = fabs(difference) > limit && turned > limit && w->held_s > stuck_min_s;
    const bool still = w->held_s > still_s && turned > at_least(still_deg * rad_in_deg, still_sds * tick->sd);
    w->held_fast_s += tick->tick_s;
    w->stuck_s = bent || still ? w->stuck_s + tick->tick_s : 0.0;
    return w->stuck_s > stuck_min_s || w->held_fast_s > frozen_s;
}

static bool has_healed(const oc_fault_watch *w) {
    return w->well_s > healed_s && w->held_s < healed_s && w->flipped <= 0.0;
}

static void judge(oc_fault_watch *w, const oc_fault_tick *tick) {
    const double limit = (1.0 + w->wider) * at_least(limit_deg * rad_in_deg, limit_sds * tick->sd);
    const double difference = tick->measured - w->offset - tick->estimate;
    count_wrong(w, tick, difference, limit);
    compare_signs(w, tick);
    const bool stuck = is_stuck(w, tick, difference, limit);
    if (w->fault == OC_FAULT_NONE) {
        if (stuck) {
            name_it(w, OC_FAULT_STUCK, tick->time - w->held_s, difference, tick->sd);
        } else if (w->flipped > flipped_min) {
            name_it(w, OC_FAULT_WRONG_SIGN, w->last_right, 2.0 * flipped_min, 1.0);
        } else if (at_least(w->left, w->right) > wrong_s) {
            name_it(w, kind_of(w), w->suspicious_since, difference, tick->sd);
        }
    } else if (w->fault != OC_FAULT_LOST && w->fault != OC_FAULT_STUCK && w->flipped > flipped_min) {
        w->fault = OC_FAULT_WRONG_SIGN;
    } else if (has_healed(w)) {
        w->wider = no_more_than(w->wider + (w->fault == OC_FAULT_DRIFTING ? wider : 0.0), wider_max);
        w->fault = OC_FAULT_NONE;
        w->left = w->right = 0.0;
    }
}

bool oc_fault_beyond(const oc_fault_watch *w) {
    return w->fault != OC_FAULT_NONE || w->beyond;
}

bool oc_fault_suspected(const oc_fault_watch *w) {
    const bool off = w->suspended_s > 0.0 && w->suspended_s < suspended_max_s && w->well_s <= 0.0;
    return w->flipped > 0.25 * flipped_min || (w->fault == OC_FAULT_NONE && (off || w->held_fast_s > still_s));
}

/* The learned offset, late. */
static void follow_offset(oc_fault_watch *w, const oc_fault_tick *tick) {
    if (w->fault == OC_FAULT_STUCK || w->fault == OC_FAULT_DRIFTING || w->fault == OC_FAULT_WRONG_SIGN) {
        return;
    }
    w->offset_s += tick->tick_s;
    const double memory = w->offset_s < offset_memory_s ? w->offset_s : offset_memory_s;
    w->offset += (tick->offset - w->offset) * tick->tick_s / memory;
}

static void begin_watch(oc_fault_watch *w, const oc_fault_evidence *kept, const oc_fault_tick *tick) {
    *w = (oc_fault_watch){
        .running = 1,
        .fault = kept->fault,
        .since = tick->time,
        .confidence = kept->confidence,
        .wider = kept->wider,
        .offset = tick->offset,
        .step_time = -1e300,
        .interruption_time = tick->time,
        .last_well = tick->time,
        .last_right = tick->time,
        .last = tick->measured,
        .mean_measured = tick->measured,
        .mean_estimate = tick->estimate,
    };
}

static void watch_sensor(oc_fault_watch *w, const oc_fault_tick *tick) {
    if (tick->speed < 1.0) {
        w->interruption_time = tick->time;
    }
    if (is_missing(w, tick)) {
        return;
    }
    follow(w, tick);
    if (tick->can_judge) {
        follow_offset(w, tick);
    }
    w->beyond = false;
    if (tick->can_judge && tick->speed > judging_speed) {
        judge(w, tick);
    }
}

oc_fault oc_fault_update(oc_fault_watch *w, oc_fault_evidence *kept, const oc_fault_tick *tick) {
    if (!w->running) {
        begin_watch(w, kept, tick);
    }
    watch_sensor(w, tick);
    *kept = (oc_fault_evidence){.fault = w->fault, .confidence = w->confidence, .wider = w->wider};
    return w->fault;
}

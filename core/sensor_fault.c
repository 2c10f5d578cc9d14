#include "sensor_fault.h"

#include <math.h>

static const double rad_in_deg = 3.14159265358979323846 / 180.0;
static const double limit_sds = 5.5;
static const double early = 0.9;          /* of the limit: the estimate errs to the other side as well */
static const double well = 0.5;           /* of the limit */
static const double limit_deg = 10.0;
static const double wrong_min_s = 2.5;    /* through a play that is large the estimate lags by a second */
static const double stuck_min_s = 1.0;
static const double hand_still_s = 10.0;  /* at speed no hand is so still for so long; bends of a few deg show it then */
static const double still_sds = 3.0, still_deg = 4.0;
static const double forgiven = 0.5;       /* of the time beyond the limit, by that within it */
static const double healed_s = 20.0;
static const double lost_s = 0.1, back_s = 1.0;
static const double judging_speed = 8.0;      /* m/s */
static const double same_deg = 0.25;      /* a stuck sensor's noise */
static const double step_deg = 8.0, hand_rate_deg_s = 800.0;
static const double sums_memory_s = 8.0;
static const double bends_deg = 3.0;      /* of estimate, sd, that tell signs apart */
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
        w->wrong_s = 0.0;
    }
    return false;
}

/* How the measured value goes: steps that no hand makes, and values that stay. */
static void forget_sums(oc_fault_watch *w, const oc_fault_tick *tick) {
    w->mean_measured = tick->measured;
    w->mean_estimate = tick->estimate;
    w->covariance = w->variance = 0.0;
}

static void follow(oc_fault_watch *w, const oc_fault_tick *tick) {
    const double moved = fabs(tick->measured - w->last);
    const bool returned = w->present_s < 2.0 * tick->tick_s;
    if (moved > at_least(step_deg, hand_rate_deg_s * tick->tick_s) * rad_in_deg && !returned) {
        w->step_time = tick->time;
        forget_sums(w, tick);
    }
    if (returned) {
        forget_sums(w, tick);
    }
    w->last = tick->measured;
    if (fabs(tick->measured - w->held_value) > same_deg * rad_in_deg) {
        w->held_value = tick->measured;
        w->held_estimate = tick->estimate;
        w->held_s = 0.0;
    }
    w->held_s += tick->tick_s;

    const double share = tick->tick_s / sums_memory_s;
    const double m = tick->measured - w->mean_measured, e = tick->estimate - w->mean_estimate;
    w->mean_measured += share * m;
    w->mean_estimate += share * e;
    w->covariance += share * (m * e - w->covariance);
    w->variance += share * (e * e - w->variance);
}

static bool signs_differ(const oc_fault_watch *w) {
    const double bends = bends_deg * rad_in_deg;
    return w->variance > bends * bends && w->covariance < -0.5 * w->variance;
}

static oc_fault kind_of(const oc_fault_watch *w) {
    if (signs_differ(w)) {
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

static void judge(oc_fault_watch *w, const oc_fault_tick *tick) {
    const double limit = at_least(limit_deg * rad_in_deg, limit_sds * tick->sd);
    const double difference = tick->measured - w->offset - tick->estimate;
    const bool wrong = fabs(difference) > early * limit;
    if (fabs(difference) < well * limit) {
        w->last_well = tick->time;
        w->well_s += tick->tick_s;
    } else {
        w->well_s = 0.0;
    }
    if (wrong && w->wrong_s <= 0.0) {
        w->suspicious_since = tick->time;
    }
    w->wrong_s = at_least(w->wrong_s + (wrong ? 1.0 : -forgiven) * tick->tick_s, 0.0);
    const double turned = fabs(tick->estimate - w->held_estimate);
    const bool stays = wrong && w->held_s > stuck_min_s && turned > early * limit;
    const bool still = w->held_s > hand_still_s && turned > at_least(still_deg * rad_in_deg, still_sds * tick->sd);
    w->stuck_s = stays || still ? w->stuck_s + tick->tick_s : 0.0;

    if (w->fault == OC_FAULT_NONE) {
        if (w->stuck_s > stuck_min_s) {
            name_it(w, OC_FAULT_STUCK, tick->time - w->held_s, difference, tick->sd);
        } else if (w->wrong_s > wrong_min_s) {
            name_it(w, kind_of(w), w->suspicious_since, difference, tick->sd);
        }
    } else if (w->fault != OC_FAULT_LOST && w->fault != OC_FAULT_STUCK && signs_differ(w)) {
        w->fault = OC_FAULT_WRONG_SIGN;
    } else if (w->well_s > healed_s && w->held_s < healed_s) {
        w->fault = OC_FAULT_NONE;
        w->wrong_s = 0.0;
    }
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

oc_fault oc_fault_update(oc_fault_watch *w, const oc_fault_tick *tick) {
    if (!w->running) {
        *w = (oc_fault_watch){
            .running = 1,
            .fault = w->fault,
            .since = w->since,
            .confidence = w->confidence,
            .step_time = -1e300,
            .interruption_time = tick->time,
            .last_well = tick->time,
            .last = tick->measured,
            .mean_measured = tick->measured,
            .mean_estimate = tick->estimate,
        };
    }
    if (tick->speed < 1.0) {
        w->interruption_time = tick->time;
    }
    if (is_missing(w, tick)) {
        return w->fault;
    }
    follow(w, tick);
    if (tick->can_judge) {
        follow_offset(w, tick);
    }
    if (tick->can_judge && tick->speed > judging_speed) {
        judge(w, tick);
    }
    return w->fault;
}

#include "assignment.h"

#include <math.h>

#include "bounds.h"

/* Derived. */
static const float whole_turn = 6.2831853f; /* rad */

/* Tuned, in tuned.toml: assignment_verdict */
static const float end_s = 6.0f; /* s: minimum time exactly at each end of the range of a clipped angle */
static const float hold_s = 3600.0f; /* s: until another fault that nothing shows any more ends */
static const float lag_angle_max = 0.55f; /* s: the same, maximum */
static const float lag_acceleration = 0.25f; /* s: maximum lag between lateral acceleration and the others */
/* of the signal: minimum standard deviation of noise */
static const float noise_sd_min[OC_WATCHED] = {0.2f, 0.015f, 1.0f, 1.0f};
static const float sized_like = 0.7f; /* minimum likeness of two signals whose sizes are compared */
/* usual size of the first motion of a pair over the second at low speed, minimum */
static const float slow_size_min[OC_PAIRS] = {0.62f, 0.65f, 0.6f, 0.4f};
static const float slow_size_max[OC_PAIRS] = {4.0f, 1.55f, 2.3f, 2.0f}; /* the same, maximum */
static const float any_size_min[OC_PAIRS] = {0.5f, 0.35f, 0.3f, 0.4f}; /* the same at any speed, minimum */
static const float any_size_max[OC_PAIRS] = {4.5f, 4.0f, 8.0f, 2.0f}; /* the same at any speed, maximum */
/* end */

enum { ANGLE_BIT = OC_HAS_STEERING_WHEEL_ANGLE, YAW_RATE_BIT = OC_HAS_YAW_RATE, SPEED_BIT = OC_HAS_VEHICLE_SPEED };
enum { ACCELERATION_BIT = OC_HAS_LATERAL_ACCELERATION };

const char *oc_signal_fault_name(oc_signal_fault fault) {
    static const char *const names[OC_SIGNAL_FAULT_COUNT] = {"none",  "filled", "stuck",     "clipped",
                                                             "noise", "jumps",  "magnitude", "reversed",
                                                             "scale", "late",   "unrelated"};
    return (unsigned)fault < OC_SIGNAL_FAULT_COUNT ? names[fault] : "unknown";
}

/* Of no signal: none. */
static bool set_signal_fault(oc_assignment *a, oc_signal_fault fault, int32_t signals, float value) {
    if (signals != 0) {
        a->fault = fault;
        a->at_fault = signals;
        a->value = value;
        a->recovering_s = fault == OC_SIGNAL_FAULT_STUCK ? 2.0f * oc_signal_stuck_s() : hold_s;
    }
    return signals != 0;
}

/* An angle that jumps by a whole turn; it lands on the ends of its range. */
static bool is_wrapped(const oc_signal_watch *watch, int32_t k) {
    return k == 0 && fabsf(watch->jumped - whole_turn) < oc_signal_impossible_jump(k);
}

/* An angle that stays at both ends of a range with zero in its middle: a driver ends nowhere so exactly. The ends of a
 * coarse angle are equal by chance. */
static bool judge_range(oc_assignment *a) {
    const float middle = a->range_high + a->range_low, alike = oc_signal_same_end() * a->range_high;
    return oc_min(a->at_low_s, a->at_high_s) > end_s && fabsf(middle) < alike &&
           oc_signal_resolution(&a->watches[0]) < alike &&
           set_signal_fault(a, OC_SIGNAL_FAULT_CLIPPED, ANGLE_BIT, a->range_high);
}

/* A fault that a signal shows by itself. */
static bool judge_alone(oc_assignment *a, const oc_assignment_design *d, int32_t k) {
    const oc_signal_watch *w = &a->watches[k];
    const oc_signal_level *level = &a->levels[k];
    static const int32_t bits[OC_WATCHED] = {ANGLE_BIT, YAW_RATE_BIT, SPEED_BIT, ACCELERATION_BIT};
    const int32_t bit = bits[k];
    const float held = (float)w->held_ticks * d->tick_s;
    const bool alone = k == OC_SPEED_WATCH && w->last > oc_assignment_speed();
    if (oc_signal_is_stuck(level, w, held, d->step_s, oc_signal_missed_min(k), alone)) {
        return set_signal_fault(a, OC_SIGNAL_FAULT_STUCK, bit, held);
    }
    if (oc_signal_misses(level)) {
        return oc_signal_is_clipped(level) ? set_signal_fault(a, OC_SIGNAL_FAULT_CLIPPED, bit, level->missed_value)
                                           : set_signal_fault(a, OC_SIGNAL_FAULT_STUCK, bit, level->held_max_s);
    }
    const bool filled = oc_signal_is_filled(w);
    if (filled && !is_wrapped(w, k)) {
        return set_signal_fault(a, OC_SIGNAL_FAULT_FILLED, bit, oc_signal_filled_with(w));
    }
    if (filled || oc_signal_jumps(w) || (w->jumps >= oc_signal_often() && is_wrapped(w, k))) {
        return set_signal_fault(a, OC_SIGNAL_FAULT_JUMPS, bit, w->jumped);
    }
    return oc_signal_is_noise(level, noise_sd_min[k]) &&
           set_signal_fault(a, OC_SIGNAL_FAULT_NOISE, bit, sqrtf(level->variance));
}

static bool judge_each(oc_assignment *a, const oc_assignment_design *d) {
    for (int32_t k = 0; k < OC_WATCHED; ++k) {
        if (judge_alone(a, d, k)) {
            return true;
        }
    }
    return judge_range(a);
}

/* Whether `one` has no sign, by the sides of the other. */
static bool is_magnitude(const oc_witness *one, const oc_witness *other, const oc_signal_pair *pair, float left,
                         float right) {
    return oc_witness_is_one_sided(one) && oc_witness_is_two_sided(other) && oc_pair_is_folded(pair, left, right);
}

static bool judge_magnitude(oc_assignment *a, const oc_pair_comparison *of) {
    static const int32_t bits[OC_PAIR_YAW_RATE_WHEELS][2] = {
        {ANGLE_BIT, YAW_RATE_BIT}, {YAW_RATE_BIT, ACCELERATION_BIT}, {ANGLE_BIT, ACCELERATION_BIT}};
    static const int32_t witnesses[OC_PAIR_YAW_RATE_WHEELS][2] = {
        {OC_BY_ANGLE, OC_BY_YAW_RATE}, {OC_BY_YAW_RATE, OC_BY_ACCELERATION}, {OC_BY_ANGLE, OC_BY_ACCELERATION}};
    for (int32_t p = 0; p < OC_PAIR_YAW_RATE_WHEELS; ++p) {
        const oc_signal_pair *pair = &a->pairs[p];
        const oc_witness *one = &a->witnesses[witnesses[p][0]], *two = &a->witnesses[witnesses[p][1]];
        const bool first = is_magnitude(one, two, pair, pair->left_of_second, pair->right_of_second);
        const bool second = is_magnitude(two, one, pair, pair->left_of_first, pair->right_of_first);
        if (of[p].enough && (first || second)) {
            return set_signal_fault(a, OC_SIGNAL_FAULT_MAGNITUDE, bits[p][first ? 0 : 1], 0.0f);
        }
    }
    return false;
}

/* Whether angle or yaw rate may be a magnitude that is not proven yet. */
static bool may_be_magnitude(const oc_assignment *a) {
    return oc_witness_is_one_sided(&a->witnesses[OC_BY_ANGLE]) !=
           oc_witness_is_one_sided(&a->witnesses[OC_BY_YAW_RATE]);
}

/* Of two that contradict each other, the one that a third signal contradicts as well; both where none does. */
static int32_t accused_of(int32_t one, bool third_against_one, int32_t other, bool third_against_other) {
    return third_against_one == third_against_other ? one | other : third_against_one ? one : other;
}

static bool judge_sign(oc_assignment *a, const oc_pair_comparison *of) {
    const int32_t dy = oc_pair_agreement(&of[OC_PAIR_ANGLE_YAW_RATE]);
    const int32_t ya = oc_pair_agreement(&of[OC_PAIR_YAW_RATE_ACCELERATION]);
    const int32_t da = oc_pair_agreement(&of[OC_PAIR_ANGLE_ACCELERATION]);
    const int32_t yw = oc_pair_agreement(&of[OC_PAIR_YAW_RATE_WHEELS]);
    int32_t at_fault = 0;
    if (dy < 0 && !may_be_magnitude(a)) {
        at_fault = accused_of(ANGLE_BIT, da < 0 || yw > 0, YAW_RATE_BIT, ya < 0 || yw < 0);
    } else if (dy > 0 && ya < 0 && da <= 0) {
        at_fault = ACCELERATION_BIT;
    }
    return set_signal_fault(a, OC_SIGNAL_FAULT_REVERSED, at_fault, -1.0f);
}

static bool judge_relation(oc_assignment *a, const oc_pair_comparison *of) {
    const oc_pair_comparison *dy = &of[OC_PAIR_ANGLE_YAW_RATE], *ya = &of[OC_PAIR_YAW_RATE_ACCELERATION];
    const oc_pair_comparison *da = &of[OC_PAIR_ANGLE_ACCELERATION], *yw = &of[OC_PAIR_YAW_RATE_WHEELS];
    const bool yaw_rate_fits = oc_pair_agreement(ya) > 0 || oc_pair_agreement(yw) > 0;
    int32_t at_fault = 0;
    if (oc_pair_is_unlike(dy, false, yaw_rate_fits) && !may_be_magnitude(a)) {
        const bool angle = oc_pair_is_unlike(da, false, false) || yaw_rate_fits;
        const bool yaw_rate = oc_pair_is_unlike(ya, false, false) || oc_pair_is_unlike(yw, false, false) ||
                              oc_pair_agreement(da) > 0;
        at_fault = accused_of(ANGLE_BIT, angle, YAW_RATE_BIT, yaw_rate);
    } else if (oc_pair_agreement(dy) > 0 && oc_pair_is_unlike(ya, true, false) && oc_pair_is_unlike(da, true, false)) {
        at_fault = ACCELERATION_BIT;
    }
    return set_signal_fault(a, OC_SIGNAL_FAULT_UNRELATED, at_fault, 0.0f);
}

/* Of the motion that both show: play moves the angle alone, a rough road the accelerometer. */
static float size_of(const oc_pair_comparison *pair, int32_t p) {
    const float likeness = fabsf(pair->likeness);
    return p == OC_PAIR_ANGLE_YAW_RATE           ? pair->size * likeness
           : p == OC_PAIR_YAW_RATE_ACCELERATION ? pair->size / likeness
                                                 : pair->size;
}

/* -1, 0 or 1: too small, usual, too large. At speed, understeer and banked bends widen the usual range; an unknown i L
 * widens that of the angle. */
static int32_t off(const oc_assignment_design *d, const oc_pair_comparison *pair, int32_t p) {
    if (oc_pair_agreement(pair) <= 0 || pair->likeness < sized_like) {
        return 0;
    }
    const float size = size_of(pair, p), doubt = p == OC_PAIR_YAW_RATE_ACCELERATION ? 0.0f : d->product_doubt;
    const float low = pair->is_slow ? slow_size_min[p] : any_size_min[p];
    const float high = pair->is_slow ? slow_size_max[p] : any_size_max[p];
    return size < low * (1.0f - doubt) ? -1 : size > high * (1.0f + doubt) ? 1 : 0;
}

/* Sizes of one motion: a wrong one changes each pair that it is in. */
static bool judge_scale(oc_assignment *a, const oc_assignment_design *d, const oc_pair_comparison *of) {
    const oc_pair_comparison *dy = &of[OC_PAIR_ANGLE_YAW_RATE], *ya = &of[OC_PAIR_YAW_RATE_ACCELERATION];
    const int32_t by_dy = off(d, dy, OC_PAIR_ANGLE_YAW_RATE);
    const int32_t by_ya = off(d, ya, OC_PAIR_YAW_RATE_ACCELERATION);
    const int32_t by_da = off(d, &of[OC_PAIR_ANGLE_ACCELERATION], OC_PAIR_ANGLE_ACCELERATION);
    const float angle = size_of(dy, OC_PAIR_ANGLE_YAW_RATE), yaw_rate = size_of(ya, OC_PAIR_YAW_RATE_ACCELERATION);
    if (by_ya != 0 && by_da == by_ya) {
        return by_dy == by_ya ? set_signal_fault(a, OC_SIGNAL_FAULT_SCALE, SPEED_BIT, yaw_rate)
               : oc_pair_agreement(dy) > 0
                   ? set_signal_fault(a, OC_SIGNAL_FAULT_SCALE, ACCELERATION_BIT, 1.0f / yaw_rate)
                   : false;
    }
    if (by_ya != 0 && by_dy == -by_ya) {
        return set_signal_fault(a, OC_SIGNAL_FAULT_SCALE, YAW_RATE_BIT, yaw_rate);
    }
    const int32_t one_of = oc_pair_agreement(ya) > 0 && ya->is_slow ? ANGLE_BIT : ANGLE_BIT | YAW_RATE_BIT;
    return by_dy != 0 && by_ya == 0 && set_signal_fault(a, OC_SIGNAL_FAULT_SCALE, one_of, angle);
}

static bool judge_lag(oc_assignment *a, const oc_pair_comparison *of) {
    const oc_pair_comparison *dy = &of[OC_PAIR_ANGLE_YAW_RATE], *ya = &of[OC_PAIR_YAW_RATE_ACCELERATION];
    const oc_pair_comparison *da = &of[OC_PAIR_ANGLE_ACCELERATION], *yw = &of[OC_PAIR_YAW_RATE_WHEELS];
    const bool has_ya = oc_pair_agreement(ya) > 0, has_da = oc_pair_agreement(da) > 0;
    const bool has_lag = oc_pair_agreement(dy) > 0 && dy->has_lag;
    const bool wheels_lead = oc_pair_agreement(yw) > 0 && yw->lag_s < -lag_acceleration;
    if (has_lag && dy->lag_s < -lag_acceleration && (!has_da || da->lag_s < -lag_acceleration)) {
        return set_signal_fault(a, OC_SIGNAL_FAULT_LATE, ANGLE_BIT, -dy->lag_s);
    }
    return has_lag && dy->lag_s > lag_angle_max && (!has_ya || wheels_lead || ya->lag_s < -lag_acceleration) &&
           set_signal_fault(a, OC_SIGNAL_FAULT_LATE, YAW_RATE_BIT, dy->lag_s);
}

/* The most fundamental fault is named: without its sign or with a wrong one, a signal's size and lag mean nothing. */
void oc_assignment_judge(oc_assignment *a, const oc_assignment_design *d) {
    oc_pair_comparison of[OC_PAIRS];
    for (int32_t p = 0; p < OC_PAIRS; ++p) {
        oc_assignment_compare(&of[p], a, p, d->step_s);
    }
    (void)(judge_each(a, d) || judge_magnitude(a, of) || judge_sign(a, of) || judge_relation(a, of) ||
           judge_scale(a, d, of) || judge_lag(a, of));
}

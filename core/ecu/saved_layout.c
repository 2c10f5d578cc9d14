#include "saved_layout.h"

#include "monitor.h"

/* A number that does not fit its member divides by zero, which stops the compiler. */
#define UP_TO(max, number) ((number) / ((number) <= (max)))
#define PLACE(type, first) UP_TO(UINT16_MAX, offsetof(type, first))
#define RUN(type, first, count, kind) {PLACE(type, first), UP_TO(UINT16_MAX, count), 0, 1, kind}
#define RUN_OF_EACH(type, first, count, structs, kind)                                                                 \
    {PLACE(type, first), UP_TO(UINT16_MAX, count), UP_TO(UINT16_MAX, sizeof(((type *)0)->structs[0]) / 4),             \
     UP_TO(UINT8_MAX, sizeof(((type *)0)->structs) / sizeof(((type *)0)->structs[0])), kind}

#define DOUBLES(type, first, count) RUN(type, first, count, OC_SAVED_DOUBLE)
#define FLOATS(type, first, count) RUN(type, first, count, OC_SAVED_FLOAT)
#define INTEGERS(type, first, count) RUN(type, first, count, OC_SAVED_INT32)
#define COUNTS(type, first, count) RUN(type, first, count, OC_SAVED_UINT64)
#define ENUMS(type, first, count) RUN(type, first, count, OC_SAVED_ENUM)
#define DOUBLES_OF_EACH(type, first, count, structs) RUN_OF_EACH(type, first, count, structs, OC_SAVED_DOUBLE)
#define FLOATS_OF_EACH(type, first, count, structs) RUN_OF_EACH(type, first, count, structs, OC_SAVED_FLOAT)
#define INTEGERS_OF_EACH(type, first, count, structs) RUN_OF_EACH(type, first, count, structs, OC_SAVED_INT32)
#define ENUMS_OF_EACH(type, first, count, structs) RUN_OF_EACH(type, first, count, structs, OC_SAVED_ENUM)

/* docs/make_layout.py writes the following from the headers. */
/* Derived. */
static const uint32_t layout_hash = 0xEBFF557Du;

static const oc_saved_run state_runs[] = {
    DOUBLES(oc_state, tracking.clock.last_time, 2), INTEGERS(oc_state, tracking.clock.rejected_in_order, 2),
    DOUBLES(oc_state, tracking.clock.window_begin, 2), INTEGERS(oc_state, tracking.clock.window_ticks, 4),
    DOUBLES(oc_state, tracking.last_complete, 1), FLOATS(oc_state, tracking.braked_s, 7),
    INTEGERS(oc_state, tracking.statuses.known, 2),
    FLOATS_OF_EACH(oc_state, tracking.assignment.watches[0].last, 19, tracking.assignment.watches),
    INTEGERS_OF_EACH(oc_state, tracking.assignment.watches[0].held_ticks, 1, tracking.assignment.watches),
    FLOATS(oc_state, tracking.assignment.levels[0].mean, 64),
    FLOATS_OF_EACH(oc_state, tracking.assignment.witnesses[0].means[0], 23, tracking.assignment.witnesses),
    INTEGERS_OF_EACH(oc_state, tracking.assignment.witnesses[0].steps, 1, tracking.assignment.witnesses),
    FLOATS_OF_EACH(oc_state, tracking.assignment.pairs[0].firsts[0], 101, tracking.assignment.pairs),
    INTEGERS_OF_EACH(oc_state, tracking.assignment.pairs[0].oldest, 2, tracking.assignment.pairs),
    FLOATS(oc_state, tracking.assignment.sums[0], 18), INTEGERS(oc_state, tracking.assignment.ticks, 12),
    ENUMS(oc_state, tracking.assignment.fault, 1), DOUBLES(oc_state, tracking.preprocess.lowpass.s1[0], 84),
    INTEGERS(oc_state, tracking.preprocess.angle_next, 7), DOUBLES(oc_state, tracking.straight.filling.weight, 147),
    INTEGERS(oc_state, tracking.cornering.ticks, 3), DOUBLES(oc_state, tracking.cornering.filling.weight, 147),
    INTEGERS(oc_state, tracking.joint.running, 3), DOUBLES(oc_state, tracking.joint.yaw_rate, 4),
    FLOATS(oc_state, tracking.joint.curvature_sum, 21),
    FLOATS_OF_EACH(oc_state, tracking.joint.filling.samples[0].angle, 13, tracking.joint.filling.samples),
    INTEGERS_OF_EACH(oc_state, tracking.joint.filling.samples[0].in_second, 1, tracking.joint.filling.samples),
    INTEGERS(oc_state, tracking.joint.filling.count, 2), FLOATS(oc_state, tracking.joint.filling.curvature, 1),
    FLOATS_OF_EACH(oc_state, tracking.joint.collected.samples[0].angle, 13, tracking.joint.collected.samples),
    INTEGERS_OF_EACH(oc_state, tracking.joint.collected.samples[0].in_second, 1, tracking.joint.collected.samples),
    INTEGERS(oc_state, tracking.joint.collected.count, 2), FLOATS(oc_state, tracking.joint.collected.curvature, 1),
    INTEGERS(oc_state, tracking.joint.due, 5), FLOATS(oc_state, tracking.joint.min_error, 243),
    INTEGERS(oc_state, tracking.angle.running, 2), FLOATS(oc_state, tracking.angle.yaw_rate_first, 27),
    INTEGERS(oc_state, tracking.fault.running, 2), ENUMS(oc_state, tracking.fault.fault, 1),
    DOUBLES(oc_state, tracking.fault.since, 7), FLOATS(oc_state, tracking.fault.steady_difference, 24),
    DOUBLES(oc_state, evidence.offset.ticks.weight, 47), INTEGERS(oc_state, evidence.standstill.still_ticks, 3),
    FLOATS(oc_state, evidence.speed_floor.low_s[0], 4), DOUBLES(oc_state, evidence.gyro_bias.x[0], 72),
    FLOATS(oc_state, evidence.gyro_bias.past.used_s, 17),
    DOUBLES_OF_EACH(oc_state, evidence.gyro_bias.axles[0].weight, 18, evidence.gyro_bias.axles),
    INTEGERS_OF_EACH(oc_state, evidence.gyro_bias.axles[0].has_update, 1, evidence.gyro_bias.axles),
    DOUBLES(oc_state, evidence.gyro_bias.straights.blocks, 25), INTEGERS(oc_state, evidence.gyro_bias.due, 8),
    ENUMS(oc_state, evidence.gyro_bias.status, 1), DOUBLES(oc_state, evidence.wheel_speed.difference, 3),
    INTEGERS(oc_state, evidence.joint.started, 18), FLOATS(oc_state, evidence.joint.second.noise.by_samples[0], 36),
    DOUBLES(oc_state, evidence.joint.speed_mean, 5), FLOATS(oc_state, evidence.joint.removed[0], 4),
    DOUBLES_OF_EACH(oc_state, evidence.joint.changed[0].time, 3, evidence.joint.changed),
    ENUMS_OF_EACH(oc_state, evidence.joint.changed[0].change.kind, 1, evidence.joint.changed),
    FLOATS_OF_EACH(oc_state, evidence.joint.changed[0].change.size, 3, evidence.joint.changed),
    FLOATS_OF_EACH(oc_state, evidence.joint.hypotheses[0].play.half_width, 244, evidence.joint.hypotheses),
    INTEGERS_OF_EACH(oc_state, evidence.joint.hypotheses[0].wanders, 2, evidence.joint.hypotheses),
    INTEGERS(oc_state, evidence.torque.started, 4), FLOATS(oc_state, evidence.torque.filling.torque, 23),
    DOUBLES(oc_state, evidence.angle.side_slip.information[0][0], 12), ENUMS(oc_state, evidence.fault.fault, 1),
    FLOATS(oc_state, evidence.fault.confidence, 3), INTEGERS(oc_state, evidence.verdicts.offset_trusted, 1),
    COUNTS(oc_state, evidence.ticks, 17), DOUBLES(oc_state, evidence.bank_ticks, 10),
    ENUMS(oc_state, learned.offset.status, 1), FLOATS(oc_state, learned.offset.lean, 1),
    DOUBLES(oc_state, learned.understeer_gradient.value, 3), ENUMS(oc_state, learned.understeer_gradient.status, 1),
    FLOATS(oc_state, learned.understeer_gradient.lean, 1), DOUBLES(oc_state, learned.backlash.value, 3),
    ENUMS(oc_state, learned.backlash.status, 1), FLOATS(oc_state, learned.backlash.lean, 1),
    DOUBLES(oc_state, learned.unloading_acceleration.value, 3),
    ENUMS(oc_state, learned.unloading_acceleration.status, 1), FLOATS(oc_state, learned.unloading_acceleration.lean, 1),
    DOUBLES(oc_state, learned.equivalent_wheelbase.value, 3), ENUMS(oc_state, learned.equivalent_wheelbase.status, 1),
    FLOATS(oc_state, learned.equivalent_wheelbase.lean, 20), INTEGERS(oc_state, learned.truck.identified, 1),
};

static const oc_saved_run keyed_runs[] = {
    DOUBLES(oc_coefficients, vehicle.wheelbase, 3), INTEGERS(oc_coefficients, vehicle.ratio.terms, 1),
    DOUBLES(oc_coefficients, vehicle.ratio.coefficients[0], 11), ENUMS(oc_coefficients, params.method, 2),
    DOUBLES(oc_coefficients, params.cutoff_hz, 71), INTEGERS(oc_coefficients, params.use_accelerometer, 1),
    DOUBLES(oc_coefficients, rate_hz, 1),
};
/* end */

uint32_t oc_saved_layout(void) {
    return layout_hash;
}

const oc_saved_run *oc_saved_state(size_t *count) {
    *count = sizeof state_runs / sizeof *state_runs;
    return state_runs;
}

const oc_saved_run *oc_saved_keyed(size_t *count) {
    *count = sizeof keyed_runs / sizeof *keyed_runs;
    return keyed_runs;
}

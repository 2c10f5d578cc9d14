#include "saved_members.h"

#include <math.h>

#include "bounds.h"

typedef enum {
    ANY_NUMBER,
    NOT_NEGATIVE,
    ANY_SUM,
    ANY_PRODUCT,
    SQUARES,
    ANY_TIME,         /* s */
    ANY_AMOUNT,       /* as seconds, weights and variances of months of driving */
    OF_HEADING,       /* its cosine, its sine, or rad of a turn within a sample */
    ANY_ANGLE,        /* rad */
    ANY_YAW_RATE,     /* rad/s */
    ANY_ACCELERATION, /* m/s^2 */
    ROAD_SPEED,       /* m/s */
    TOTAL,            /* of ticks */
    COUNTER,
    YES_OR_NO,
    HALF_WIDTH,       /* rad */
    FRICTION_OR_NONE, /* m/s^2 */
    ANY_HYPOTHESIS,
    ANY_LATER_START,
    HYPOTHESES_DONE,
    STEPS_DUE,
    OF_SAMPLE,
    OF_BLOCK,
    OF_LONG_BLOCK,
    ANY_STATUS,
    ANY_CHANGE,
    ANY_FAULT,
    IN_DELAY,
    IN_SLOPE,
    IN_PENDING,
    IN_SECOND,
    SAMPLES,
    TURNS,
    LIMIT_COUNT
} saved_limit;

/* Wider than any drive needs, and so narrow that in single precision no product of a few is infinite; zero, which is
 * not yet learned, is within each. */
static const struct {
    float low, high;
} saved_limits[LIMIT_COUNT] = {
    [ANY_NUMBER] = {-1e5f, 1e5f},
    [NOT_NEGATIVE] = {0.0f, 1e5f},
    [ANY_SUM] = {-1e12f, 1e12f},
    [ANY_PRODUCT] = {-1e24f, 1e24f},
    [SQUARES] = {0.0f, 1e24f},
    [ANY_TIME] = {-1e30f, 1e30f},
    [ANY_AMOUNT] = {0.0f, 1e9f},
    [OF_HEADING] = {-1.5f, 1.5f},
    [ANY_ANGLE] = {-200.0f, 200.0f},
    [ANY_YAW_RATE] = {-10.0f, 10.0f},
    [ANY_ACCELERATION] = {-100.0f, 100.0f},
    [ROAD_SPEED] = {-150.0f, 150.0f},
    [TOTAL] = {0.0f, 9007199254740992.0f}, /* 2^53 */
    [COUNTER] = {0.0f, 1e9f},
    [YES_OR_NO] = {0.0f, 1.0f},
    [HALF_WIDTH] = {0.0f, 0.25f},
    [FRICTION_OR_NONE] = {-1.0f, 10.0f},
    [ANY_HYPOTHESIS] = {0.0f, OC_JOINT_HYPOTHESES - 1},
    [ANY_LATER_START] = {0.0f, OC_JOINT_LATER_STARTS - 1},
    [HYPOTHESES_DONE] = {0.0f, OC_JOINT_HYPOTHESES},
    [STEPS_DUE] = {0.0f, 5.0f},
    [OF_SAMPLE] = {0.0f, 31.0f},
    [OF_BLOCK] = {0.0f, OC_SECONDS_PER_BLOCK - 1},
    [OF_LONG_BLOCK] = {0.0f, OC_SECONDS_PER_LONG_BLOCK - 1},
    [ANY_STATUS] = {0.0f, OC_STATUS_COUNT - 1},
    [ANY_CHANGE] = {0.0f, OC_CHANGE_BENDS},
    [ANY_FAULT] = {0.0f, OC_FAULT_COUNT - 1},
    [IN_DELAY] = {0.0f, OC_DELAY_MAX - 1},
    [IN_SLOPE] = {0.0f, OC_SLOPE_POINTS - 1},
    [IN_PENDING] = {0.0f, OC_PENDING_MAX - 1},
    [IN_SECOND] = {-1.0f, OC_JOINT_SAMPLES - 1},
    [SAMPLES] = {0.0f, OC_JOINT_SAMPLES},
    [TURNS] = {0.0f, OC_JOINT_HYPOTHESES + 1},
};

/* Members one after the other, of one kind and within one limit; macros, so that offset and size cannot be of two. */
enum { LIMITS_MAX = 48 };
#define NATIVE_BYTES(kind)                                                                                             \
    ((kind) == OC_SAVED_DOUBLE || (kind) == OC_SAVED_UINT64 ? 8u : (kind) == OC_SAVED_ENUM ? sizeof(oc_status) : 4u)
#define MEMBERS(type, first, last, kind, limit)                                                                       \
    {offsetof(type, first),                                                                                            \
     (offsetof(type, last) + sizeof(((type *)0)->last) - offsetof(type, first)) / NATIVE_BYTES(kind),                  \
     (kind) * LIMITS_MAX + (limit)}
#define MEMBER(type, member, kind, limit) MEMBERS(type, member, member, kind, limit)

static const oc_saved_member moments_members[] = {
    MEMBERS(oc_moments, weight, xx, OC_SAVED_DOUBLE, TOTAL),
    MEMBERS(oc_moments, y, xy, OC_SAVED_DOUBLE, ANY_SUM),
};

static const oc_saved_member understeer_members[] = {
    MEMBERS(oc_understeer, x, xy, OC_SAVED_DOUBLE, ANY_SUM),
    MEMBERS(oc_understeer, xx, weight, OC_SAVED_DOUBLE, TOTAL),
    MEMBERS(oc_understeer, batches, xx_xx, OC_SAVED_DOUBLE, SQUARES),
    MEMBERS(oc_understeer, xy_x, x_xx, OC_SAVED_DOUBLE, ANY_PRODUCT),
};

static const oc_saved_member standstill_members[] = {
    MEMBER(oc_standstill, yaw_rate.weight, OC_SAVED_DOUBLE, TOTAL),
    MEMBER(oc_standstill, yaw_rate.mean, OC_SAVED_DOUBLE, ANY_YAW_RATE),
    MEMBERS(oc_standstill, yaw_rate.squares, lateral_acceleration.weight, OC_SAVED_DOUBLE, TOTAL),
    MEMBER(oc_standstill, lateral_acceleration.mean, OC_SAVED_DOUBLE, ANY_ACCELERATION),
    MEMBER(oc_standstill, lateral_acceleration.squares, OC_SAVED_DOUBLE, TOTAL),
    MEMBER(oc_standstill, still_ticks, OC_SAVED_INT32, COUNTER),
};

static const oc_saved_member gyro_bias_members[] = {
    MEMBER(oc_gyro_bias, x, OC_SAVED_DOUBLE, ANY_YAW_RATE), MEMBER(oc_gyro_bias, P, OC_SAVED_DOUBLE, ANY_NUMBER),
    MEMBERS(oc_gyro_bias, past.used_s, past.waiting_s, OC_SAVED_FLOAT, ANY_AMOUNT),
    MEMBERS(oc_gyro_bias, past.bias, past.covariance, OC_SAVED_FLOAT, ANY_YAW_RATE),
    MEMBERS(oc_gyro_bias, together, apart, OC_SAVED_FLOAT, NOT_NEGATIVE),
    MEMBERS(oc_gyro_bias, alarm_blocks, alarm_variance, OC_SAVED_DOUBLE, ANY_AMOUNT),
    MEMBERS(oc_gyro_bias, time, block_time, OC_SAVED_DOUBLE, ANY_TIME),
    MEMBERS(oc_gyro_bias, block_ticks, still, OC_SAVED_DOUBLE, ANY_AMOUNT),
    MEMBER(oc_gyro_bias, still_yaw_rate, OC_SAVED_DOUBLE, ANY_YAW_RATE),
    MEMBERS(oc_gyro_bias, still_squares, wheel_evidence, OC_SAVED_DOUBLE, ANY_AMOUNT),
    MEMBER(oc_gyro_bias, due, OC_SAVED_INT32, STEPS_DUE),
    MEMBERS(oc_gyro_bias, still_ticks, silent_ticks, OC_SAVED_INT32, COUNTER),
    MEMBERS(oc_gyro_bias, started, has_wheels, OC_SAVED_INT32, YES_OR_NO),
    MEMBER(oc_gyro_bias, status, OC_SAVED_ENUM, ANY_STATUS), MEMBER(oc_gyro_bias, sd, OC_SAVED_DOUBLE, NOT_NEGATIVE),
};

static const oc_saved_member axle_members[] = {
    MEMBERS(oc_gyro_bias_axle, weight, blocks, OC_SAVED_DOUBLE, ANY_AMOUNT),
    MEMBERS(oc_gyro_bias_axle, difference, innovation, OC_SAVED_DOUBLE, ANY_NUMBER),
    MEMBERS(oc_gyro_bias_axle, last, before_speed, OC_SAVED_DOUBLE, ROAD_SPEED),
    MEMBER(oc_gyro_bias_axle, before_yaw_rate, OC_SAVED_DOUBLE, ANY_YAW_RATE),
    MEMBER(oc_gyro_bias_axle, is_heard, OC_SAVED_INT32, YES_OR_NO),
};

static const oc_saved_member wheel_speed_members[] = {
    MEMBER(oc_wheel_speed, difference, OC_SAVED_DOUBLE, ANY_SUM),
    MEMBERS(oc_wheel_speed, distance, time, OC_SAVED_DOUBLE, TOTAL),
};

static const oc_saved_member joint_members[] = {
    MEMBER(oc_joint, started, OC_SAVED_INT32, YES_OR_NO),
    MEMBER(oc_joint, count, OC_SAVED_INT32, HYPOTHESES_DONE),
    MEMBER(oc_joint, best, OC_SAVED_INT32, ANY_HYPOTHESIS), MEMBER(oc_joint, born, OC_SAVED_INT32, ANY_LATER_START),
    MEMBER(oc_joint, phase, OC_SAVED_INT32, OF_SAMPLE),
    MEMBER(oc_joint, in_block, OC_SAVED_INT32, OF_BLOCK),
    MEMBER(oc_joint, in_long_block, OC_SAVED_INT32, OF_LONG_BLOCK),
    MEMBERS(oc_joint, along, across, OC_SAVED_FLOAT, OF_HEADING), MEMBER(oc_joint, lost, OC_SAVED_INT32, YES_OR_NO),
    MEMBERS(oc_joint, to_left, to_right, OC_SAVED_FLOAT, ANY_AMOUNT),
    MEMBER(oc_joint, solves_all, OC_SAVED_INT32, YES_OR_NO),
    MEMBER(oc_joint, speed_mean, OC_SAVED_DOUBLE, ROAD_SPEED),
    MEMBER(oc_joint, bank_mean, OC_SAVED_DOUBLE, ANY_ACCELERATION),
    MEMBER(oc_joint, bank_samples, OC_SAVED_DOUBLE, ANY_AMOUNT), MEMBER(oc_joint, changes, OC_SAVED_INT32, COUNTER),
};

static const oc_saved_member second_members[] = {
    MEMBERS(oc_second, noise, trial_s, OC_SAVED_FLOAT, ANY_AMOUNT),
    MEMBER(oc_second, best_cost, OC_SAVED_FLOAT, ANY_NUMBER), MEMBER(oc_second, second_s, OC_SAVED_FLOAT, OF_HEADING),
    MEMBER(oc_second, memory_share, OC_SAVED_FLOAT, YES_OR_NO),
    MEMBER(oc_second, reference, OC_SAVED_FLOAT, NOT_NEGATIVE),
    MEMBERS(oc_second, learns, long_block_ends, OC_SAVED_INT32, YES_OR_NO),
    MEMBERS(oc_second, blocks, long_blocks, OC_SAVED_INT32, COUNTER),
};

static const oc_saved_member watch_members[] = {
    MEMBERS(oc_change_watch, offset, seconds, OC_SAVED_FLOAT, ANY_AMOUNT),
    MEMBERS(oc_change_watch, error, error_curvature, OC_SAVED_FLOAT, ANY_NUMBER),
    MEMBER(oc_change_watch, curvature_squares, OC_SAVED_FLOAT, NOT_NEGATIVE),
};

static const oc_saved_member changed_members[] = {
    MEMBERS(oc_changed, time, before, OC_SAVED_DOUBLE, ANY_TIME),
    MEMBER(oc_changed, before_sd, OC_SAVED_DOUBLE, NOT_NEGATIVE),
    MEMBER(oc_changed, change.kind, OC_SAVED_ENUM, ANY_CHANGE),
    MEMBER(oc_changed, change.size, OC_SAVED_FLOAT, ANY_ANGLE),
    MEMBERS(oc_changed, change.size_sd, change.seconds, OC_SAVED_FLOAT, ANY_AMOUNT),
};

static const oc_saved_member hypothesis_members[] = {
    MEMBER(oc_hypothesis, play.half_width, OC_SAVED_FLOAT, HALF_WIDTH),
    MEMBER(oc_hypothesis, play.unloading, OC_SAVED_FLOAT, ANY_ACCELERATION),
    MEMBER(oc_hypothesis, play.friction, OC_SAVED_FLOAT, FRICTION_OR_NONE),
    MEMBER(oc_hypothesis, play.creep, OC_SAVED_FLOAT, NOT_NEGATIVE),
    MEMBER(oc_hypothesis, play.windup, OC_SAVED_FLOAT, HALF_WIDTH),
    MEMBER(oc_hypothesis, play.unwinding, OC_SAVED_FLOAT, NOT_NEGATIVE),
    MEMBER(oc_hypothesis, play.wind, OC_SAVED_FLOAT, ANY_ACCELERATION),
    MEMBERS(oc_hypothesis, places, target_sum, OC_SAVED_FLOAT, ANY_NUMBER),
    MEMBERS(oc_hypothesis, learned_s, weight, OC_SAVED_FLOAT, ANY_AMOUNT),
    MEMBER(oc_hypothesis, target_mean, OC_SAVED_FLOAT, ANY_ANGLE),
    MEMBERS(oc_hypothesis, means, terms, OC_SAVED_FLOAT, ANY_NUMBER),
    MEMBER(oc_hypothesis, variance, OC_SAVED_FLOAT, NOT_NEGATIVE),
    MEMBER(oc_hypothesis, blocks.sum, OC_SAVED_FLOAT, ANY_NUMBER),
    MEMBER(oc_hypothesis, blocks.factor, OC_SAVED_FLOAT, NOT_NEGATIVE),
    MEMBER(oc_hypothesis, long_blocks.sum, OC_SAVED_FLOAT, ANY_NUMBER),
    MEMBER(oc_hypothesis, long_blocks.factor, OC_SAVED_FLOAT, NOT_NEGATIVE),
    MEMBER(oc_hypothesis, trust, OC_SAVED_FLOAT, YES_OR_NO),
    MEMBERS(oc_hypothesis, error, wheelbase, OC_SAVED_FLOAT, ANY_NUMBER),
    MEMBER(oc_hypothesis, unloading, OC_SAVED_FLOAT, ANY_ACCELERATION),
    MEMBERS(oc_hypothesis, age, pulled_variance, OC_SAVED_FLOAT, ANY_AMOUNT),
};

static const oc_saved_member angle_members[] = {
    MEMBER(oc_angle_evidence, slopes, OC_SAVED_FLOAT, NOT_NEGATIVE),
    MEMBERS(oc_angle_evidence, products, steady, OC_SAVED_FLOAT, ANY_NUMBER),
    MEMBER(oc_angle_evidence, cubes, OC_SAVED_FLOAT, NOT_NEGATIVE),
    MEMBER(oc_angle_evidence, flattened, OC_SAVED_FLOAT, ANY_NUMBER),
    MEMBERS(oc_angle_evidence, spread, seconds, OC_SAVED_FLOAT, ANY_AMOUNT),
    MEMBER(oc_angle_evidence, side_slip, OC_SAVED_DOUBLE, ANY_SUM),
};

static const oc_saved_member fault_members[] = {
    MEMBER(oc_fault_evidence, fault, OC_SAVED_ENUM, ANY_FAULT),
    MEMBER(oc_fault_evidence, confidence, OC_SAVED_FLOAT, YES_OR_NO),
    MEMBER(oc_fault_evidence, wider, OC_SAVED_FLOAT, NOT_NEGATIVE),
};

static const oc_saved_member evidence_members[] = {
    MEMBER(oc_evidence, verdicts.offset_trusted, OC_SAVED_INT32, YES_OR_NO),
    MEMBER(oc_evidence, verdicts.lately, OC_SAVED_FLOAT, ANY_NUMBER),
    MEMBERS(oc_evidence, ticks, unused_motion, OC_SAVED_UINT64, TOTAL),
    MEMBER(oc_evidence, bank_ticks, OC_SAVED_DOUBLE, TOTAL),
    MEMBER(oc_evidence, bank_sum, OC_SAVED_DOUBLE, ANY_SUM),
};

static const oc_saved_member estimate_members[] = {
    MEMBER(oc_estimate, value, OC_SAVED_DOUBLE, ANY_NUMBER),
    MEMBERS(oc_estimate, standard_deviation, evidence, OC_SAVED_DOUBLE, ANY_AMOUNT),
    MEMBER(oc_estimate, status, OC_SAVED_ENUM, ANY_STATUS), MEMBER(oc_estimate, lean, OC_SAVED_FLOAT, ANY_NUMBER),
};

static const oc_saved_member truck_members[] = {
    MEMBERS(oc_angle_truck, offset_sd, right_s, OC_SAVED_FLOAT, ANY_NUMBER),
    MEMBER(oc_angle_truck, known, OC_SAVED_INT32, YES_OR_NO),
};

static const oc_saved_member tracking_members[] = {
    MEMBERS(oc_tracking, clock.last_time, clock.last_refused, OC_SAVED_DOUBLE, ANY_TIME),
    MEMBER(oc_tracking, clock.refused_in_order, OC_SAVED_INT32, COUNTER),
    MEMBER(oc_tracking, clock.started, OC_SAVED_INT32, YES_OR_NO),
    MEMBER(oc_tracking, last_complete, OC_SAVED_DOUBLE, ANY_TIME),
    MEMBERS(oc_tracking, has_complete, running, OC_SAVED_INT32, YES_OR_NO),
    MEMBERS(oc_tracking, preprocess.yaw_rate, preprocess.speed_slope, OC_SAVED_DOUBLE, ANY_NUMBER),
    MEMBER(oc_tracking, preprocess.angle_next, OC_SAVED_INT32, IN_DELAY),
    MEMBER(oc_tracking, preprocess.speed_next, OC_SAVED_INT32, IN_SLOPE),
    MEMBERS(oc_tracking, preprocess.slope_wait, preprocess.ticks, OC_SAVED_INT32, COUNTER),
    MEMBER(oc_tracking, angle.running, OC_SAVED_INT32, YES_OR_NO),
    MEMBERS(oc_tracking, angle.yaw_rate_first, angle.place_step, OC_SAVED_FLOAT, ANY_NUMBER),
    MEMBER(oc_tracking, angle.ticks_to_check, OC_SAVED_INT32, COUNTER),
    MEMBERS(oc_tracking, angle.held_s, angle.standing_s, OC_SAVED_FLOAT, ANY_AMOUNT),
    MEMBERS(oc_tracking, angle.estimate, angle.sd, OC_SAVED_FLOAT, ANY_NUMBER),
};

static const oc_saved_member pending_members[] = {
    MEMBER(oc_pending, filling, OC_SAVED_DOUBLE, ANY_SUM), /* a struct of doubles alone, as are those that follow */
    MEMBER(oc_pending, ticks, OC_SAVED_INT32, COUNTER), MEMBER(oc_pending, first, OC_SAVED_INT32, IN_PENDING),
    MEMBER(oc_pending, count, OC_SAVED_INT32, COUNTER),
};

static const oc_saved_member joint_tracking_members[] = {
    MEMBER(oc_joint_tracking, running, OC_SAVED_INT32, YES_OR_NO),
    MEMBER(oc_joint_tracking, in_second, OC_SAVED_INT32, IN_SECOND),
    MEMBER(oc_joint_tracking, curvature_sum, OC_SAVED_FLOAT, ANY_NUMBER),
    MEMBER(oc_joint_tracking, doubted, OC_SAVED_INT32, YES_OR_NO),
    MEMBER(oc_joint_tracking, turned, OC_SAVED_FLOAT, OF_HEADING),
    MEMBERS(oc_joint_tracking, yaw_rate, lateral_acceleration, OC_SAVED_DOUBLE, ANY_NUMBER),
    MEMBERS(oc_joint_tracking, noise, prior, OC_SAVED_FLOAT, ANY_NUMBER),
    MEMBER(oc_joint_tracking, turns, OC_SAVED_INT32, TURNS),
    MEMBER(oc_joint_tracking, solves_all, OC_SAVED_INT32, YES_OR_NO),
    MEMBERS(oc_joint_tracking, least_error, inner, OC_SAVED_FLOAT, ANY_SUM),
    MEMBER(oc_joint_tracking, equations, OC_SAVED_FLOAT, ANY_SUM), /* a struct of floats alone */
};

static const oc_saved_member collected_members[] = {
    MEMBER(oc_collected, count, OC_SAVED_INT32, SAMPLES), MEMBER(oc_collected, curvature, OC_SAVED_FLOAT, ANY_NUMBER),
    MEMBER(oc_collected, doubted, OC_SAVED_INT32, YES_OR_NO),
};

static const oc_saved_member sample_members[] = {
    MEMBER(oc_motion_sample, angle, OC_SAVED_DOUBLE, ANY_NUMBER),
    MEMBERS(oc_motion_sample, residual, wind, OC_SAVED_FLOAT, ANY_NUMBER),
    MEMBER(oc_motion_sample, in_second, OC_SAVED_INT32, IN_SECOND),
};

static const oc_saved_member fault_watch_members[] = {
    MEMBER(oc_fault_watch, running, OC_SAVED_INT32, YES_OR_NO), MEMBER(oc_fault_watch, fault, OC_SAVED_ENUM, ANY_FAULT),
    MEMBERS(oc_fault_watch, since, last_right, OC_SAVED_DOUBLE, ANY_TIME),
    MEMBER(oc_fault_watch, beyond, OC_SAVED_INT32, YES_OR_NO),
    MEMBERS(oc_fault_watch, apart, flipped, OC_SAVED_FLOAT, ANY_NUMBER),
    MEMBERS(oc_fault_watch, left, right, OC_SAVED_FLOAT, NOT_NEGATIVE),
};

/* The params are doubles from the cut-off to the one before use_accelerometer. */
static const oc_saved_member key_members[] = {
    MEMBER(oc_coefficients, vehicle.wheelbase, OC_SAVED_DOUBLE, ANY_NUMBER),
    MEMBER(oc_coefficients, vehicle.steering_ratio, OC_SAVED_DOUBLE, ANY_NUMBER),
    MEMBER(oc_coefficients, vehicle.traffic_side, OC_SAVED_DOUBLE, ANY_NUMBER),
    MEMBER(oc_coefficients, vehicle.ratio.terms, OC_SAVED_INT32, ANY_NUMBER),
    MEMBER(oc_coefficients, vehicle.ratio.coefficients, OC_SAVED_DOUBLE, ANY_NUMBER),
    MEMBER(oc_coefficients, vehicle.ratio.ratio, OC_SAVED_DOUBLE, ANY_NUMBER),
    MEMBER(oc_coefficients, vehicle.track_width_front, OC_SAVED_DOUBLE, ANY_NUMBER),
    MEMBER(oc_coefficients, vehicle.track_width_rear, OC_SAVED_DOUBLE, ANY_NUMBER),
    MEMBERS(oc_coefficients, params.cutoff_hz, params.tandem_side_force_m2_s2, OC_SAVED_DOUBLE, ANY_NUMBER),
    MEMBER(oc_coefficients, params.use_accelerometer, OC_SAVED_INT32, ANY_NUMBER),
    MEMBER(oc_coefficients, rate_hz, OC_SAVED_DOUBLE, ANY_NUMBER),
};

/* Structs of one kind, one after the other. */
typedef struct {
    const oc_saved_member *members;
    uint16_t first, stride; /* bytes */
    uint8_t count, of;      /* members, structs */
} saved_part;

#define PART(members, type, place, of)                                                                                \
    {members, offsetof(oc_state, place), sizeof(type), sizeof(members) / sizeof *(members), of}

static const saved_part state_parts[] = {
    PART(moments_members, oc_moments, evidence.offset, 3),
    PART(understeer_members, oc_understeer, evidence.understeer, 1),
    PART(moments_members, oc_moments, evidence.understeer.filling, 1),
    PART(standstill_members, oc_standstill, evidence.standstill, 1),
    PART(gyro_bias_members, oc_gyro_bias, evidence.gyro_bias, 1),
    PART(axle_members, oc_gyro_bias_axle, evidence.gyro_bias.axles, OC_AXLE_COUNT),
    PART(wheel_speed_members, oc_wheel_speed, evidence.wheel_speed, 1),
    PART(joint_members, oc_joint, evidence.joint, 1),
    PART(second_members, oc_second, evidence.joint.second, 1),
    PART(watch_members, oc_change_watch, evidence.joint.watch, 1),
    PART(changed_members, oc_changed, evidence.joint.changed, OC_CHANGES_MAX),
    PART(hypothesis_members, oc_hypothesis, evidence.joint.hypotheses, OC_JOINT_HYPOTHESES),
    PART(angle_members, oc_angle_evidence, evidence.angle, 1),
    PART(fault_members, oc_fault_evidence, evidence.fault, 1),
    PART(evidence_members, oc_evidence, evidence, 1),
    PART(estimate_members, oc_estimate, learned, OC_LEARNED_ESTIMATES),
    PART(truck_members, oc_angle_truck, learned.truck, 1),
    PART(tracking_members, oc_tracking, tracking, 1),
    PART(pending_members, oc_pending, tracking.straight, 2), /* and cornering */
    PART(moments_members, oc_moments, tracking.straight.blocks, OC_PENDING_MAX),
    PART(moments_members, oc_moments, tracking.cornering.blocks, OC_PENDING_MAX),
    PART(joint_tracking_members, oc_joint_tracking, tracking.joint, 1),
    PART(collected_members, oc_collected, tracking.joint.filling, 2), /* and taken */
    PART(sample_members, oc_motion_sample, tracking.joint.filling.samples, OC_JOINT_SAMPLES),
    PART(sample_members, oc_motion_sample, tracking.joint.taken.samples, OC_JOINT_SAMPLES),
    PART(fault_watch_members, oc_fault_watch, tracking.fault, 1),
};

oc_saved_kind oc_saved_kind_of(const oc_saved_member *member) {
    return (oc_saved_kind)(member->what / LIMITS_MAX);
}

size_t oc_saved_native_bytes(oc_saved_kind kind) {
    return NATIVE_BYTES(kind);
}

size_t oc_saved_image_bytes(oc_saved_kind kind) {
    return kind == OC_SAVED_ENUM ? 1 : oc_saved_native_bytes(kind);
}

bool oc_saved_next(oc_saved_cursor *cursor) {
    if (cursor->part == sizeof state_parts / sizeof *state_parts) {
        return false;
    }
    const saved_part *part = &state_parts[cursor->part];
    cursor->member = &part->members[cursor->row];
    cursor->place = part->first + (size_t)cursor->number * part->stride + cursor->member->offset;
    if (++cursor->row == part->count) {
        cursor->row = 0;
        if (++cursor->number == part->of) {
            cursor->number = 0;
            ++cursor->part;
        }
    }
    return true;
}

const oc_saved_member *oc_keyed_member(size_t k) {
    return k < sizeof key_members / sizeof *key_members ? &key_members[k] : NULL;
}

bool oc_saved_in_range(const oc_saved_member *member, double value) {
    const uint32_t limit = member->what % LIMITS_MAX;
    return value >= (double)saved_limits[limit].low && value <= (double)saved_limits[limit].high;
}

typedef struct {
    float lower[OC_TERMS_TRIANGLE], inverse[OC_TERMS];
} factor;

/* Whether a triangle is one of sums of squares, but for rounding; and its factor, with an information of 1. Where a
 * pivot had to be lifted, a row of the factor is longer than the diagonal has it. */
static bool are_sums_of_squares(const float *triangle, float noise, factor *f) {
    float information[OC_TERMS], longest[OC_TERMS];
    for (int32_t row = 0; row < OC_TERMS; ++row) {
        information[row] = 1.0f;
        longest[row] = 1.000004f * oc_triangle_cell(triangle, row, row) / noise + 2.0f;
    }
    oc_triangle_factor(triangle, information, noise, f->lower, f->inverse);
    const float *cell = f->lower;
    for (int32_t row = 0; row < OC_TERMS; ++row) {
        float squares = 0.0f;
        for (int32_t column = 0; column <= row; ++column, ++cell) {
            squares += *cell * *cell;
        }
        if (!(squares <= longest[row])) {
            return false;
        }
    }
    return true;
}

/* By its correlations, so that all are of a size; either half of it, since a reading takes rows of both. */
static bool is_covariance(const oc_gyro_bias *gyro_bias) {
    static const float negligible = 1e-6f; /* of a correlation */
    factor f = {{0.0f}, {0.0f}};
    float per_sd[OC_GYRO_BIAS_STATES];
    float *cell = f.lower; /* of correlations first, then of their factor */
    for (int32_t row = 0; row < OC_GYRO_BIAS_STATES; ++row) {
        per_sd[row] = 1.0f / sqrtf((float)gyro_bias->P[row][row] + 1e-30f);
        for (int32_t column = 0; column <= row; ++column, ++cell) {
            const float scale = per_sd[row] * per_sd[column];
            *cell = scale * (float)gyro_bias->P[row][column];
            if (!(fabsf(scale * (float)gyro_bias->P[column][row] - *cell) <= negligible)) {
                return false;
            }
        }
    }
    return are_sums_of_squares(f.lower, negligible, &f);
}

/* What a hypothesis divides by is positive, its scatter sums of squares; and what goes toward the target no more than
 * deviations of the target can make of these. */
static bool is_hypothesis(const oc_hypothesis *h) {
    static const float target_squares = 1e9f; /* rad^2, of a day's seconds each a turn off */
    factor f;
    float toward[OC_TERMS];
    for (int32_t term = 0; term < OC_TERMS; ++term) {
        toward[term] = h->toward[term];
    }
    const float noise = oc_hypothesis_noise(h);
    return h->play.half_width > 0.0f && h->variance > 1e-8f && (h->play.friction < 0.0f || h->play.creep > 0.01f) &&
           are_sums_of_squares(h->scatter, noise, &f) &&
           oc_triangle_variance(f.lower, f.inverse, 0, toward) <= target_squares * noise;
}

static bool is_joint(const oc_joint *joint, const oc_joint_design *design) {
    if (!joint->started) {
        return true;
    }
    if (!(joint->best < joint->count)) {
        return false;
    }
    float age = 0.0f; /* of the eldest */
    for (int32_t k = 0; k < joint->count; ++k) {
        if (!is_hypothesis(&joint->hypotheses[k])) {
            return false;
        }
        age = oc_most(age, joint->hypotheses[k].age);
    }
    /* one is older than the trial that the next second gives it: else no hypothesis would have a say */
    const oc_second *second = &joint->second;
    const bool all_on_trial = second->used_s > 60.0f && age <= oc_within(0.05f * second->used_s, 60.0f, 600.0f);
    return !all_on_trial && second->second_s > 0.0f && second->reference > 0.0f &&
           joint->phase < design->ticks_per_sample;
}

/* Blocks that wait are no more than make one final; samples at work are among those that wait; what is divided by once
 * hypotheses take samples in is known. */
static bool is_tracking(const oc_tracking *tracking, const oc_coefficients *c) {
    return tracking->straight.count <= c->blocks_until_final && tracking->cornering.count <= c->blocks_until_final &&
           tracking->joint.filling.count < c->joint.samples_per_second &&
           (tracking->joint.turns == 0 ||
            (tracking->joint.prior.unloading_sd > 1e-6f && tracking->joint.prior.yaw_rate_bias_sd > 1e-7f));
}

bool oc_saved_plausible(oc_state *state, const oc_coefficients *c) {
    oc_joint *joint = &state->evidence.joint;
    const float memory_s = state->evidence.gyro_bias.past.memory_s;
    const bool has_place = joint->hypotheses[joint->best].play.half_width > 0.0f;
    return is_covariance(&state->evidence.gyro_bias) && is_joint(joint, &c->joint) &&
           state->tracking.joint.turns <= joint->count + 1 && is_tracking(&state->tracking, c) &&
           !(memory_s > 0.0f && memory_s < 0.1f) && (has_place || !(state->learned.backlash.evidence > 0.0));
}

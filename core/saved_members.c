#include "saved_members.h"

typedef enum {
    ANY_NUMBER,
    NOT_NEGATIVE,
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
    HYPOTHESES_DONE,
    STEPS_DUE,
    OF_SAMPLE,
    OF_BLOCK,
    OF_LONG_BLOCK,
    ANY_STATUS,
    ANY_CHANGE,
    ANY_FAULT,
    SHARE,
    LIMIT_COUNT
} saved_limit;

/* Wider than any drive needs; zero, which is not yet learned, is within each. */
static const struct {
    double low, high;
} saved_limits[LIMIT_COUNT] = {
    [ANY_NUMBER] = {-1e30, 1e30},
    [NOT_NEGATIVE] = {0.0, 1e30},
    [ANY_ANGLE] = {-200.0, 200.0},
    [ANY_YAW_RATE] = {-10.0, 10.0},
    [ANY_ACCELERATION] = {-100.0, 100.0},
    [ROAD_SPEED] = {-150.0, 150.0},
    [TOTAL] = {0.0, 9007199254740992.0}, /* 2^53 */
    [COUNTER] = {0.0, 1e9},
    [YES_OR_NO] = {0.0, 1.0},
    [HALF_WIDTH] = {0.0, 0.25},
    [FRICTION_OR_NONE] = {-1.0, 10.0},
    [ANY_HYPOTHESIS] = {0.0, OC_JOINT_HYPOTHESES - 1},
    [HYPOTHESES_DONE] = {0.0, OC_JOINT_HYPOTHESES},
    [STEPS_DUE] = {0.0, 5.0},
    [OF_SAMPLE] = {0.0, 31.0},
    [OF_BLOCK] = {0.0, OC_SECONDS_PER_BLOCK - 1},
    [OF_LONG_BLOCK] = {0.0, OC_SECONDS_PER_LONG_BLOCK - 1},
    [ANY_STATUS] = {0.0, OC_STATUS_COUNT - 1},
    [ANY_CHANGE] = {0.0, OC_CHANGE_BENDS},
    [ANY_FAULT] = {0.0, OC_FAULT_COUNT - 1},
    [SHARE] = {0.0, 1.0},
};

/* A macro, so that offset and size cannot be of two members. */
#define MEMBER(type, member, kind, limit) {offsetof(type, member), sizeof(((type *)0)->member), kind, limit}

static const oc_saved_member moments_members[] = {
    MEMBER(oc_moments, weight, OC_SAVED_DOUBLE, NOT_NEGATIVE), MEMBER(oc_moments, y, OC_SAVED_DOUBLE, ANY_ANGLE),
    MEMBER(oc_moments, x, OC_SAVED_DOUBLE, ANY_NUMBER),        MEMBER(oc_moments, w, OC_SAVED_DOUBLE, ANY_NUMBER),
    MEMBER(oc_moments, yy, OC_SAVED_DOUBLE, NOT_NEGATIVE),     MEMBER(oc_moments, xy, OC_SAVED_DOUBLE, ANY_NUMBER),
    MEMBER(oc_moments, xx, OC_SAVED_DOUBLE, NOT_NEGATIVE),
};

static const oc_saved_member understeer_members[] = {
    MEMBER(oc_understeer, x, OC_SAVED_DOUBLE, ANY_NUMBER),
    MEMBER(oc_understeer, xx, OC_SAVED_DOUBLE, NOT_NEGATIVE),
    MEMBER(oc_understeer, xy, OC_SAVED_DOUBLE, ANY_NUMBER),
    MEMBER(oc_understeer, weight, OC_SAVED_DOUBLE, NOT_NEGATIVE),
    MEMBER(oc_understeer, batches, OC_SAVED_DOUBLE, NOT_NEGATIVE),
    MEMBER(oc_understeer, batches_xx, OC_SAVED_DOUBLE, NOT_NEGATIVE),
    MEMBER(oc_understeer, xy_xy, OC_SAVED_DOUBLE, NOT_NEGATIVE),
    MEMBER(oc_understeer, x_x, OC_SAVED_DOUBLE, NOT_NEGATIVE),
    MEMBER(oc_understeer, xx_xx, OC_SAVED_DOUBLE, NOT_NEGATIVE),
    MEMBER(oc_understeer, xy_x, OC_SAVED_DOUBLE, ANY_NUMBER),
    MEMBER(oc_understeer, xy_xx, OC_SAVED_DOUBLE, ANY_NUMBER),
    MEMBER(oc_understeer, x_xx, OC_SAVED_DOUBLE, ANY_NUMBER),
};

static const oc_saved_member standstill_members[] = {
    MEMBER(oc_standstill, weight, OC_SAVED_DOUBLE, NOT_NEGATIVE),
    MEMBER(oc_standstill, yaw_rate, OC_SAVED_DOUBLE, ANY_YAW_RATE),
    MEMBER(oc_standstill, lateral_acceleration, OC_SAVED_DOUBLE, ANY_ACCELERATION),
    MEMBER(oc_standstill, yaw_rate_squares, OC_SAVED_DOUBLE, NOT_NEGATIVE),
    MEMBER(oc_standstill, lateral_acceleration_squares, OC_SAVED_DOUBLE, NOT_NEGATIVE),
    MEMBER(oc_standstill, acceleration_weight, OC_SAVED_DOUBLE, NOT_NEGATIVE),
    MEMBER(oc_standstill, still_ticks, OC_SAVED_INT32, COUNTER),
};

static const oc_saved_member gyro_bias_members[] = {
    MEMBER(oc_gyro_bias, x, OC_SAVED_DOUBLE, ANY_YAW_RATE),
    MEMBER(oc_gyro_bias, P, OC_SAVED_DOUBLE, ANY_NUMBER),
    MEMBER(oc_gyro_bias, up, OC_SAVED_DOUBLE, NOT_NEGATIVE),
    MEMBER(oc_gyro_bias, down, OC_SAVED_DOUBLE, NOT_NEGATIVE),
    MEMBER(oc_gyro_bias, alarm_blocks, OC_SAVED_DOUBLE, NOT_NEGATIVE),
    MEMBER(oc_gyro_bias, alarm_time, OC_SAVED_DOUBLE, NOT_NEGATIVE),
    MEMBER(oc_gyro_bias, alarm_variance, OC_SAVED_DOUBLE, NOT_NEGATIVE),
    MEMBER(oc_gyro_bias, time, OC_SAVED_DOUBLE, ANY_NUMBER),
    MEMBER(oc_gyro_bias, block_time, OC_SAVED_DOUBLE, ANY_NUMBER),
    MEMBER(oc_gyro_bias, block_ticks, OC_SAVED_DOUBLE, NOT_NEGATIVE),
    MEMBER(oc_gyro_bias, still, OC_SAVED_DOUBLE, NOT_NEGATIVE),
    MEMBER(oc_gyro_bias, still_yaw_rate, OC_SAVED_DOUBLE, ANY_YAW_RATE),
    MEMBER(oc_gyro_bias, still_squares, OC_SAVED_DOUBLE, NOT_NEGATIVE),
    MEMBER(oc_gyro_bias, still_blocks, OC_SAVED_DOUBLE, NOT_NEGATIVE),
    MEMBER(oc_gyro_bias, evidence, OC_SAVED_DOUBLE, NOT_NEGATIVE),
    MEMBER(oc_gyro_bias, wheel_evidence, OC_SAVED_DOUBLE, NOT_NEGATIVE),
    MEMBER(oc_gyro_bias, due, OC_SAVED_INT32, STEPS_DUE),
    MEMBER(oc_gyro_bias, still_ticks, OC_SAVED_INT32, COUNTER),
    MEMBER(oc_gyro_bias, started, OC_SAVED_INT32, YES_OR_NO),
    MEMBER(oc_gyro_bias, running, OC_SAVED_INT32, YES_OR_NO),
    MEMBER(oc_gyro_bias, has_wheels, OC_SAVED_INT32, YES_OR_NO),
    MEMBER(oc_gyro_bias, status, OC_SAVED_STATUS, ANY_STATUS),
    MEMBER(oc_gyro_bias, sd, OC_SAVED_DOUBLE, NOT_NEGATIVE),
};

static const oc_saved_member axle_members[] = {
    MEMBER(oc_gyro_bias_axle, weight, OC_SAVED_DOUBLE, NOT_NEGATIVE),
    MEMBER(oc_gyro_bias_axle, difference, OC_SAVED_DOUBLE, ANY_NUMBER),
    MEMBER(oc_gyro_bias_axle, speed, OC_SAVED_DOUBLE, ANY_NUMBER),
    MEMBER(oc_gyro_bias_axle, yaw_rate, OC_SAVED_DOUBLE, ANY_NUMBER),
    MEMBER(oc_gyro_bias_axle, acceleration, OC_SAVED_DOUBLE, ANY_NUMBER),
    MEMBER(oc_gyro_bias_axle, flat, OC_SAVED_DOUBLE, NOT_NEGATIVE),
    MEMBER(oc_gyro_bias_axle, last, OC_SAVED_DOUBLE, ROAD_SPEED),
    MEMBER(oc_gyro_bias_axle, plateau, OC_SAVED_DOUBLE, ROAD_SPEED),
    MEMBER(oc_gyro_bias_axle, quantum, OC_SAVED_DOUBLE, NOT_NEGATIVE),
    MEMBER(oc_gyro_bias_axle, held, OC_SAVED_DOUBLE, NOT_NEGATIVE),
    MEMBER(oc_gyro_bias_axle, noise, OC_SAVED_DOUBLE, NOT_NEGATIVE),
    MEMBER(oc_gyro_bias_axle, before, OC_SAVED_DOUBLE, ANY_NUMBER),
    MEMBER(oc_gyro_bias_axle, before_speed, OC_SAVED_DOUBLE, ROAD_SPEED),
    MEMBER(oc_gyro_bias_axle, before_load, OC_SAVED_DOUBLE, ANY_NUMBER),
    MEMBER(oc_gyro_bias_axle, before_yaw_rate, OC_SAVED_DOUBLE, ANY_YAW_RATE),
    MEMBER(oc_gyro_bias_axle, variance, OC_SAVED_DOUBLE, NOT_NEGATIVE),
    MEMBER(oc_gyro_bias_axle, innovation, OC_SAVED_DOUBLE, ANY_NUMBER),
    MEMBER(oc_gyro_bias_axle, blocks, OC_SAVED_DOUBLE, NOT_NEGATIVE),
    MEMBER(oc_gyro_bias_axle, is_heard, OC_SAVED_INT32, YES_OR_NO),
};

static const oc_saved_member wheel_speed_members[] = {
    MEMBER(oc_wheel_speed, difference, OC_SAVED_DOUBLE, ANY_NUMBER),
    MEMBER(oc_wheel_speed, distance, OC_SAVED_DOUBLE, NOT_NEGATIVE),
    MEMBER(oc_wheel_speed, time, OC_SAVED_DOUBLE, NOT_NEGATIVE),
};

static const oc_saved_member joint_members[] = {
    MEMBER(oc_joint, started, OC_SAVED_INT32, YES_OR_NO),
    MEMBER(oc_joint, best, OC_SAVED_INT32, ANY_HYPOTHESIS),
    MEMBER(oc_joint, born, OC_SAVED_INT32, ANY_HYPOTHESIS),
    MEMBER(oc_joint, phase, OC_SAVED_INT32, OF_SAMPLE),
    MEMBER(oc_joint, in_block, OC_SAVED_INT32, OF_BLOCK),
    MEMBER(oc_joint, in_long_block, OC_SAVED_INT32, OF_LONG_BLOCK),
    MEMBER(oc_joint, begun, OC_SAVED_INT32, HYPOTHESES_DONE),
    MEMBER(oc_joint, found, OC_SAVED_INT32, HYPOTHESES_DONE),
    MEMBER(oc_joint, along, OC_SAVED_FLOAT, ANY_NUMBER),
    MEMBER(oc_joint, across, OC_SAVED_FLOAT, ANY_NUMBER),
    MEMBER(oc_joint, lost, OC_SAVED_INT32, YES_OR_NO),
    MEMBER(oc_joint, to_left, OC_SAVED_FLOAT, NOT_NEGATIVE),
    MEMBER(oc_joint, to_right, OC_SAVED_FLOAT, NOT_NEGATIVE),
    MEMBER(oc_joint, yaw_rate_bias, OC_SAVED_DOUBLE, ANY_YAW_RATE),
    MEMBER(oc_joint, yaw_rate_bias_variance, OC_SAVED_DOUBLE, NOT_NEGATIVE),
    MEMBER(oc_joint, correction, OC_SAVED_FLOAT, ANY_YAW_RATE),
    MEMBER(oc_joint, corrected, OC_SAVED_INT32, HYPOTHESES_DONE),
    MEMBER(oc_joint, loaded, OC_SAVED_INT32, HYPOTHESES_DONE),
    MEMBER(oc_joint, concluded, OC_SAVED_INT32, HYPOTHESES_DONE),
    MEMBER(oc_joint, speed_mean, OC_SAVED_DOUBLE, ROAD_SPEED),
    MEMBER(oc_joint, bank_mean, OC_SAVED_DOUBLE, ANY_ACCELERATION),
    MEMBER(oc_joint, bank_samples, OC_SAVED_DOUBLE, NOT_NEGATIVE),
    MEMBER(oc_joint, changes, OC_SAVED_INT32, COUNTER),
};

static const oc_saved_member second_members[] = {
    MEMBER(oc_second, used_s, OC_SAVED_FLOAT, NOT_NEGATIVE),
    MEMBER(oc_second, trial_s, OC_SAVED_FLOAT, NOT_NEGATIVE),
    MEMBER(oc_second, best_cost, OC_SAVED_FLOAT, ANY_NUMBER),
    MEMBER(oc_second, second_s, OC_SAVED_FLOAT, NOT_NEGATIVE),
    MEMBER(oc_second, memory_share, OC_SAVED_FLOAT, YES_OR_NO),
    MEMBER(oc_second, reference, OC_SAVED_FLOAT, NOT_NEGATIVE),
    MEMBER(oc_second, learns, OC_SAVED_INT32, YES_OR_NO),
    MEMBER(oc_second, block_ends, OC_SAVED_INT32, YES_OR_NO),
    MEMBER(oc_second, long_block_ends, OC_SAVED_INT32, YES_OR_NO),
    MEMBER(oc_second, blocks, OC_SAVED_INT32, COUNTER),
    MEMBER(oc_second, long_blocks, OC_SAVED_INT32, COUNTER),
};

static const oc_saved_member cusum_members[] = {
    MEMBER(oc_cusum, up, OC_SAVED_FLOAT, NOT_NEGATIVE),
    MEMBER(oc_cusum, down, OC_SAVED_FLOAT, NOT_NEGATIVE),
    MEMBER(oc_cusum, seconds_up, OC_SAVED_FLOAT, NOT_NEGATIVE),
    MEMBER(oc_cusum, seconds_down, OC_SAVED_FLOAT, NOT_NEGATIVE),
};

static const oc_saved_member watch_members[] = {
    MEMBER(oc_change_watch, rest, OC_SAVED_FLOAT, NOT_NEGATIVE),
    MEMBER(oc_change_watch, seconds, OC_SAVED_FLOAT, NOT_NEGATIVE),
    MEMBER(oc_change_watch, error, OC_SAVED_FLOAT, ANY_NUMBER),
    MEMBER(oc_change_watch, error_curvature, OC_SAVED_FLOAT, ANY_NUMBER),
    MEMBER(oc_change_watch, curvature_squares, OC_SAVED_FLOAT, NOT_NEGATIVE),
};

static const oc_saved_member changed_members[] = {
    MEMBER(oc_changed, time, OC_SAVED_DOUBLE, ANY_NUMBER),
    MEMBER(oc_changed, before, OC_SAVED_DOUBLE, ANY_ANGLE),
    MEMBER(oc_changed, before_sd, OC_SAVED_DOUBLE, NOT_NEGATIVE),
    MEMBER(oc_changed, change.kind, OC_SAVED_CHANGE, ANY_CHANGE),
    MEMBER(oc_changed, change.size, OC_SAVED_FLOAT, ANY_ANGLE),
    MEMBER(oc_changed, change.size_sd, OC_SAVED_FLOAT, NOT_NEGATIVE),
    MEMBER(oc_changed, change.seconds, OC_SAVED_FLOAT, NOT_NEGATIVE),
};

static const oc_saved_member hypothesis_members[] = {
    MEMBER(oc_hypothesis, play.half_width, OC_SAVED_FLOAT, HALF_WIDTH),
    MEMBER(oc_hypothesis, play.unloading, OC_SAVED_FLOAT, ANY_ACCELERATION),
    MEMBER(oc_hypothesis, play.friction, OC_SAVED_FLOAT, FRICTION_OR_NONE),
    MEMBER(oc_hypothesis, play.creep, OC_SAVED_FLOAT, NOT_NEGATIVE),
    MEMBER(oc_hypothesis, play.windup, OC_SAVED_FLOAT, HALF_WIDTH),
    MEMBER(oc_hypothesis, play.unwinding, OC_SAVED_FLOAT, NOT_NEGATIVE),
    MEMBER(oc_hypothesis, play.wind, OC_SAVED_FLOAT, ANY_ACCELERATION),
    MEMBER(oc_hypothesis, places, OC_SAVED_FLOAT, ANY_ANGLE), /* a struct of floats alone */
    MEMBER(oc_hypothesis, sums, OC_SAVED_FLOAT, ANY_NUMBER),
    MEMBER(oc_hypothesis, target_sum, OC_SAVED_FLOAT, ANY_NUMBER),
    MEMBER(oc_hypothesis, weight, OC_SAVED_FLOAT, NOT_NEGATIVE),
    MEMBER(oc_hypothesis, target_mean, OC_SAVED_FLOAT, ANY_ANGLE),
    MEMBER(oc_hypothesis, means, OC_SAVED_FLOAT, ANY_NUMBER),
    MEMBER(oc_hypothesis, scatter, OC_SAVED_FLOAT, ANY_NUMBER),
    MEMBER(oc_hypothesis, toward, OC_SAVED_FLOAT, ANY_NUMBER),
    MEMBER(oc_hypothesis, constant, OC_SAVED_FLOAT, ANY_ANGLE),
    MEMBER(oc_hypothesis, terms, OC_SAVED_FLOAT, ANY_NUMBER),
    MEMBER(oc_hypothesis, variance, OC_SAVED_FLOAT, NOT_NEGATIVE),
    MEMBER(oc_hypothesis, blocks.sum, OC_SAVED_FLOAT, ANY_NUMBER),
    MEMBER(oc_hypothesis, blocks.factor, OC_SAVED_FLOAT, NOT_NEGATIVE),
    MEMBER(oc_hypothesis, long_blocks.sum, OC_SAVED_FLOAT, ANY_NUMBER),
    MEMBER(oc_hypothesis, long_blocks.factor, OC_SAVED_FLOAT, NOT_NEGATIVE),
    MEMBER(oc_hypothesis, trust, OC_SAVED_FLOAT, YES_OR_NO),
    MEMBER(oc_hypothesis, error, OC_SAVED_FLOAT, ANY_NUMBER),
    MEMBER(oc_hypothesis, curvature, OC_SAVED_FLOAT, ANY_NUMBER),
    MEMBER(oc_hypothesis, age, OC_SAVED_FLOAT, NOT_NEGATIVE),
    MEMBER(oc_hypothesis, cost, OC_SAVED_FLOAT, ANY_NUMBER),
    MEMBER(oc_hypothesis, offset, OC_SAVED_FLOAT, ANY_ANGLE),
    MEMBER(oc_hypothesis, offset_variance, OC_SAVED_FLOAT, NOT_NEGATIVE),
    MEMBER(oc_hypothesis, gradient, OC_SAVED_FLOAT, ANY_NUMBER),
    MEMBER(oc_hypothesis, gradient_variance, OC_SAVED_FLOAT, NOT_NEGATIVE),
    MEMBER(oc_hypothesis, wheelbase, OC_SAVED_FLOAT, ANY_NUMBER),
    MEMBER(oc_hypothesis, wheelbase_variance, OC_SAVED_FLOAT, NOT_NEGATIVE),
    MEMBER(oc_hypothesis, width_variance, OC_SAVED_FLOAT, NOT_NEGATIVE),
    MEMBER(oc_hypothesis, unloading, OC_SAVED_FLOAT, ANY_ACCELERATION),
    MEMBER(oc_hypothesis, unloading_variance, OC_SAVED_FLOAT, NOT_NEGATIVE),
};

static const oc_saved_member angle_members[] = {
    MEMBER(oc_angle_evidence, slopes, OC_SAVED_DOUBLE, NOT_NEGATIVE),
    MEMBER(oc_angle_evidence, products, OC_SAVED_DOUBLE, ANY_NUMBER),
    MEMBER(oc_angle_evidence, steady, OC_SAVED_DOUBLE, ANY_NUMBER),
    MEMBER(oc_angle_evidence, spread, OC_SAVED_DOUBLE, NOT_NEGATIVE),
    MEMBER(oc_angle_evidence, seconds, OC_SAVED_DOUBLE, NOT_NEGATIVE),
};

static const oc_saved_member side_slip_members[] = {
    MEMBER(oc_side_slip_evidence, information, OC_SAVED_DOUBLE, ANY_NUMBER),
    MEMBER(oc_side_slip_evidence, sums, OC_SAVED_DOUBLE, ANY_NUMBER),
};

static const oc_saved_member fault_members[] = {
    MEMBER(oc_fault_evidence, fault, OC_SAVED_FAULT, ANY_FAULT),
    MEMBER(oc_fault_evidence, confidence, OC_SAVED_FLOAT, SHARE),
    MEMBER(oc_fault_evidence, wider, OC_SAVED_FLOAT, NOT_NEGATIVE),
};

static const oc_saved_member evidence_members[] = {
    MEMBER(oc_evidence, verdicts.offset_trusted, OC_SAVED_INT32, YES_OR_NO),
    MEMBER(oc_evidence, verdicts.offset_status, OC_SAVED_STATUS, ANY_STATUS),
    MEMBER(oc_evidence, verdicts.understeer_status, OC_SAVED_STATUS, ANY_STATUS),
    MEMBER(oc_evidence, verdicts.backlash_status, OC_SAVED_STATUS, ANY_STATUS),
    MEMBER(oc_evidence, ticks, OC_SAVED_UINT64, TOTAL),
    MEMBER(oc_evidence, rejected, OC_SAVED_UINT64, TOTAL),
    MEMBER(oc_evidence, unused_motion, OC_SAVED_UINT64, TOTAL),
    MEMBER(oc_evidence, bank_ticks, OC_SAVED_DOUBLE, NOT_NEGATIVE),
    MEMBER(oc_evidence, bank_sum, OC_SAVED_DOUBLE, ANY_NUMBER),
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
    {offsetof(oc_coefficients, params.cutoff_hz),
     offsetof(oc_coefficients, params.use_accelerometer) - offsetof(oc_coefficients, params.cutoff_hz), OC_SAVED_DOUBLE,
     ANY_NUMBER},
    MEMBER(oc_coefficients, params.use_accelerometer, OC_SAVED_INT32, ANY_NUMBER),
    MEMBER(oc_coefficients, rate_hz, OC_SAVED_DOUBLE, ANY_NUMBER),
};

/* Structs of one kind, one after the other. */
typedef struct {
    const oc_saved_member *members;
    uint16_t count;             /* of members */
    uint16_t first, stride, of; /* bytes, bytes, how many */
} saved_part;

#define PART(members, type, place, of) {members, sizeof(members) / sizeof *(members), offsetof(oc_evidence, place), sizeof(type), of}

static const saved_part evidence_parts[] = {
    PART(moments_members, oc_moments, offset.ticks, 1),
    PART(moments_members, oc_moments, offset.filling, 1),
    PART(moments_members, oc_moments, offset.batches, 1),
    PART(understeer_members, oc_understeer, understeer, 1),
    PART(moments_members, oc_moments, understeer.filling, 1),
    PART(standstill_members, oc_standstill, standstill, 1),
    PART(gyro_bias_members, oc_gyro_bias, gyro_bias, 1),
    PART(axle_members, oc_gyro_bias_axle, gyro_bias.axles, OC_AXLE_COUNT),
    PART(wheel_speed_members, oc_wheel_speed, wheel_speed, 1),
    PART(joint_members, oc_joint, joint, 1),
    PART(second_members, oc_second, joint.second, 1),
    PART(watch_members, oc_change_watch, joint.watch, 1),
    PART(cusum_members, oc_cusum, joint.watch.offset, 1),
    PART(cusum_members, oc_cusum, joint.watch.bends, 1),
    PART(changed_members, oc_changed, joint.changed, OC_CHANGES_MAX),
    PART(hypothesis_members, oc_hypothesis, joint.hypotheses, OC_JOINT_HYPOTHESES),
    PART(angle_members, oc_angle_evidence, angle, 1),
    PART(side_slip_members, oc_side_slip_evidence, angle.side_slip, 1),
    PART(fault_members, oc_fault_evidence, fault, 1),
    {evidence_members, sizeof evidence_members / sizeof *evidence_members, 0, sizeof(oc_evidence), 1},
};

size_t oc_saved_native_bytes(oc_saved_kind kind) {
    static const uint8_t bytes[OC_SAVED_KIND_COUNT] = {
        sizeof(double), sizeof(float), sizeof(int32_t), sizeof(uint64_t), sizeof(oc_status), sizeof(oc_change_kind),
        sizeof(oc_fault)};
    return bytes[kind];
}

size_t oc_saved_image_bytes(oc_saved_kind kind) {
    static const uint8_t bytes[OC_SAVED_KIND_COUNT] = {8, 4, 4, 8, 1, 1, 1};
    return bytes[kind];
}

static bool visit_all(const oc_saved_member *members, size_t count, size_t first, oc_saved_visit visit, void *with) {
    for (size_t k = 0; k < count; ++k) {
        if (!visit(with, &members[k], first + members[k].offset)) {
            return false;
        }
    }
    return true;
}

bool oc_saved_members(oc_saved_visit visit, void *with) {
    for (size_t k = 0; k < sizeof evidence_parts / sizeof *evidence_parts; ++k) {
        const saved_part *part = &evidence_parts[k];
        for (size_t number = 0; number < part->of; ++number) {
            if (!visit_all(part->members, part->count, part->first + number * part->stride, visit, with)) {
                return false;
            }
        }
    }
    return true;
}

bool oc_keyed_members(oc_saved_visit visit, void *with) {
    return visit_all(key_members, sizeof key_members / sizeof *key_members, 0, visit, with);
}

bool oc_saved_in_range(const oc_saved_member *member, double value) {
    return value >= saved_limits[member->limit].low && value <= saved_limits[member->limit].high;
}

/* Variances on the diagonal, and no correlation beyond 1 but for rounding. */
static bool is_covariance(const oc_gyro_bias *gyro_bias) {
    for (int32_t row = 0; row < OC_GYRO_BIAS_STATES; ++row) {
        const double variance = gyro_bias->P[row][row];
        for (int32_t column = 0; column <= row; ++column) {
            const double covariance = gyro_bias->P[row][column];
            if (!(variance >= 0.0) ||
                !(covariance * covariance <= 1.001 * variance * gyro_bias->P[column][column] + 1e-30)) {
                return false;
            }
        }
    }
    return true;
}

/* What a hypothesis divides by is positive, its scatter a sum of squares. */
static bool is_hypothesis(const oc_hypothesis *h) {
    for (int32_t term = 0; term < OC_TERMS; ++term) {
        if (!(oc_triangle_cell(h->scatter, term, term) >= 0.0f)) {
            return false;
        }
    }
    return h->play.half_width > 0.0f && h->variance > 0.0f && (h->play.friction < 0.0f || h->play.creep > 0.0f);
}

static bool is_joint(const oc_joint *joint, const oc_joint_design *design) {
    if (!joint->started) {
        return true;
    }
    for (int32_t k = 0; k < joint->begun; ++k) {
        if (!is_hypothesis(&joint->hypotheses[k])) {
            return false;
        }
    }
    return joint->second.second_s > 0.0f && joint->second.reference > 0.0f && joint->phase < design->ticks_per_sample;
}

bool oc_saved_plausible(const oc_evidence *evidence, const oc_coefficients *c) {
    return is_covariance(&evidence->gyro_bias) && is_joint(&evidence->joint, &c->joint);
}

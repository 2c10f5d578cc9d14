#include "motion.h"

#include <math.h>

/* Tuned, in tuned.toml: motion */
static const double bank_difference_max = 1.2; /* m/s^2: of two minutes' mean banks */
/* end */

void oc_pending_drop(oc_pending *pending) {
    if (pending->ticks == 0 && pending->count == 0) {
        return;
    }
    pending->filling = (oc_sums){0};
    pending->ticks = 0;
    pending->count = 0;
}

bool oc_pending_add(oc_pending *pending, int32_t ticks_per_block, int32_t blocks_until_final, double y, double x,
                    double w, oc_moments *final) {
    oc_sums_add(&pending->filling, y, x, w);
    if (++pending->ticks < ticks_per_block) {
        return false;
    }
    const oc_moments whole = oc_moments_of(&pending->filling);
    pending->filling = (oc_sums){0};
    pending->ticks = 0;
    const bool is_final = pending->count == blocks_until_final; /* clean blocks after the oldest one */
    if (is_final) {
        *final = pending->blocks[pending->first];
        pending->first = (pending->first + 1) % OC_PENDING_MAX;
        --pending->count;
    }
    pending->blocks[(pending->first + pending->count) % OC_PENDING_MAX] = whole;
    ++pending->count;
    return is_final;
}

oc_motion oc_motion_of(const oc_filtered *tick, double ratio_times_wheelbase, double ratio_times_rear_weight,
                       bool use_accelerometer) {
    const double r = tick->yaw_rate;
    const double v = tick->vehicle_speed;
    const double curvature = r / (v > 1.0 ? v : 1.0);
    const double rear_part = ratio_times_rear_weight * tick->rear_axle_angle;
    return (oc_motion){
        .curvature = curvature,
        .longitudinal_acceleration = tick->longitudinal_acceleration,
        .bank = use_accelerometer ? tick->lateral_acceleration - r * v : 0.0,
        .lateral_acceleration = use_accelerometer ? tick->lateral_acceleration : r * v,
        .rear_part = rear_part,
        .residual = tick->steering_wheel_angle - rear_part - ratio_times_wheelbase * curvature,
    };
}

uint32_t oc_gate(const oc_params *params, const oc_motion *motion, double speed) {
    const bool fast = speed > params->speed_min_m_s;
    const bool straight = fabs(motion->curvature) < params->curvature_max_1_m;
    const bool steady = fabs(motion->longitudinal_acceleration) < params->longitudinal_acceleration_max_m_s2;
    const bool level = fabs(motion->bank) < params->bank_max_m_s2;
    return (fast ? 0u : OC_REASON_SPEED) | (straight ? 0u : OC_REASON_CURVATURE) |
           (steady ? 0u : OC_REASON_LONGITUDINAL_ACCELERATION) | (level ? 0u : OC_REASON_BANK);
}

uint32_t oc_joint_gate(const oc_params *params, const oc_motion *motion, double speed, double bank_mean) {
    const bool fast = speed > params->joint_speed_min_m_s;
    const bool wide = fabs(motion->curvature) < params->joint_curvature_max_1_m;
    const bool gentle = fabs(motion->curvature) * speed * speed < params->joint_lateral_acceleration_max_m_s2;
    const bool steady = fabs(motion->longitudinal_acceleration) < params->joint_longitudinal_acceleration_max_m_s2;
    const bool usual = fabs(motion->bank - bank_mean) < params->joint_bank_change_max_m_s2;
    return (fast ? 0u : OC_REASON_SPEED) | (wide ? 0u : OC_REASON_CURVATURE) |
           (gentle ? 0u : OC_REASON_LATERAL_ACCELERATION) | (steady ? 0u : OC_REASON_LONGITUDINAL_ACCELERATION) |
           (usual ? 0u : OC_REASON_BANK);
}

bool oc_bank_watch_drifts(const oc_bank_watch *watch) {
    return watch->high - watch->low > bank_difference_max;
}

void oc_bank_watch_update(oc_bank_watch *watch, double bank, double ticks_per_minute) {
    watch->ticks += 1.0;
    watch->sum += bank;
    if (watch->ticks < ticks_per_minute) {
        return;
    }
    const double mean = watch->sum / watch->ticks;
    watch->low = watch->minutes > 0.0 && watch->low < mean ? watch->low : mean;
    watch->high = watch->minutes > 0.0 && watch->high > mean ? watch->high : mean;
    watch->minutes += 1.0;
    watch->ticks = watch->sum = 0.0;
}

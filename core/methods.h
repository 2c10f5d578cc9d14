#ifndef OC_METHODS_H
#define OC_METHODS_H
/* The two ways from clean motion to what is learned, between which the monitor chooses. */

#include "monitor.h"

/* (36) to (38), the thesis's: from yaw rate and speed as they are, or from wheel speeds. `y` is the residual in rad
 * that counts, which with wheel speeds is not yet corrected for their radii. */
void oc_estimate_straight_ahead(oc_state *state, const oc_coefficients *c, const oc_motion *motion, double speed,
                                double y, uint32_t reasons);
void oc_learn_straight_ahead(const oc_evidence *evidence, oc_verdicts *verdicts, oc_learned *learned,
                             const oc_coefficients *c);

/* The offset as it would be if what is pending were final, rad. */
double oc_temporary_offset(const oc_state *state, double understeer_gradient);

/* The mismatch of the radii by which the wheel speeds' method corrects. */
oc_estimate oc_wheel_mismatch_of(const oc_evidence *evidence, const oc_coefficients *c);

/* All hypotheses go along with every tick, and learn from whole seconds of clean ones. */
void oc_estimate_jointly(oc_state *state, const oc_coefficients *c, const oc_signals *raw,
                         const oc_filtered *filtered, const oc_motion *motion, uint32_t reasons);
/* The truck stands: its gyro's bias is told. */
void oc_stand_jointly(oc_state *state, const oc_coefficients *c);
/* What the hypotheses say together. */
void oc_learn_jointly(const oc_evidence *evidence, oc_verdicts *verdicts, oc_learned *learned,
                      const oc_coefficients *c);

/* Chapter 4: whether the sensor can be believed at this tick, whose signals are the valid ones, and the angle without
 * it. After a hole the estimate begins anew. */
void oc_follow_angle(oc_state *state, const oc_coefficients *c, const oc_signals *tick, uint32_t valid,
                     const oc_estimate *yaw_rate_bias, oc_angle *angle);

/* Of the offset as it was learned: it holds for the sensor as it was, not for one that is at fault. */
oc_status oc_offset_status(const oc_evidence *evidence, oc_status learned);

/* What a tick gave. */
void oc_tell(oc_output *output, const oc_state *state, const oc_coefficients *c, const oc_motion *motion, double speed,
             uint32_t reasons, const oc_angle *angle);

#endif

#ifndef OC_METHODS_H
#define OC_METHODS_H
/* The two ways from clean motion to what is learned, between which the monitor chooses. */

#include "monitor.h"
#include "tick.h"

/* (36) to (38), the thesis's: from yaw rate and speed as they are, or from wheel speeds. True where there is something
 * to learn. */
bool oc_estimate_straight_ahead(const oc_tick *tick, oc_tracking *tracking, oc_evidence *evidence,
                                const oc_coefficients *c);
void oc_learn_straight_ahead(const oc_evidence *evidence, oc_verdicts *verdicts, oc_learned *learned,
                             const oc_coefficients *c);

/* The offset as it would be if what is pending were final, rad. */
double oc_temporary_offset(const oc_state *state, double understeer_gradient);

/* The mismatch of the radii by which the wheel speeds' method corrects. */
oc_estimate oc_wheel_mismatch_of(const oc_evidence *evidence, const oc_coefficients *c);

/* By the wheel speeds' method, of a filtered tick: the yaw rate as if the wheels were of one radius. */
void oc_correct_wheel_speeds(oc_tick *tick, oc_evidence *evidence, const oc_coefficients *c);

/* A second is collected while the hypotheses take in the one before; while the truck stands they set right what its
 * gyro's bias shows. True where there is something to learn; `learned` is as before. */
bool oc_estimate_jointly(const oc_tick *tick, oc_tracking *tracking, oc_evidence *evidence, const oc_learned *learned,
                         const oc_coefficients *c);
/* What the hypotheses say together. */
void oc_learn_jointly(const oc_evidence *evidence, oc_verdicts *verdicts, oc_learned *learned,
                      const oc_coefficients *c);

/* Derives the truck that the angle observer needs from the rest that was learned. */
void oc_learn_truck(oc_learned *learned, const oc_joint *joint, const oc_coefficients *c);

/* Chapter 4: whether the sensor can be believed at this tick, and the angle without it. After a hole the estimate
 * begins anew. */
void oc_follow_angle(oc_tick *tick, oc_tracking *tracking, oc_evidence *evidence, const oc_learned *learned,
                     const oc_coefficients *c);

/* Of the offset as it was learned: it holds for the sensor as it was, not for one that is at fault. */
oc_status oc_offset_status(const oc_evidence *evidence, oc_status learned);

/* What a tick gave. */
void oc_publish(oc_output *output, const oc_state *state, const oc_coefficients *c, const oc_tick *tick);

#endif

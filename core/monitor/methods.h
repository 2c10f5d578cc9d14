#ifndef OC_METHODS_H
#define OC_METHODS_H
/* Two methods from clean motion to estimates; the monitor selects one. */

#include "monitor.h"
#include "tick.h"

/* Whether state and coefficients are in the condition that a call needs. */
oc_error oc_check_call(const oc_state *state, const oc_coefficients *c);

/* (36) to (38), the thesis's method, by measured yaw rate and speed or by wheel speeds. True where evidence grew. */
bool oc_estimate_straight_ahead(const oc_tick *tick, oc_tracking *tracking, oc_evidence *evidence,
                                const oc_coefficients *c);
void oc_learn_straight_ahead(const oc_evidence *evidence, oc_verdicts *verdicts, oc_learned *learned,
                             const oc_coefficients *c);

/* The offset including the pending blocks, rad. */
double oc_temporary_offset(const oc_state *state, double understeer_gradient);

/* The mismatch of the radii, for the correction of the wheel speeds' method. */
oc_estimate oc_wheel_mismatch_of(const oc_evidence *evidence, const oc_coefficients *c);

/* Corrects a filtered tick's yaw rate for the wheels' radii. */
void oc_correct_wheel_speeds(oc_tick *tick, oc_evidence *evidence, const oc_coefficients *c);

/* Collects a second, and begins the round in which the hypotheses process it; at standstill they only make
 * corrections. */
void oc_estimate_jointly(const oc_tick *tick, oc_tracking *tracking, oc_evidence *evidence, const oc_coefficients *c);
/* The vehicle's side of traffic, as in oc_vehicle; 0 also where superelevated bends show that the roads fall to the
 * other one. */
float oc_traffic_side(const oc_evidence *evidence, const oc_coefficients *c);
/* Solves all hypotheses' equations by the priors of `c`. */
void oc_solve_jointly(oc_tracking *tracking, oc_evidence *evidence, const oc_coefficients *c);
/* The weighted mean over the hypotheses, and its statuses. */
void oc_learn_jointly(const oc_evidence *evidence, oc_verdicts *verdicts, oc_learned *learned,
                      const oc_coefficients *c);

/* Derives the angle observer's truck from the estimates. */
void oc_learn_truck(oc_learned *learned, const oc_joint *joint, const oc_coefficients *c);

/* Chapter 4: filters the motion for the observer. After a hole the estimate begins anew. */
void oc_observe_motion(oc_tick *tick, oc_tracking *tracking, const oc_coefficients *c);

/* Chapter 4: monitors the sensor, and estimates the angle without it. */
void oc_follow_angle(oc_tick *tick, oc_tracking *tracking, oc_evidence *evidence, const oc_learned *learned,
                     const oc_coefficients *c);

/* Whether the offset is that of a front and a rear axle's sensors together, by which neither is corrected. */
bool oc_offset_is_combined(const oc_coefficients *c);

/* The offset's status: invalid while its sensor or a signal is at fault. */
oc_status oc_offset_status(const oc_state *state, oc_status learned);

/* The fault of the angle sensor; none while another signal, with which the sensor is compared, is at fault. */
oc_fault oc_published_fault(const oc_state *state);

/* Fills a tick's output. */
void oc_publish(oc_output *output, const oc_state *state, const oc_coefficients *c, const oc_tick *tick);

#endif

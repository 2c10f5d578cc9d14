#ifndef OC_HYPOTHESIS_SET_H
#define OC_HYPOTHESIS_SET_H
/* Which hypotheses are active: where each begins, which fits best, and which one another replaces. */

#include <stdint.h>

#include "joint.h"

/* Cost above the best one's from which a hypothesis is rejected; its errors show no change. */
enum { OC_JOINT_REJECT_COST = 20 };

/* The play with which the k-th of OC_JOINT_HYPOTHESES begins. */
oc_play oc_joint_start_of(int32_t k, const oc_known_truck *known);

/* All hypotheses have learned from a second: finds the best, replaces others, and sets up the next second. */
void oc_joint_end_second(oc_joint *joint, const oc_joint_design *design);

#endif

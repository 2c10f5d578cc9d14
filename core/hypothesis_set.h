#ifndef OC_HYPOTHESIS_SET_H
#define OC_HYPOTHESIS_SET_H
/* Which hypotheses run: where each begins, which fits best, and which is not needed and makes way for another. */

#include <stdint.h>

#include "joint.h"

/* Of cost: who is so far behind the best is not needed, and no witness. */
enum { OC_JOINT_HOPELESS = 20 };

/* The play with which the k-th of OC_JOINT_HYPOTHESES begins. */
oc_play oc_joint_start_of(int32_t k);

/* A second was learned from by all: which fits best, which go on, and by what the next second judges them. */
void oc_joint_turn_second(oc_joint *joint, const oc_joint_design *design);

#endif

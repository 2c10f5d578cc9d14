#ifndef OC_HYPOTHESIS_SET_H
#define OC_HYPOTHESIS_SET_H
/* The set of active hypotheses: starts, selection of the best, replacement. */

#include <stdint.h>

#include "joint.h"

/* Cost above the best one's from which on a hypothesis is rejected; a change is not judged by its errors. */
enum { OC_JOINT_REJECT_COST = 20 };

/* The start of the k-th of OC_JOINT_HYPOTHESES. */
oc_play oc_joint_start_of(int32_t k, const oc_known_truck *known);

/* s, used driving until which all widths are among the hypotheses, and a hypothesis has errors of its own. */
float oc_joint_settled_s(void);

/* The play may have changed while the ignition was off: starts copies of the best hypothesis with other plays. */
void oc_joint_open_play(oc_joint *joint, const oc_known_truck *known);

/* Ends a second that all hypotheses have learned from: selects the best, replaces others, sets up the next second. */
void oc_joint_end_second(oc_joint *joint, const oc_joint_design *design);

#endif

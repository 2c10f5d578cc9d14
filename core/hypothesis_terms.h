#ifndef OC_HYPOTHESIS_TERMS_H
#define OC_HYPOTHESIS_TERMS_H
/* What the two rooms of a hypothesis share: hypothesis.c, where evidence is gathered, and hypothesis_equations.c, where
 * it is solved for what is sought. */

#include "hypothesis.h"
#include "joint_model.h"

/* A parameter was moved by so much: what is left to be found of its term is less by it. */
void oc_hypothesis_shift(oc_hypothesis *hypothesis, const oc_hypothesis_design *design, int32_t term, float by);

/* All that was gathered of some terms, from first to last, shows by that share of what it did: so it would have within
 * so much less play, or wind-up. */
void oc_hypothesis_narrow(oc_hypothesis *hypothesis, int32_t first, int32_t last, float share);

#endif

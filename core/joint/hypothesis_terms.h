#ifndef OC_HYPOTHESIS_TERMS_H
#define OC_HYPOTHESIS_TERMS_H
/* Shared by hypothesis.c, which gathers evidence, and hypothesis_equations.c, which solves it. */

#include "hypothesis.h"
#include "joint_model.h"

/* The linearisation point of a term moved by `by`, so its remaining solution shrinks by that. */
void oc_hypothesis_shift(oc_hypothesis *hypothesis, const oc_hypothesis_design *design, int32_t term, float by);

/* Scales the slopes of the terms from first to last in all evidence, as a narrower play does. */
void oc_hypothesis_scale_slopes(oc_hypothesis *hypothesis, int32_t first, int32_t last, float share);

#endif

#include "joint_model.h"

/* Tuned, in tuned.toml: joint_model */
/* rad: width of the play below which neither a_0 nor the play is identifiable: the steering's lag looks like a_0 */
static const float little_play = 2.0f * 0.017453292f;
/* end */

/* 1 deg is the constant 0.017453292 rad, so that all machines have the same bits. */
static const oc_term_prior priors[OC_TERMS] = {
    /* terms.toml: priors */
    [YAW_ACCELERATION] = {0.0f, 100.0f * 0.017453292f},
    [JERK] = {0.0f, 10.0f * 0.017453292f},
    [FIFTH_WHEEL] = {0.0f, 1.5f * 0.017453292f},
    [UNEVEN] = {0.0f, 0.007f},
    [YAW_RATE_BIAS] = {0.0f, 1.0f * 0.017453292f},
    [WIND] = {0.0f, 0.05f},
    [WIND_ACROSS] = {0.0f, 0.05f},
    [CREEP] = {100.0f * 0.017453292f, 0.7f},
    [FRICTION] = {0.1f, 0.15f},
    [UNLOADING] = {0.0f, 0.15f},
    [WIDTH] = {4.0f * 0.017453292f, 6.0f * 0.017453292f},
    [UNWINDING] = {0.0f, 0.6f},
    [WINDUP] = {1.0f * 0.017453292f, 2.0f * 0.017453292f},
    [WHEELBASE] = {0.0f, 0.05f},
    [GRADIENT] = {0.4f * 0.017453292f, 0.4f * 0.017453292f},
    /* end */
};

const oc_term_prior *oc_joint_priors(void) {
    return priors;
}

float oc_joint_little_play(void) {
    return little_play;
}

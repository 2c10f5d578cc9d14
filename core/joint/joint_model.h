#ifndef OC_JOINT_MODEL_H
#define OC_JOINT_MODEL_H
/* The terms of the joint method's observation equation (docs/method.md, "Model"), estimated by least squares with
 * priors. A prior has the weight of one observation at its sd. Terms change between seconds by forgetting
 * (joint_memory_s), K and l by another load, too, and a_0 where it is modelled as a random walk. Given values of the
 * truck (params.toml, "known") replace the priors of K, l and a_0, and add one of B + W. */

#include "triangle.h"

enum {
    /* terms.toml: names */
    /* k_1, rad/(rad/s^2): angle by yaw acceleration; over a second, by the yaw rate's change, with its noise only */
    YAW_ACCELERATION,
    /* k_2, rad/(m/s^3): angle by lateral jerk; over a second, by the change of the lateral force */
    JERK,
    /* h, rad: angle by a fifth wheel's full friction, whose state f_h is -1 to 1 (joint.c) */
    FIFTH_WHEEL,
    /* u, 1: share by which left turns need more angle than right turns: a drag link turns one wheel by an asymmetric
     * lever */
    UNEVEN,
    /* b, rad/s: yaw rate bias that its correction leaves */
    YAW_RATE_BIAS,
    /* a_c, m/s^2: lateral acceleration by a wind along the first heading, at 20 m/s */
    WIND,
    /* a_s, m/s^2: lateral acceleration by a wind across the first heading, at 20 m/s */
    WIND_ACROSS,
    /* lambda, rad/s per m/s^2: speed of the wheels in their play by load; estimated as a share */
    CREEP,
    /* f, m/s^2: load that the king pins hold */
    FRICTION,
    /* a_0, m/s^2: neutral lateral acceleration */
    UNLOADING,
    /* B, rad: width of the play */
    WIDTH,
    /* rho, 1/s: rate at which a motor unwinds the column */
    UNWINDING,
    /* W, rad: width of the column's wind-up */
    WINDUP,
    /* l, 1: share by which the equivalent wheelbase is longer */
    WHEELBASE,
    /* K, rad/(m/s^2): understeer gradient */
    GRADIENT,
    /* end */
};

/* A term's prior, in its own unit. */
typedef struct {
    float mean, sd;
} oc_term_prior;

/* Of each term. */
const oc_term_prior *oc_joint_priors(void);

/* rad, width: in less play neither a_0 nor the play is identifiable, by the steering's lag. */
float oc_joint_little_play(void);

#endif

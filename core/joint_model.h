#ifndef OC_JOINT_MODEL_H
#define OC_JOINT_MODEL_H
/* The joint method's model on one page: the observation equation (docs/method.md, "The joint method"),
 *
 *     delta_m - i L kappa = o + i K (a - a_w - a_0) + (W/2) d + (B/2) c + k_1 r' + k_2 a' + l i L kappa - (i L/v) b
 *
 * and each of its terms, found by least squares with these priors. What a term is multiplied by is its regressor; the
 * slopes of the play's terms are differences of operators (play.h). A prior is worth one observation at its sd; nothing
 * wanders between seconds but by forgetting (joint_memory_s), and K and l by a load that changed.
 *
 *   term              symbol   what it is                                             regressor       prior: mean, sd
 *   YAW_ACCELERATION  k_1      angle by yaw acceleration, rad/(rad/s^2)               r'              0, 100 deg     1
 *   JERK              k_2      angle by jerk, rad/(m/s^3)                             a'              0, 10 deg      1
 *   YAW_RATE_BIAS     b        what the yaw rate's correction lacks, rad/s            -i L/v          0, its own     2
 *   WIND, _ACROSS     a_w      lateral acceleration by wind at 20 m/s, m/s^2          share of a_0's  0, 0.05        3
 *   CREEP             lambda   speed of the wheels in their play by load, a share     slope           100 deg/s, 0.7 1
 *   FRICTION          f        load that the king pins hold, m/s^2                    slope           0.1, 0.15      4
 *   UNLOADING         a_0      load at which the steering unloads, m/s^2              slope           joint_method.c 3
 *   WIDTH             B        width of the play, rad                                 slope           4, 6 deg       5
 *   UNWINDING         rho      rate at which a motor unwinds the column, 1/s          slope           0, 0.6         1
 *   WINDUP            W        width of the column's wind-up, rad                     slope           1, 2 deg       1
 *   WHEELBASE         l        share by which the equivalent wheelbase is longer      i L kappa       0, 0.05        6
 *   GRADIENT          K        understeer gradient, rad/(m/s^2)                       i a             0.4, 0.4 deg   7
 *
 * Sources: 1 wide, ours: bench/accuracy.py's drives decide; 2 past_bias.h; 3 DESIGN 3, trucks seen; 4 king pins hold
 * some 0.1 m/s^2, DESIGN 3; 5 trucks have 0 to 15 deg, most of them little, DESIGN 3; 6 errors of vehicle files, row
 * `vehicle_off`; 7 the thesis's truck, 4.2. */

#include "triangle.h"

/* In this order: the play's as oc_slope has them, and late whose variance is asked for, since the later a term, the
 * fewer equations tell it. */
enum {
    YAW_ACCELERATION,
    JERK,
    YAW_RATE_BIAS,
    WIND,
    WIND_ACROSS,
    CREEP,
    FRICTION,
    UNLOADING,
    WIDTH,
    UNWINDING,
    WINDUP,
    WHEELBASE,
    GRADIENT
};

/* What is believed of a term before a drive, in its own unit. */
typedef struct {
    float mean, sd;
} oc_prior_belief;

typedef struct {
    oc_prior_belief terms[OC_TERMS];
    float little_play; /* rad: in less play a_0 cannot be told from the lag of the steering, nor play from chance */
} oc_joint_model;

const oc_joint_model *oc_joint_model_get(void);

#endif

#ifndef OC_JOINT_MODEL_H
#define OC_JOINT_MODEL_H
/* The joint method's model: the observation equation (docs/method.md, "The joint method"),
 *
 *     delta_m - i L kappa = o + i K (a - a_w - a_0) + (W/2) d + (B/2) c
 *                           + k_1 r' + k_2 a' + h f_h + u i L |kappa| + l i L kappa - (i L/v) b
 *
 * and its terms, estimated by least squares with these priors. A term's regressor is its factor. The slopes of the
 * play's terms are differences of operators (play.h). A prior has the weight of one observation at its sd. Terms change
 * between seconds by forgetting (joint_memory_s), K and l by another load, too, and a_0 where it is modelled as a
 * random walk.
 *
 *   term              symbol   meaning                                                regressor       prior: mean, sd
 *   YAW_ACCELERATION  k_1      angle by yaw acceleration, rad/(rad/s^2)               r'              0, 100 deg     1
 *   JERK              k_2      angle by jerk, rad/(m/s^3)                             a'              0, 10 deg      1
 *   FIFTH_WHEEL       h        angle by a fifth wheel's full friction, rad            f_h             0, 1.5 deg     8
 *   UNEVEN            u        left turns' more angle than right turns', a share      i L |kappa|     0, 0.007        9
 *   YAW_RATE_BIAS     b        remaining bias of the yaw rate, rad/s                  -i L/v          0, its own     2
 *   WIND, _ACROSS     a_w      lateral acceleration by wind at 20 m/s, m/s^2          share of a_0's  0, 0.05        3
 *   CREEP             lambda   speed of the wheels in their play by load, a share     slope           100 deg/s, 0.7 1
 *   FRICTION          f        load that the king pins hold, m/s^2                    slope           0.1, 0.15      4
 *   UNLOADING         a_0      neutral lateral acceleration, m/s^2                    slope           joint_method.c 3
 *   WIDTH             B        width of the play, rad                                 slope           start's, 6 deg 5
 *   UNWINDING         rho      rate at which a motor unwinds the column, 1/s          slope           0, 0.6         1
 *   WINDUP            W        width of the column's wind-up, rad                     slope           1, 2 deg       1
 *   WHEELBASE         l        share by which the equivalent wheelbase is longer      i L kappa       0, 0.05        6
 *   GRADIENT          K        understeer gradient, rad/(m/s^2)                       i a             0.4, 0.4 deg   7
 *
 * Given values of the truck (params.toml, "known") replace the priors of K, l and a_0, and add one of B + W.
 *
 * Sources: 1 wide, so that the drives of bench/accuracy.py decide; 2 past_bias.h; 3 bench/population.py: pull and wind,
 * with a margin; 4, 5 bench/population.py: king pins hold 0.02 to 0.2 m/s^2, play is 0 to 15 deg, little in most
 * trucks; 6 errors of vehicle files, bench/accuracy.py, row `vehicle_off`; 7 the thesis's truck, 4.2; 8
 * bench/effects.py, row `fifth_wheel`: 3 kNm of friction, f_h is its state, -1 to 1 (joint.c); 9 a drag link turns one
 * wheel by an asymmetric lever. bench/effects.py, row `minor_physics`, has 2 %, which seconds in bends outweigh. On a
 * real car's laps the offset was 0.2 deg better by 0.7 % than by 1.5 %. */

#include "triangle.h"

/* The play's terms are in the order of oc_slope. Terms whose variance is needed come last, since their triangular
 * solutions are the shortest. */
enum {
    YAW_ACCELERATION,
    JERK,
    FIFTH_WHEEL,
    UNEVEN,
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

/* A term's prior, in its own unit. */
typedef struct {
    float mean, sd;
} oc_term_prior;

typedef struct {
    oc_term_prior terms[OC_TERMS];
    float little_play; /* rad: in less play neither a_0 nor the play is identifiable, by the steering's lag */
} oc_joint_model;

const oc_joint_model *oc_joint_model_get(void);

#endif

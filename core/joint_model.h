#ifndef OC_JOINT_MODEL_H
#define OC_JOINT_MODEL_H
/* The joint method's model on one page: the observation equation (docs/method.md, "The joint method"),
 *
 *     delta_m - i L kappa = o + i K (a - a_w - a_0) + (W/2) d + (B/2) c
 *                           + k_1 r' + k_2 a' + h f_h + u i L |kappa| + l i L kappa - (i L/v) b
 *
 * and each of its terms, estimated by least squares with these priors. A term's factor is its regressor; the slopes
 * of the play's terms are differences of operators (play.h). A prior weighs as one observation at its sd. Terms change
 * between seconds by forgetting (joint_memory_s), K and l also by another load, a_0 where it is believed to wander.
 *
 *   term              symbol   what it is                                             regressor       prior: mean, sd
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
 * A truck may be known better (params.toml, "known"): then K, l and a_0 have other priors, B + W one more.
 *
 * Sources: 1 wide, ours: bench/accuracy.py's drives decide; 2 past_bias.h; 3 pull and wind of bench/population.py and
 * more; 4 and 5 bench/population.py: king pins hold 0.02 to 0.2 m/s^2, play is 0 to 15 deg, in most trucks little;
 * 6 errors of vehicle files, row `vehicle_off`; 7 the thesis's truck, 4.2;
 * 8 bench/effects.py, row `fifth_wheel`: 3 kNm of friction. f_h is the place in that friction, -1 to 1 (joint.c);
 * 9 a drag link turns one wheel, and its lever is not symmetric: 0.7 %. bench/effects.py, row
 * `minor_physics`, has 2 %, which seconds in bends outweigh; a real car's laps held 0.2 deg better than by 1.5 %. */

#include "triangle.h"

/* In this order: the play's as oc_slope has them. Terms whose variance is needed come last, since their triangular
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

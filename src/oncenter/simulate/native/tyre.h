#ifndef SIM_TYRE_H
#define SIM_TYRE_H
/* Steady-state lateral force of an axle's tyres over their slip angle. For small slip angles, equal to their
 * tangents. */

#include <stdint.h>

typedef enum {
    SIM_TYRE_LINEAR,       /* (4), no limit */
    SIM_TYRE_BRUSH,        /* bristles under parabolic pressure; saturates at friction times load */
    SIM_TYRE_MAGIC_FORMULA /* D sin(C atan(B x - E (B x - atan(B x)))), B C D the cornering stiffness */
} sim_tyre_model;

/* All tyres of an axle together. */
typedef struct {
    sim_tyre_model model;
    double cornering_stiffness; /* N/rad, at a slip angle of zero */
    double D;                   /* N, friction times load: the maximum force; not for the linear tyre */
    double C, E;                /* 1, shape and curvature of the Magic Formula */
} sim_tyre;

/* N, in the direction of the slip angle (rad): the wheel's angle less the direction of its motion. */
double sim_tyre_force(const sim_tyre *tyre, double slip_angle);

#endif

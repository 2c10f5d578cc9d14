#ifndef SIM_STEERING_H
#define SIM_STEERING_H
/* From the steering wheel to the front wheels: a constant ratio behind some play. What gives way under load is in the
 * truck's front cornering stiffness. */

#include "backlash.h"

typedef struct {
    double ratio;         /* steering wheel angle per front wheel angle */
    double trail;         /* m, the side force's lever arm about the king pin */
    oc_backlash backlash; /* load: N m of aligning moment, friction: the king pin's */
} sim_steering;

typedef struct {
    oc_backlash_state backlash;
    double place_in_play;     /* -1 to 1 */
    double aligning_moment;   /* N m, about the king pins, positive against a turn to the left */
    double front_wheel_angle; /* rad, without side force */
} sim_steering_state;

/* steering_wheel_angle: rad, zero at the play's midpoint when the wheels stand straight. */
void sim_steering_step(sim_steering_state *state, const sim_steering *steering, double steering_wheel_angle,
                       double front_force, double step_s);

#endif

#ifndef SIM_STEERING_H
#define SIM_STEERING_H
/* From the steering wheel to the front wheels: the column winds up against friction, then comes the gear with its
 * ratio behind some play, whose flank the moment about the king pins chooses. What gives way under the tyres' own
 * moment is the axle's compliance; under every other moment it is here. */

#include <stdint.h>

#include "backlash.h"

enum { SIM_RATIO_TERMS_MAX = 8 };

typedef struct {
    int32_t ratio_terms;
    double ratio[SIM_RATIO_TERMS_MAX]; /* front wheel angle over gear angle, both rad, lowest power first */
    double trail;                /* m, the side force's lever arm about the king pins */
    double compliance;           /* rad per N m about the king pins */
    double set_angle;            /* rad at the front wheels: side force without slip, as toe gives, over stiffness */
    double set_moment;           /* N m about the king pins, always there, towards the left: alignment, unloading */
    double brake_pull;           /* N m per m/s^2 of deceleration, towards the left */
    double torque_steer;         /* N m per m/s^2 of acceleration, towards the left */
    oc_backlash windup;          /* of the column; load: active return's, 1/s times its rate */
    double active_return;        /* 1/s, how fast it unwinds the gear's side of the column to straight ahead */
    oc_backlash backlash;        /* load: N m about the king pins, friction: theirs */
} sim_steering;

typedef struct {
    oc_backlash_state windup, backlash;
    double place_in_windup;   /* -1 to 1 */
    double place_in_play;     /* -1 to 1 */
    double aligning_moment;   /* N m, of the tyres about the king pins, positive against a turn to the left */
    double front_wheel_angle; /* rad, without what side force turns back */
} sim_steering_state;

/* steering_wheel_angle: rad, zero at the middle of play and wind-up when the wheels stand straight; front_force: N, of
 * the steered wheels; longitudinal_acceleration: m/s^2. */
void sim_steering_step(sim_steering_state *state, const sim_steering *steering, double steering_wheel_angle,
                       double front_force, double longitudinal_acceleration, double step_s);

#endif

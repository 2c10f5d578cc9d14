#ifndef SIM_STEERING_H
#define SIM_STEERING_H
/* From the steering wheel to the front wheels: the column winds up against friction and has some lash, then comes the
 * gear with its ratio behind some play. The moment about the king pins chooses the flank of lash and play. What gives
 * way under the tyres' own moment is the axle's compliance; under every other moment it is here.
 *
 * An overlay motor may turn the gear instead of the driver. It then drags the steering wheel along through the lash.
 *
 * The hands hold the moment about the king pins less what the assistance carries, and the column's friction. In the
 * play and in the lash they hold the friction alone.
 *
 * The torsion bar of the assistance makes the steering wheel lead the gear while hands bear the moment. Springs and
 * brakes turn the front wheels by themselves. */

#include <stdint.h>

#include "backlash.h"

enum { SIM_RATIO_TERMS_MAX = 8 };

typedef struct {
    int32_t ratio_terms;
    double ratio[SIM_RATIO_TERMS_MAX]; /* front wheel angle over gear angle, both rad, lowest power first */
    double right_share;          /* 1, front wheel angle in right turns over that in left turns */
    double ripple;               /* rad, amplitude of the universal joints', twice a turn of the gear */
    double ripple_phase;         /* rad, gear angle at which it rises through its middle */
    double trail;                /* m, the side force's lever arm about the king pins */
    double compliance;           /* rad per N m about the king pins */
    double set_angle;            /* rad at the front wheels: side force without slip, as toe gives, over stiffness */
    double set_moment;           /* N m about the king pins, always there, towards the left: alignment, unloading */
    double brake_pull;           /* N m per m/s^2 of deceleration, towards the left */
    double torque_steer;         /* N m per m/s^2 of acceleration, towards the left */
    double twist;                /* rad, of the torsion bar under a large moment; 0: none */
    double twist_half_moment;    /* N m about the king pins, at which it twists by tanh(1) of that */
    double brake_steer;          /* rad at the front wheels per m/s^2 of deceleration, towards the left */
    double roll_steer;           /* rad at the front wheels per rad of body roll */
    double ride_height_steer;    /* rad at the front wheels, by which the second truck's ride height turns them */
    double hands_share;          /* 1, torque of the hands over the moment about the king pins that they hold */
    double column_friction;      /* N m at the steering wheel */
    oc_backlash windup;          /* of the column; load: active return's, 1/s times its rate */
    double active_return;        /* 1/s, how fast it unwinds the gear's side of the column to straight ahead */
    oc_backlash lash;            /* of the column; load as the backlash's */
    oc_backlash backlash;        /* load: N m about the king pins, friction: theirs */
} sim_steering;

typedef struct {
    oc_backlash_state windup, lash, backlash;
    double steering_wheel_angle; /* rad */
    double twist;             /* rad, by which the torsion bar lets the steering wheel lead */
    double place_in_windup;   /* -1 to 1 */
    double place_in_lash;     /* -1 to 1 */
    double place_in_play;     /* -1 to 1 */
    double aligning_moment;   /* N m, of the tyres about the king pins, positive against a turn to the left */
    double front_wheel_angle; /* rad, without what side force turns back */
    double place_in_king_pins; /* -1 to 1, of the king pins' friction */
    double place_in_column;   /* -1 to 1, of the column's friction */
    double hand_torque;       /* N m, that the driver applies, left positive; 0 while the motor carries */
} sim_steering_state;

/* What acts on the steering from outside, constant over a step. */
typedef struct {
    double angle;         /* rad, of the steering wheel, or of the gear while the motor carries; zero at the middle of
                             play, lash and wind-up when the wheels stand straight */
    double front_force;   /* N, of the steered wheels */
    double longitudinal_acceleration; /* m/s^2 */
    int32_t motor_carries; /* 1: the motor turns the gear, 0: the driver turns the steering wheel */
    double second_truck;   /* 1, 0: ride height as the drive began, 1: as the second truck's */
    double roll;           /* rad, of the body, right side down positive */
    double bump_steer;     /* rad at the front wheels, what the springs' travel adds */
} sim_steering_input;

void sim_steering_step(sim_steering_state *state, const sim_steering *steering, const sim_steering_input *input,
                       double step_s);

#endif

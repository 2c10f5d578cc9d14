#ifndef SIM_STEERING_H
#define SIM_STEERING_H
/* From the steering wheel to the front wheels. The column winds up against friction and has lash. Behind it are a free
 * play and the gear with its ratio. The moment about the king pins determines the flanks of lash and play. The axle's
 * compliance is that under the tyres' aligning moment; the compliance here is that under all other moments.
 *
 * An overlay motor may turn the gear instead of the driver. It then drags the steering wheel along through the lash, or
 * a hand that rests on the rim keeps the wheel on one flank of the lash.
 *
 * The hands hold the moment about the king pins, less the share of the assistance, plus the column's friction. In play
 * and lash they hold the friction alone.
 *
 * While the hands carry the moment, the torsion bar of the assistance makes the steering wheel lead the gear. Springs
 * and brakes turn the front wheels, too. */

#include <stdint.h>

#include "backlash.h"

enum { SIM_RATIO_TERMS_MAX = 8 };

typedef struct {
    int32_t ratio_terms;
    double ratio[SIM_RATIO_TERMS_MAX]; /* front wheel angle over gear angle, both rad, lowest power first */
    double right_share;          /* 1, front wheel angle in right turns over that in left turns */
    double ripple;               /* rad, amplitude of the universal joints', twice a turn of the gear */
    double ripple_phase;         /* rad, gear angle at which it rises through its middle */
    double trail;                /* m, lever arm of the lateral force about the king pins */
    double compliance;           /* rad per N m about the king pins */
    double set_angle;            /* rad at the front wheels: lateral force at zero slip, as by toe, over stiffness */
    double set_moment;           /* N m about the king pins, constant, to the left: by alignment */
    double brake_pull;           /* N m per m/s^2 of deceleration, to the left */
    double torque_steer;         /* N m per m/s^2 of acceleration, to the left */
    double twist;                /* rad, of the torsion bar under a large moment; 0: none */
    double twist_half_moment;    /* N m about the king pins, for a twist of tanh(1) times that */
    double brake_steer;          /* rad at the front wheels per m/s^2 of deceleration, to the left */
    double roll_steer;           /* rad at the front wheels per rad of body roll */
    double ride_height_steer;    /* rad at the front wheels, by the second truck's ride height */
    double hands_share;          /* 1, torque of the hands over the moment about the king pins */
    double column_friction;      /* N m at the steering wheel */
    oc_backlash windup;          /* of the column; load: active_return times the inner angle */
    double active_return;        /* 1/s, rate at which the gear's side of the column unwinds to straight ahead */
    oc_backlash lash;            /* of the column; load as that of the backlash */
    oc_backlash backlash;        /* load: N m about the king pins, friction: theirs */
} sim_steering;

typedef struct {
    oc_backlash_state windup, lash, backlash;
    double steering_wheel_angle; /* rad */
    double twist;             /* rad, lead of the steering wheel by the torsion bar */
    double place_in_windup;   /* -1 to 1 */
    double place_in_lash;     /* -1 to 1 */
    double place_in_play;     /* -1 to 1 */
    double aligning_moment;   /* N m, of the tyres about the king pins, positive to the right */
    double front_wheel_angle; /* rad, without the axle's compliance */
    double place_in_king_pins; /* -1 to 1, of the king pins' friction */
    double place_in_column;   /* -1 to 1, of the column's friction */
    double hand_torque;       /* N m, that the driver applies, left positive; while the motor carries only by a hand at
                                 rest */
} sim_steering_state;

/* External inputs of the steering, constant over a step. */
typedef struct {
    double angle;         /* rad, of the steering wheel, or of the gear while the motor carries; zero with straight
                             wheels at mid-play, mid-lash and without wind-up */
    double front_force;    /* N, of the steered wheels */
    double longitudinal_acceleration; /* m/s^2 */
    int32_t motor_carries; /* 1: the motor turns the gear, 0: the driver turns the steering wheel */
    double second_truck;   /* 1, 0: ride height of the first truck, 1: of the second */
    double roll;           /* rad, of the body, right side down positive */
    double bump_steer;     /* rad at the front wheels, by the springs' travel */
    double resting_torque; /* N m, of a hand that rests on the rim while the motor carries, left positive */
} sim_steering_input;

void sim_steering_step(sim_steering_state *state, const sim_steering *steering, const sim_steering_input *input,
                       double step_s);

#endif

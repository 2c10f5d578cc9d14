#ifndef SIM_DRIVER_H
#define SIM_DRIVER_H
/* A driver with preview, a reaction time, a tolerance of some decimetres, and hands that are never quite still. This
 * makes the residuals of a drive correlated for seconds, as those of real drives are. */

#include <stddef.h>
#include <stdint.h>

#include "road.h"

enum { SIM_REACTION_MAX = 128 /* ticks */ };

typedef struct {
    /* the driver's model of the truck */
    double angle_per_curvature;             /* rad m, ratio * wheelbase */
    double angle_per_lateral_acceleration;  /* rad/(m/s^2), ratio * K_us/g */
    double backlash_half_width;             /* rad, of the steering wheel */
    double lash_half_width; /* rad, lash and twist between steering wheel and motor, which only hands have to cross */
    double turns_behind; /* m, rear axle behind the centre of gravity; at walking speed the truck turns about it */
    double backwards_curvature; /* 1/m, the largest correction backwards */
    /* steering */
    double preview_time;    /* s */
    double gain;            /* share of the predicted lateral error that is corrected in this time */
    double trim_keep;       /* 1 less the share of a correction that becomes permanent at each tick */
    double reaction_time;   /* s */
    int32_t reaction_ticks; /* the same, 0 to SIM_REACTION_MAX - 1 */
    double arm_frequency;   /* rad/s, of the critically damped arms */
    double lane_wander;     /* m, standard deviation of the intended place in the lane */
    double lane_wander_keep; /* share kept from one tick to the next, 0 to 1 */
    double hand_motion;     /* rad, standard deviation of the hands' small corrections */
    double hand_motion_keep;
    /* speed */
    size_t standing_count;    /* of standstills, in order: before the start, breaks, after the end */
    const double *standing_begin; /* s */
    const double *standing_end; /* s */
    double acceleration_max;  /* m/s^2 */
    double deceleration_max;  /* m/s^2, positive */
    double backwards_speed;   /* m/s, positive */
    double backwards_swing;   /* m, to either side of the lane's middle, as for a dock; 0: straight back */
} sim_driver;

typedef struct {
    double lane_wander;              /* m, wanted lateral position */
    double hand_motion;              /* rad */
    double trim;                     /* 1/m, permanent correction */
    double decided[SIM_REACTION_MAX]; /* rad, ring of decisions delayed by the reaction time */
    double flanks[SIM_REACTION_MAX]; /* -1 to 1, for each the flank to which the hands cross the lash */
    int32_t next;                    /* in the ring */
    double wanted_angle;             /* rad, target of the arms */
    double steering_wheel_angle;     /* rad; of the gear while the motor carries */
    double steering_wheel_rate;      /* rad/s, the same */
    double speed;                    /* m/s, negative backwards */
    int32_t backwards;               /* 1: in reverse gear, which only a standing truck engages or leaves */
    double longitudinal_acceleration; /* m/s^2 */
    size_t next_standing;            /* of the driver's */
    size_t next_stop;                /* of the road's */
    double stood;                    /* s, at this stop so far */
} sim_driver_state;

/* Inputs of the driver. */
typedef struct {
    double station;       /* m, along the road */
    double lateral_error; /* m, left of the lane's centre */
    double lateral_error_rate; /* m/s */
    double yaw_rate;      /* rad/s */
    double heading_error; /* rad, against the road's */
    int32_t motor_carries; /* 1: the motor carries out the driver's decision */
    double rear_share;     /* 1, angle of a steered rear axle per front wheel angle, negative in counter phase */
} sim_view;

/* One decision; lane_normal, hand_normal: standard normal numbers of this tick. */
void sim_driver_decide(sim_driver_state *state, const sim_driver *driver, const sim_road *road, const sim_view *view,
                       double lane_normal, double hand_normal);

/* Moves the arms to the decision of a reaction time ago. */
void sim_driver_steer(sim_driver_state *state, const sim_driver *driver, double step_s);

/* The driver's way along the road. */
typedef struct {
    double station;     /* m, along the road */
    double time;        /* s */
    int32_t reverses;   /* 1: the driver wants to drive backwards */
    double braked;      /* m/s^2, deceleration by brakes that others apply; 0: none */
} sim_way;

/* Drives at the road's speed, with its stops and the driver's standstills, or backwards. */
void sim_driver_drive(sim_driver_state *state, const sim_driver *driver, const sim_road *road, const sim_way *way,
                      double step_s);

#endif

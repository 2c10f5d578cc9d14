#ifndef SIM_DRIVER_H
#define SIM_DRIVER_H
/* Somebody who looks ahead, answers late, does not mind being some decimetres off, and whose hands are never quite
 * still: what makes a real drive's residuals resemble each other for seconds. */

#include <stddef.h>
#include <stdint.h>

#include "road.h"

enum { SIM_REACTION_MAX = 128 /* ticks */ };

typedef struct {
    /* the truck as the driver has come to know it */
    double angle_per_curvature;             /* rad m, ratio * wheelbase */
    double angle_per_lateral_acceleration;  /* rad/(m/s^2), ratio * K_us/g */
    double backlash_half_width;             /* rad, of the steering wheel */
    double lash_half_width; /* rad, lash and twist between steering wheel and motor, which only hands have to cross */
    double turns_behind; /* m; walking, the truck turns about its rear axle, so far behind its centre of gravity */
    /* steering */
    double preview_time;    /* s, how far ahead the driver looks */
    double gain;            /* share of the expected lateral error that is steered away by then */
    double trim_keep;       /* 1 less the share of a correction that becomes lasting at every tick */
    double reaction_time;   /* s, from seeing to moving */
    int32_t reaction_ticks; /* the same, 0 to SIM_REACTION_MAX - 1 */
    double arm_frequency;   /* rad/s, of the critically damped arms */
    double lane_wander;     /* m, standard deviation of where in the lane the driver means to be */
    double lane_wander_keep; /* of that from one tick to the next, 0 to 1 */
    double hand_motion;      /* rad, standard deviation of the hands' small corrections */
    double hand_motion_keep;
    /* speed */
    size_t standing_count;    /* times of standing, in order: before the start, breaks, after the end */
    const double *standing_begin; /* s */
    const double *standing_end;   /* s */
    double acceleration_max;  /* m/s^2 */
    double deceleration_max;  /* m/s^2, positive */
} sim_driver;

typedef struct {
    double lane_wander;              /* m, wanted lateral position */
    double hand_motion;              /* rad */
    double trim;                     /* 1/m, lasting correction */
    double seen[SIM_REACTION_MAX];   /* rad, ring of decisions that wait for the reaction time */
    double flanks[SIM_REACTION_MAX]; /* -1 to 1, with them: the flank that hands will have to cross the lash to */
    int32_t next;                    /* in the ring */
    double wanted_angle;             /* rad, what the arms move to */
    double steering_wheel_angle;     /* rad, of the gear while the motor carries */
    double steering_wheel_rate;      /* rad/s, likewise */
    double speed;                    /* m/s */
    double longitudinal_acceleration; /* m/s^2 */
    size_t next_standing;            /* of the driver's */
    size_t next_stop;                /* of the road's */
    double stood;                    /* s, at it so far */
} sim_driver_state;

/* What the driver sees. */
typedef struct {
    double station;       /* m, along the road */
    double lateral_error; /* m, left of the lane's middle */
    double lateral_error_rate; /* m/s */
    double yaw_rate;      /* rad/s */
    int32_t motor_carries; /* 1: the motor does what the driver decides */
} sim_view;

/* One decision; the two normals are standard normal numbers of this tick. */
void sim_driver_decide(sim_driver_state *state, const sim_driver *driver, const sim_road *road, const sim_view *view,
                       double lane_normal, double hand_normal);

/* The arms' way to what was decided a reaction time ago. */
void sim_driver_steer(sim_driver_state *state, const sim_driver *driver, double step_s);

/* The feet's way to the road's speed, standing at its stops and at the driver's times. */
void sim_driver_drive(sim_driver_state *state, const sim_driver *driver, const sim_road *road, double station,
                      double time, double step_s);

#endif

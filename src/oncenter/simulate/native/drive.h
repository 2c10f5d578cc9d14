#ifndef SIM_DRIVE_H
#define SIM_DRIVE_H
/* Driver, steering, truck and road: one drive, tick by tick.
 *
 * SI and rad; ISO 8855: left positive. */

#include <stddef.h>
#include <stdint.h>

#include "driver.h"
#include "road.h"
#include "steering.h"
#include "truck.h"
#include "wind.h"

typedef struct {
    sim_truck truck;
    sim_truck second; /* the same truck with another load or its last axle up; used where inputs select it */
    sim_steering steering;
    sim_road road;
    double patch_front, patch_rear; /* 1, change of the tyres' stiffness in a patch of the road, negative */
    sim_driver driver;
    sim_wind wind;
    double bump_steer;      /* rad at the front wheels, sd, by the springs' travel */
    double bump_steer_keep; /* share kept from one tick to the next, 0 to 1 */
    double motor_dead_band; /* rad at the gear, to either side, within which the overlay motor stays where it is */
    double rear_share; /* 1, angle of the last axle per front wheel angle at low speed, negative; 0: not steered */
    double rear_locks_speed; /* m/s, from which on the last axle is locked straight; 0: never */
    double start_heading;   /* rad, counter-clockwise from east */
    double tick;            /* s, between rows, and between the driver's decisions */
    int32_t steps_per_tick; /* of the integration */
} sim_drive;

typedef struct {
    sim_truck_state truck;
    sim_steering_state steering;
    sim_driver_state driver;
    double time;          /* s */
    double station;       /* m, along the road */
    double lateral_error; /* m, left of the lane's centre */
    double heading_error; /* rad, against the road's */
    double heading;       /* rad, counter-clockwise from east, not wrapped */
    double east, north;   /* m, of the centre of gravity from the start */
    sim_wind_state wind;
    int32_t motor_carries; /* 1: the overlay motor steers */
    double bump_steer;     /* rad at the front wheels, now */
    double motor_angle;    /* rad, of the gear while the motor carries */
    double resting_torque; /* N m, of a hand at rest on the rim, now */
    double brake_moment;   /* N m, of an intervention, now, to the left */
} sim_state;

/* The truth at a tick. Doubles only: Python converts it to a table. */
typedef struct {
    double time;                      /* s */
    double steering_wheel_angle;      /* rad, at the wheel, without offset */
    double place_in_play;             /* -1 to 1 */
    double front_wheel_angle;         /* rad, as set by the steering; without the axle's compliance */
    double yaw_rate;                  /* rad/s */
    double vehicle_speed;             /* m/s, negative backwards */
    double lateral_speed;             /* m/s, of the centre of gravity */
    double lateral_acceleration;      /* m/s^2, specific force at the centre of gravity */
    double longitudinal_acceleration; /* m/s^2 */
    double front_force;               /* N, lateral force of the front axle */
    double aligning_moment;           /* N m */
    double curvature;                 /* 1/m, of the road */
    double cross_slope;               /* 1, positive where the road falls to the right */
    double station;                   /* m */
    double lateral_error;             /* m, left of the lane's centre; NaN without a lane */
    double east, north;               /* m, of the centre of gravity from the start */
    double heading;                   /* rad, counter-clockwise from east, not wrapped */
    double wind_force;                /* N, from the side, left positive */
    double felt_lateral_acceleration; /* m/s^2, of an ideal accelerometer on the rolling body */
    double roll;                      /* rad, of the body, right side down positive */
    double place_in_windup;           /* -1 to 1, of the column */
    double articulation;              /* rad, truck's heading less trailer's; 0 without trailer */
    double second_truck;              /* 1, 0: the first truck, 1: the second one */
    double place_in_lash;             /* -1 to 1, of the column */
    double motor_carries;             /* 1, 0: the driver steers, 1: the overlay motor */
    double patch;                     /* 1, 0: good grip, 1: in a patch of the road */
    double hand_torque;               /* N m, that the driver applies at the steering wheel */
    double rear_axle_angle;           /* rad, of the last axle's wheels; 0: not steered */
} sim_row;

/* External inputs, one number per tick. */
typedef struct {
    const double *lane_normals;   /* standard normal numbers, of the driver's intended place in the lane */
    const double *hand_normals;   /* the same, of the hands' small corrections */
    const double *gust_normals;   /* the same, of the wind; NULL: no wind */
    const double *bump_normals;   /* the same, of the springs' travel; NULL: no bump steer */
    const double *machine_angles; /* rad, steering wheel angles of a steering machine, one more than ticks; NULL: the
                                     driver steers */
    const double *second_truck;   /* 1, 0: the first truck, 1: the second one; NULL: always the first */
    const double *motor_carries;  /* 1, 0: the driver steers, 1: the overlay motor; NULL: always the driver */
    const double *resting_torque; /* N m, of a hand that rests on the rim while the motor carries; NULL: none */
    const double *brake_moment;   /* N m, yaw moment of an intervention, to the left; NULL: none */
    const double *braked;         /* m/s^2, deceleration by an intervention; NULL: none */
    const double *reverses;       /* 1, 1: the driver wants to drive backwards; NULL: never */
} sim_inputs;

void sim_init(sim_state *state, const sim_drive *drive);

/* From this tick to the next. A machine has no lane. */
void sim_step(sim_state *state, const sim_drive *drive, const sim_inputs *inputs, size_t tick, sim_row *row);

/* One step per row. */
void sim_run(const sim_drive *drive, const sim_inputs *inputs, size_t count, sim_row *rows);

#endif

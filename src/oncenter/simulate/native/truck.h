#ifndef SIM_TRUCK_H
#define SIM_TRUCK_H
/* The dynamic single-track truck (13) with lagging tyres (5), (6).
 *
 * Linear tyres: good to some 4 m/s^2. Below walking speed slip angles mean nothing, so there the truck rolls as its
 * wheels point (7); between 0.5 and 2 m/s the two models are blended by their derivatives. */

typedef struct {
    double mass;                     /* kg */
    double yaw_inertia;              /* kg m^2, about the centre of gravity */
    double front_axle_distance;      /* m, l_f, from the centre of gravity */
    double rear_axle_distance;       /* m, l_r */
    double front_cornering_stiffness; /* N/rad, of the axle: 2 C_f of (13), steering compliance included */
    double rear_cornering_stiffness;  /* N/rad, of the axle: 2 C_r */
    double front_relaxation_length;  /* m, sigma_r of (6); 0: forces at once */
    double rear_relaxation_length;   /* m */
} sim_truck;

typedef struct {
    double lateral_speed; /* m/s, of the centre of gravity */
    double yaw_rate;      /* rad/s */
    double front_force;   /* N, side force of the axle, left positive */
    double rear_force;    /* N */
} sim_truck_state;

/* One Runge-Kutta step. front_wheel_angle: rad, as the steering would set the wheels without side force; speed: m/s,
 * not negative; gravity_to_left: m/s^2, what of gravity a banked road turns to the left. */
void sim_truck_step(sim_truck_state *state, const sim_truck *truck, double front_wheel_angle, double speed,
                    double gravity_to_left, double step_s);

/* m/s^2, specific force at the centre of gravity, as an ideal accelerometer feels it. */
double sim_truck_lateral_acceleration(const sim_truck_state *state, const sim_truck *truck, double front_wheel_angle,
                                      double speed, double gravity_to_left);

#endif

#ifndef OC_FRONT_WHEEL_H
#define OC_FRONT_WHEEL_H
/* Chapter 4: the front wheels' mean angle from the truck's motion, and from it the steering wheel angle.
 *
 * All angles in rad, left positive: (2) and (3) are the thesis's with left and right exchanged. Speeds in m/s, for a
 * nominal wheel radius; mismatch is r_l/r_r - 1. oc_wheel_speed_front_angle is (21), which is (3) with a mismatch. */

#include <stdint.h>

enum { OC_RATIO_TERMS_MAX = 8 };

/* Source of the front wheels' angle. */
typedef enum {
    OC_ANGLE_OBSERVER,
    OC_ANGLE_WHEEL_SPEED,             /* (21); (3) for equal wheel radii */
    OC_ANGLE_WHEEL_SPEED_EXACT,       /* (2) with the radius ratio */
    OC_ANGLE_YAW_RATE,                /* L*r/v */
    OC_ANGLE_YAW_RATE_UNDERSTEER,     /* (22), (31) */
    OC_ANGLE_SIDE_SLIP,               /* (23), (24) */
    OC_ANGLE_METHOD_COUNT
} oc_angle_method;

/* Front wheel angle as a monotonic polynomial of the steering wheel angle, both rad, lowest power first. */
typedef struct {
    int32_t terms;                     /* 0: a constant ratio */
    double coefficients[OC_RATIO_TERMS_MAX];
    double ratio;                      /* steering wheel angle over front wheel angle near the centre */
} oc_ratio;

/* (2) solved for R_l: exact Ackermann geometry up to some 43 deg, where (3) has an error of 10 %. */
double oc_front_wheel_exact(double wheelbase, double track, double left, double right, double mismatch);

/* (7), (22), (31): L*r/v + K_us/g * a_y. Speed not 0. */
float oc_front_wheel_by_yaw_rate(float wheelbase, float yaw_rate, float speed, float understeer_gradient,
                                 float lateral_acceleration);

/* (23), (24): by the speed over ground and the front tyres' slip. lateral_speed is measured `ahead` m behind the front
 * axle. */
double oc_front_wheel_by_side_slip(double longitudinal_speed, double lateral_speed, double yaw_rate, double ahead,
                                   double front_slip);

/* The steering wheel angle to the front wheel angle, and back. */
double oc_ratio_to_front_wheel(const oc_ratio *ratio, double steering_wheel_angle);
double oc_ratio_to_steering_wheel(const oc_ratio *ratio, double front_wheel_angle);

#endif

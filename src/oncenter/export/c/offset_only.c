/* The offset alone, for an ECU with little flash: no check of the steering wheel angle sensor by the estimated angle,
 * and no angle without the sensor. It takes the place of angle.c, sensor_fault.c, side_slip.c, smooth.c and
 * without_sensor.c of core/; all headers stay. A signal that is stuck, reversed, noisy or of a wrong size is found. */
#include "methods.h"

void oc_angle_setup(oc_angle_design *design, oc_angle_method method, const oc_ratio *ratio, double wheelbase,
                    double rate_hz) {
    (void)method;
    (void)ratio;
    (void)wheelbase;
    (void)rate_hz;
    *design = (oc_angle_design){0};
}

bool oc_fault_suspected(const oc_fault_watch *watch) {
    (void)watch;
    return false;
}

void oc_learn_truck(oc_learned *learned, const oc_joint *joint, const oc_coefficients *c) {
    (void)joint;
    (void)c;
    learned->truck = (oc_angle_truck){0};
}

void oc_observe_motion(oc_tick *tick, oc_tracking *tracking, const oc_coefficients *c) {
    (void)tracking;
    (void)c;
    tick->observed = (oc_angle_tick){0};
}

void oc_follow_angle(oc_tick *tick, oc_tracking *tracking, oc_evidence *evidence, const oc_learned *learned,
                     const oc_coefficients *c) {
    (void)tracking;
    (void)evidence;
    (void)learned;
    (void)c;
    tick->angle = (oc_angle){.status = OC_UNOBSERVABLE};
}

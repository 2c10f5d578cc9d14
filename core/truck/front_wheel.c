#include "front_wheel.h"

#include <math.h>

#include "trig.h"

static double arctangent(double ratio) {
    return oc_asin(ratio / sqrt(1.0 + ratio * ratio));
}

double oc_front_wheel_exact(double wheelbase, double track, double left, double right, double mismatch) {
    const double l = left * (1.0 + mismatch);
    if (!(l > 0.0 && right > 0.0)) {
        return 0.0;
    }
    /* squared speeds and squared radii are proportional: R_r^2 - R_l^2 is 2 T X, with X to the middle of the rear axle,
     * and R_l^2 = (X - T/2)^2 + L^2. (2) solves this quadratic equation for X at small T/R. */
    const double q = (right / l) * (right / l);
    const double d = q - 1.0;
    if (fabs(d) < 1e-9) {
        return 0.0;
    }
    const double half_track = 0.5 * track;
    const double middle = half_track * (q + 1.0) / d; /* d X^2 - T (q + 1) X + d (T^2/4 + L^2) = 0 */
    const double root = middle * middle - half_track * half_track - wheelbase * wheelbase;
    const double far = root > 0.0 ? sqrt(root) : 0.0;
    const double X = middle > 0.0 ? middle + far : middle - far;
    return arctangent(wheelbase / X);
}

float oc_front_wheel_by_yaw_rate(float wheelbase, float yaw_rate, float speed, float understeer_gradient,
                                 float lateral_acceleration) {
    return wheelbase * yaw_rate / speed + understeer_gradient * lateral_acceleration;
}

double oc_front_wheel_by_side_slip(double longitudinal_speed, double lateral_speed, double yaw_rate, double ahead,
                                   double front_slip) {
    return arctangent((lateral_speed + ahead * yaw_rate) / longitudinal_speed) - front_slip;
}

double oc_ratio_to_front_wheel(const oc_ratio *ratio, double steering_wheel_angle) {
    if (ratio->terms == 0) {
        return steering_wheel_angle / ratio->ratio;
    }
    double sum = 0.0;
    for (int32_t k = ratio->terms - 1; k >= 0; --k) {
        sum = sum * steering_wheel_angle + ratio->coefficients[k];
    }
    return sum;
}

static double slope(const oc_ratio *ratio, double angle) {
    double sum = 0.0;
    for (int32_t k = ratio->terms - 1; k >= 1; --k) {
        sum = sum * angle + (double)k * ratio->coefficients[k];
    }
    return sum;
}

double oc_ratio_to_steering_wheel(const oc_ratio *ratio, double front_wheel_angle) {
    static const double slope_share_min = 0.2; /* of the slope at the centre, against a reversal of the slope */
    double angle = front_wheel_angle * ratio->ratio;
    if (ratio->terms == 0) {
        return angle;
    }
    for (int32_t k = 0; k < 8; ++k) { /* Newton */
        const double s = slope(ratio, angle);
        const double s_min = slope_share_min / ratio->ratio;
        const double step = (front_wheel_angle - oc_ratio_to_front_wheel(ratio, angle)) / (s > s_min ? s : s_min);
        angle += step;
        if (fabs(step) < 1e-9) {
            break;
        }
    }
    return angle;
}

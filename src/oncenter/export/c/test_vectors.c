/* Runs the core on a recorded drive and compares each value with the one at export, to the last bit. */

#include <stdio.h>

#include "monitor.h"
#include "vectors.h"

enum { SIGNALS = 8 }; /* columns, by the bits of oc_signals.valid */

static oc_coefficients coefficients;
static oc_state state;

/* One row of the drive; resolutions are powers of two, against rounding. */
static oc_signals tick_of(size_t row) {
    static const double resolution[SIGNALS] = {
        1.0 / 1024, 1.0 / 8192, 1.0 / 512, 1.0 / 2048, 1.0 / 512, 1.0 / 512, 1.0 / 512, 1.0 / 512,
    };
    double values[SIGNALS];
    oc_signals tick = {.time = (double)row / vectors_rate_hz};
    for (unsigned k = 0; k < SIGNALS; ++k) {
        values[k] = (double)vectors_drive[row][k] * resolution[k];
        tick.valid |= vectors_drive[row][k] == VECTORS_NOT_AVAILABLE ? 0u : 1u << k;
    }
    tick.steering_wheel_angle = values[0];
    tick.yaw_rate = values[1];
    tick.vehicle_speed = values[2];
    tick.lateral_acceleration = values[3];
    tick.wheel_speed_front_left = values[4];
    tick.wheel_speed_front_right = values[5];
    tick.wheel_speed_rear_left = values[6];
    tick.wheel_speed_rear_right = values[7];
    return tick;
}

static void list_output(const oc_output *o, double values[VECTORS_OUTPUTS]) {
    const double listed[VECTORS_OUTPUTS] = {
        o->time,
        o->vehicle_speed,
        o->motion.curvature,
        o->motion.longitudinal_acceleration,
        o->motion.bank,
        o->motion.residual,
        (double)o->reasons,
        (double)o->offset_status,
        o->offset,
        o->offset_sd,
        (double)o->offset_parts.drive_sd,
        (double)o->offset_parts.pull_sd,
        (double)o->offset_parts.wind_sd,
        (double)o->offset_parts.set_up_sd,
        o->understeer_gradient,
        o->backlash,
        o->place,
        o->unloading_acceleration,
        o->evidence,
        o->yaw_rate_bias,
        o->yaw_rate_bias_sd,
        o->angle.angle,
        o->angle.standard_deviation,
        o->angle.estimate,
        (double)o->fault,
    };
    for (unsigned k = 0; k < VECTORS_OUTPUTS; ++k) {
        values[k] = listed[k];
    }
}

static void list_answer(const oc_answer *a, double values[VECTORS_ANSWERS]) {
    const double listed[VECTORS_ANSWERS] = {
        a->offset.value,
        a->offset.standard_deviation,
        (double)a->offset.status,
        a->understeer_gradient.value,
        a->understeer_gradient.standard_deviation,
        a->backlash.value,
        a->backlash.standard_deviation,
        a->unloading_acceleration.value,
        a->equivalent_wheelbase.value,
        a->yaw_rate_bias.value,
        a->wheel_radius_mismatch_front.value,
        a->wheel_radius_mismatch_rear.value,
        a->bank_mean,
        a->used,
        a->unused,
    };
    for (unsigned k = 0; k < VECTORS_ANSWERS; ++k) {
        values[k] = listed[k];
    }
}

/* Number of differing values. */
static int compare(const char *what, size_t row, const double *given, const double *expected, size_t count) {
    int differing = 0;
    for (size_t k = 0; k < count; ++k) {
        if (!(given[k] == expected[k])) {
            printf("%s, row %lu, value %lu: %a, expected %a\n", what, (unsigned long)row, (unsigned long)k, given[k],
                   expected[k]);
            ++differing;
        }
    }
    return differing;
}

static int run(const vectors_case *expected) {
    const oc_vehicle vehicle = {
        .wheelbase = VECTORS_WHEELBASE,
        .steering_ratio = VECTORS_STEERING_RATIO,
        .ratio = {.ratio = VECTORS_STEERING_RATIO},
        .track_width_front = VECTORS_TRACK_WIDTH_FRONT,
        .track_width_rear = VECTORS_TRACK_WIDTH_REAR,
        .traffic_side = 1.0,
    };
    oc_params params;
    oc_params_defaults(&params);
    params.method = expected->method;
    params.angle_method = expected->angle_method;
    if (oc_setup(&coefficients, &vehicle, &params, vectors_rate_hz) != OC_OK) {
        printf("%s: oc_setup failed\n", oc_method_name(expected->method));
        return 1;
    }
    oc_init(&state);
    int differing = 0;
    for (size_t row = 0; row < VECTORS_ROWS; ++row) {
        const oc_signals tick = tick_of(row);
        oc_output output;
        oc_step(&state, &coefficients, &tick, &output);
        if (row % VECTORS_EVERY == 0) {
            double values[VECTORS_OUTPUTS];
            list_output(&output, values);
            differing += compare(oc_method_name(expected->method), row, values, expected->outputs[row / VECTORS_EVERY],
                                 VECTORS_OUTPUTS);
        }
    }
    oc_answer answer;
    double values[VECTORS_ANSWERS];
    oc_answer_get(&state, &coefficients, &answer);
    list_answer(&answer, values);
    return differing + compare(oc_method_name(expected->method), VECTORS_ROWS, values, expected->answer,
                               VECTORS_ANSWERS);
}

int main(void) {
    int differing = 0;
    for (size_t k = 0; k < VECTORS_CASES; ++k) {
        differing += run(&vectors_cases[k]);
    }
    if (differing > 0) {
        printf("oncenter %s: %d values differ\n", oc_version(), differing);
        return 1;
    }
    printf("oncenter %s: %d cases of %d ticks are equal to the last bit\n", oc_version(), VECTORS_CASES, VECTORS_ROWS);
    return 0;
}

/* Fuzzes a truck, its params and a drive. A step ends, no sum overflows, no index exceeds its array (checked by
 * sanitizers), and valid estimates are numbers. */

#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "monitor.h"
#include "save.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t count);

/* The remaining input. */
typedef struct {
    const uint8_t *bytes;
    size_t count;
} input;

static uint8_t byte_of(input *from) {
    if (from->count == 0) {
        return 0;
    }
    --from->count;
    return *from->bytes++;
}

/* Mostly of this scale, sometimes any double. */
static double number_of(input *from, double scale) {
    const uint8_t kind = byte_of(from);
    double any = 0.0;
    if (kind == 255 && from->count >= sizeof any) {
        memcpy(&any, from->bytes, sizeof any);
        from->bytes += sizeof any;
        from->count -= sizeof any;
        return any;
    }
    return scale * ((double)kind - 127.0 + byte_of(from) / 256.0) / 127.0;
}

static void check_estimate(const oc_estimate *estimate) {
    if (estimate->status == OC_VALID && !(isfinite(estimate->value) && estimate->standard_deviation >= 0.0)) {
        abort();
    }
}

/* The next tick of the drive: bytes steer, brake, drop signals and stop the clock. */
static void next(oc_signals *tick, input *from) {
    const uint8_t what = byte_of(from);
    tick->time += 0.01;
    tick->steering_wheel_angle += number_of(from, 0.02);
    tick->yaw_rate += number_of(from, 0.01);
    switch (what % 16) {
    case 0: tick->time += number_of(from, 3.0); break;
    case 1: tick->valid = byte_of(from); break;
    case 2: tick->vehicle_speed = number_of(from, 30.0); break;
    case 3: tick->lateral_acceleration = number_of(from, 2.0); break;
    case 4: tick->steering_wheel_angle = number_of(from, 10.0); break;
    case 5: tick->yaw_rate = number_of(from, 0.3); break;
    case 6: tick->wheel_speed_front_left = number_of(from, 30.0); break;
    case 7: tick->wheel_speed_rear_right = number_of(from, 30.0); break;
    case 8:
        tick->wheel_speed_front_left = tick->wheel_speed_front_right = tick->vehicle_speed;
        tick->wheel_speed_rear_left = tick->wheel_speed_rear_right = tick->vehicle_speed;
        break;
    default: break;
    }
}

/* After any drive the image is accepted, and saved again it is the same. */
static bool survives_restoring(const oc_state *state, const oc_coefficients *c) {
    static oc_state other;
    static uint8_t image[sizeof *state + OC_SAVE_OVERHEAD], again[sizeof image];
    uint32_t sequence = 0;
    const size_t size = oc_save(state, c, 1, image, sizeof image);
    return oc_restore(&other, c, image, size, &sequence) == OC_IMAGE_OK &&
           oc_save(&other, c, 1, again, sizeof again) == size && memcmp(again, image, size) == 0;
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t count) {
    static oc_coefficients coefficients;
    static oc_state state;
    input from = {bytes, count};
    oc_params params;
    oc_params_defaults(&params);
    params.method = (oc_method)(byte_of(&from) % OC_METHOD_COUNT);
    params.angle_method = (oc_angle_method)(byte_of(&from) % OC_ANGLE_METHOD_COUNT);
    params.use_accelerometer = byte_of(&from) % 2;
    params.tandem_side_force_m2_s2 = byte_of(&from) % 101;
    const oc_vehicle vehicle = {
        .wheelbase = 4.0 + number_of(&from, 4.0),
        .steering_ratio = 20.0 + number_of(&from, 20.0),
        .track_width_front = 2.0,
        .track_width_rear = byte_of(&from) % 2 ? 1.8 : 0.0,
        .traffic_side = 1.0,
    };
    const double rate_hz = 100.0 + number_of(&from, 110.0);
    if (oc_setup(&coefficients, &vehicle, &params, rate_hz) != OC_OK) {
        return 0;
    }
    oc_signals tick = {.vehicle_speed = 20.0, .valid = 255};
    oc_output output;
    oc_answer answer;
    oc_init(&state);
    while (from.count > 0) {
        next(&tick, &from);
        const int held = 1 + byte_of(&from) % 64; /* repeats the tick, so that few bytes last for seconds */
        for (int k = 0; k < held; ++k) {
            oc_step(&state, &coefficients, &tick, &output);
            tick.time += 1.0 / rate_hz;
        }
        if (byte_of(&from) == 77) {
            oc_restart(&state, 0.0);
        }
        if (output.offset_status == OC_VALID && !isfinite(output.offset)) {
            abort();
        }
    }
    if (!survives_restoring(&state, &coefficients)) {
        abort();
    }
    oc_answer_get(&state, &coefficients, &answer);
    check_estimate(&answer.offset);
    check_estimate(&answer.understeer_gradient);
    check_estimate(&answer.backlash);
    check_estimate(&answer.yaw_rate_bias);
    return 0;
}

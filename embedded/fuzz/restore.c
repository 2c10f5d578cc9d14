/* Fuzzes a saved image: restoring ends, and an accepted image can be driven on with and saved again. */

#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "monitor.h"
#include "save.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t count);

enum { IMAGE_MAX = 32768 };

/* Some seconds on a winding road. */
static void drive(oc_state *state, const oc_coefficients *c, int ticks) {
    oc_signals tick = {.vehicle_speed = 20.0, .valid = 15};
    oc_output output;
    for (int k = 0; k < ticks; ++k, tick.time += 0.01) {
        tick.yaw_rate = (double)(k % 200 - 100) * 2e-4;
        tick.steering_wheel_angle = 4.0 * tick.yaw_rate + 0.02;
        oc_step(state, c, &tick, &output);
    }
}

static uint32_t crc_of(const uint8_t *bytes, size_t count) {
    uint32_t crc = 0xFFFFFFFFu;
    for (size_t k = 0; k < 8 * count; ++k) {
        crc ^= k % 8 == 0 ? bytes[k / 8] : 0u;
        crc = crc >> 1 ^ (crc & 1u ? 0xEDB88320u : 0u);
    }
    return ~crc;
}

/* Half of the inputs are a valid image with some changed bytes and a new CRC, since the CRC check rejects others. */
static size_t damaged(const oc_coefficients *c, const uint8_t *bytes, size_t count, uint8_t *image) {
    static uint8_t driven[OC_METHOD_COUNT][IMAGE_MAX];
    static size_t sizes[OC_METHOD_COUNT];
    const oc_method method = c->params.method;
    if (sizes[method] == 0) {
        static oc_state state;
        oc_init(&state);
        drive(&state, c, 1000);
        sizes[method] = oc_save(&state, c, 1, driven[method], IMAGE_MAX);
    }
    const size_t size = sizes[method];
    memcpy(image, driven[method], size);
    for (size_t k = 0; k + 2 < count; k += 3) {
        image[((size_t)bytes[k] << 8 | bytes[k + 1]) % size] = bytes[k + 2];
    }
    const uint32_t crc = crc_of(image, size - 4);
    for (size_t k = 0; k < 4; ++k) {
        image[size - 4 + k] = (uint8_t)(crc >> 8 * k);
    }
    return size;
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t count) {
    static oc_coefficients coefficients;
    static oc_state state;
    static uint8_t image[IMAGE_MAX];
    const oc_vehicle vehicle = {.wheelbase = 3.7, .steering_ratio = 19.3, .track_width_rear = 1.8};
    oc_params params;
    oc_params_defaults(&params);
    params.method = count > 0 ? (oc_method)(bytes[0] / 2 % OC_METHOD_COUNT) : OC_METHOD_THESIS;
    if (count == 0 || oc_setup(&coefficients, &vehicle, &params, 100.0) != OC_OK) {
        return 0;
    }
    size_t size = count < IMAGE_MAX ? count : IMAGE_MAX;
    if (bytes[0] % 2) {
        size = damaged(&coefficients, bytes + 1, count - 1, image);
    } else {
        memcpy(image, bytes, size);
    }
    uint32_t sequence = 0;
    const oc_image_fault fault = oc_restore(&state, &coefficients, image, size, &sequence);
    if (fault != OC_IMAGE_OK && (sequence != 0 || state.evidence.ticks != 0)) {
        abort();
    }
    drive(&state, &coefficients, 60);
    if (oc_save(&state, &coefficients, sequence + 1, image, IMAGE_MAX) == 0) {
        abort();
    }
    return 0;
}

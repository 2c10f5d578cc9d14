/* Bytes as a saved image: whatever they are, restoring ends; what is believed can be driven on with and saved again. */

#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "monitor.h"
#include "save.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t count);

enum { IMAGE_MAX = 32768 };

/* Half of the inputs are an image of ours with some bytes changed, lest the CRC stops all. */
static size_t damaged(const oc_coefficients *c, const uint8_t *bytes, size_t count, uint8_t *image) {
    static oc_state fresh;
    oc_init(&fresh);
    const size_t size = oc_save(&fresh, c, 1, image, IMAGE_MAX);
    for (size_t k = 0; k + 2 < count; k += 3) {
        image[((size_t)bytes[k] << 8 | bytes[k + 1]) % size] = bytes[k + 2];
    }
    return size;
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t count) {
    static oc_coefficients coefficients;
    static oc_state state;
    static uint8_t image[IMAGE_MAX];
    const oc_vehicle vehicle = {.wheelbase = 3.7, .steering_ratio = 19.3};
    oc_params params;
    oc_params_defaults(&params);
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
    oc_signals tick = {.vehicle_speed = 20.0, .valid = 15};
    oc_output output;
    for (int k = 0; k < 300; ++k, tick.time += 0.01) {
        oc_step(&state, &coefficients, &tick, &output);
    }
    if (oc_save(&state, &coefficients, sequence + 1, image, IMAGE_MAX) == 0) {
        abort();
    }
    return 0;
}

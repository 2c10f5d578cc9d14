#include "oncenter_ecu.h"

#include <string.h>

#include "oncenter_vehicle.h"

oc_vehicle oncenter_vehicle;
oc_params oncenter_params;
oc_signals oncenter_tick;
oc_output oncenter_output;
oc_answer oncenter_answer;
oc_coefficients oncenter_coefficients;
oc_state oncenter_state;
uint32_t oncenter_key;
uint32_t oncenter_sequence;

static oc_image_place place; /* of an image that is being saved or restored */
static bool started, saving;

void oncenter_ecu_defaults(void) {
    started = false;
    saving = false;
    oncenter_sequence = 0;
    oc_params_defaults(&oncenter_params);
    oncenter_vehicle_set(&oncenter_vehicle, &oncenter_params);
    oc_init(&oncenter_state);
}

/* A state of another calibration, and one whose restoring was cut, are lost. */
static oc_error set_up(void) {
    oncenter_vehicle.ratio.ratio = oncenter_vehicle.steering_ratio;
    const oc_error error =
        oc_setup(&oncenter_coefficients, &oncenter_vehicle, &oncenter_params, (double)ONCENTER_RATE_HZ);
    if (error != OC_OK) {
        return error;
    }
    const uint32_t key = oc_save_key(&oncenter_coefficients);
    if (key != oncenter_key || oncenter_state.ready != OC_STATE_READY) {
        oncenter_key = key;
        oc_init(&oncenter_state);
    }
    return OC_OK;
}

oc_error oncenter_ecu_start(void) {
    const oc_error error = set_up();
    started = error == OC_OK;
    saving = false;
    if (started) {
        oc_restart(&oncenter_state, 0.0);
    }
    return error;
}

static oc_error refusal(void) {
    if (!started) {
        return OC_ERROR_SETUP;
    }
    return saving ? OC_ERROR_STATE : OC_OK;
}

oc_error oncenter_ecu_tick(void) {
    const oc_error error = refusal();
    if (error != OC_OK) {
        memset(&oncenter_output, 0, sizeof oncenter_output);
        oncenter_output.reasons = OC_REASON_MISSING_SIGNAL;
        return error;
    }
    return oc_step(&oncenter_state, &oncenter_coefficients, &oncenter_tick, &oncenter_output);
}

oc_error oncenter_ecu_update_answer(void) {
    return started ? oc_answer_get(&oncenter_state, &oncenter_coefficients, &oncenter_answer) : OC_ERROR_SETUP;
}

oc_error oncenter_ecu_save(uint32_t sequence) {
    saving = started;
    if (saving) {
        oc_save_begin(&place, &oncenter_state, sequence);
    }
    return started ? OC_OK : OC_ERROR_SETUP;
}

size_t oncenter_ecu_save_piece(uint8_t *piece, size_t size) {
    if (!saving) {
        return 0;
    }
    const size_t written = oc_save_piece(&place, &oncenter_state, &oncenter_coefficients, piece, size);
    if (written == 0) {
        saving = false;
        oncenter_sequence = place.next == place.words ? place.sequence : oncenter_sequence; /* else a tick came */
    }
    return written;
}

void oncenter_ecu_restore(void) {
    (void)set_up(); /* an image of another calibration is foreign */
    started = false;
    saving = false;
    oncenter_sequence = 0;
    oc_restore_begin(&place, &oncenter_state);
}

oc_image_fault oncenter_ecu_restore_piece(const uint8_t *piece, size_t size) {
    if (started) {
        return OC_IMAGE_MISSING;
    }
    const oc_image_fault fault = oc_restore_piece(&place, &oncenter_state, &oncenter_coefficients, piece, size);
    if (fault == OC_IMAGE_OK) {
        oncenter_sequence = place.sequence;
    }
    return fault;
}

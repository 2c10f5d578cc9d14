#include "oncenter_ecu.h"

#include "save.h"

oc_vehicle oncenter_vehicle;
oc_params oncenter_params;
oc_signals oncenter_tick;
oc_output oncenter_output;
oc_answer oncenter_answer;

static oc_coefficients coefficients;
static oc_state state;
static uint32_t key; /* of the coefficients with which the state was learned */
static bool started;

void oncenter_ecu_defaults(void) {
    oc_params_defaults(&oncenter_params);
    oncenter_params.method = OC_METHOD_JOINT;
    oc_init(&state);
}

oc_error oncenter_ecu_start(void) {
    oncenter_vehicle.ratio.ratio = oncenter_vehicle.steering_ratio;
    const oc_error error = oc_setup(&coefficients, &oncenter_vehicle, &oncenter_params, (double)ONCENTER_RATE_HZ);
    started = error == OC_OK;
    if (started && oc_save_key(&coefficients) != key) {
        key = oc_save_key(&coefficients);
        oc_init(&state);
    }
    if (started) {
        oc_restart(&state, 0.0);
    }
    return error;
}

void oncenter_ecu_tick(void) {
    if (started) {
        oc_step(&state, &coefficients, &oncenter_tick, &oncenter_output);
    }
}

void oncenter_ecu_update_answer(void) {
    if (started) {
        oc_answer_get(&state, &coefficients, &oncenter_answer);
    }
}

#include "instance.h"

#include <math.h>
#include <string.h>

/* The table reads enums and int32_t alike. */
typedef char enums_are_of_32_bits[sizeof(oc_status) == sizeof(int32_t) ? 1 : -1];

enum { token_size = 40, sum_size = 4 }; /* of the image's head, a token is shorter; and of its end */

static const double longest_step_s = 1e3; /* a tick of the core is computed for each period of a step */

static void *member(oc_fmu *fmu, const oc_fmu_variable *variable) {
    return (char *)fmu + variable->offset;
}

void oc_fmu_reset(oc_fmu *fmu) {
    memset(fmu, 0, sizeof *fmu);
    oc_params_defaults(&fmu->params);
    for (uint32_t k = 0; k < oc_fmu_variable_count; ++k) {
        const oc_fmu_variable *variable = &oc_fmu_variables[k];
        if (variable->role != OC_FMU_PARAMETER && variable->role != OC_FMU_INPUT) {
            continue;
        }
        if (variable->type == OC_FMU_REAL) {
            oc_fmu_set_real(fmu, variable, variable->start);
        } else {
            oc_fmu_set_integer(fmu, variable, (int32_t)variable->start);
        }
    }
}

static const char *first_wrong_name(const oc_fmu *fmu) {
    if (fmu->vehicle.ratio.terms < 0 || fmu->vehicle.ratio.terms > OC_RATIO_TERMS_MAX) {
        return "steering_ratio_terms";
    }
    const char *const vehicle = oc_vehicle_check(&fmu->vehicle);
    return vehicle != NULL ? vehicle : oc_params_check(&fmu->params);
}

const char *oc_fmu_begin(oc_fmu *fmu) {
    if (fmu->method < 0 || fmu->method >= OC_METHOD_COUNT) {
        return "method";
    }
    if (fmu->angle_method < 0 || fmu->angle_method >= OC_ANGLE_METHOD_COUNT) {
        return "angle_method";
    }
    fmu->params.method = (oc_method)fmu->method;
    fmu->params.angle_method = (oc_angle_method)fmu->angle_method;
    fmu->vehicle.traffic_side = (double)fmu->traffic_side;
    fmu->vehicle.ratio.ratio = fmu->vehicle.steering_ratio;
    const char *const wrong = first_wrong_name(fmu);
    if (wrong != NULL) {
        return wrong;
    }
    const oc_error error = oc_setup(&fmu->coefficients, &fmu->vehicle, &fmu->params, fmu->rate_hz);
    if (error == OC_ERROR_VEHICLE) {
        return "track_width"; /* all else was looked at: the wheel speeds' method lacks it */
    }
    if (error != OC_OK) {
        return oc_error_name(error);
    }
    oc_init(&fmu->state);
    oc_restart(&fmu->state, 0.0);
    fmu->answer_is_current = 0;
    fmu->phase = OC_FMU_STEPPING;
    return NULL;
}

static void take_tick(oc_fmu *fmu, double time) {
    fmu->tick.time = time;
    fmu->tick.valid = 0;
    for (uint32_t k = 0; k < OC_FMU_SIGNALS; ++k) {
        fmu->tick.valid |= fmu->available[k] ? 1u << k : 0u;
    }
    oc_step(&fmu->state, &fmu->coefficients, &fmu->tick, &fmu->output);
    for (uint32_t k = 0; k < OC_REASON_COUNT; ++k) {
        fmu->reasons[k] = (fmu->output.reasons >> k & 1u) != 0;
    }
    fmu->angle_status = (int32_t)fmu->output.angle.status;
    fmu->fault = (int32_t)fmu->output.fault;
    fmu->signal_fault = (int32_t)fmu->output.signal_fault;
    fmu->signals_at_fault = fmu->output.signals_at_fault;
    fmu->answer_is_current = 0;
}

/* For an importer that steps tick by tick, ticks have its times, with their rounding and drift. For finer or coarser
 * steps, ticks at the nominal rate fall into its steps. */
bool oc_fmu_advance(oc_fmu *fmu, double time, double step) {
    const double tick_s = fmu->coefficients.tick_s;
    if (!(step > 0.0 && step <= longest_step_s && fabs(time) < 1e12) ||
        (fmu->clock_started && time < fmu->now - 0.5 * step)) {
        return false;
    }
    if (!fmu->clock_started || time > fmu->now + longest_step_s) { /* a jump of the clock is a hole, as in a log */
        fmu->clock_started = 1;
        fmu->due = time;
    }
    const bool tick_by_tick = fabs(step - tick_s) < 0.01 * tick_s;
    if (tick_by_tick) {
        fmu->due = time;
    }
    const double near = 0.5 * (step < tick_s ? step : tick_s);
    while (fmu->due < time + step - near) {
        take_tick(fmu, fabs(fmu->due - time) < near ? time : fmu->due);
        fmu->due += tick_s;
    }
    fmu->now = time + step;
    return true;
}

const oc_fmu_variable *oc_fmu_find(uint32_t reference, oc_fmu_type type) {
    const bool found = reference < oc_fmu_variable_count && oc_fmu_variables[reference].type == type;
    return found ? &oc_fmu_variables[reference] : NULL;
}

bool oc_fmu_settable(const oc_fmu *fmu, const oc_fmu_variable *variable) {
    if (variable->role == OC_FMU_INPUT) {
        return true;
    }
    return variable->role == OC_FMU_PARAMETER && fmu->phase <= OC_FMU_INITIALIZING;
}

/* The answer is computed when the importer reads it. */
static void update_answer(oc_fmu *fmu, const oc_fmu_variable *variable) {
    if (variable->role == OC_FMU_ANSWER && fmu->phase >= OC_FMU_STEPPING && !fmu->answer_is_current) {
        oc_answer_get(&fmu->state, &fmu->coefficients, &fmu->answer);
        const oc_offset_parts *parts = &fmu->answer.offset_parts;
        fmu->offset_parts[0] = (double)parts->drive_sd;
        fmu->offset_parts[1] = (double)parts->pull_sd;
        fmu->offset_parts[2] = (double)parts->wind_sd;
        fmu->offset_parts[3] = (double)parts->set_up_sd;
        fmu->offset_parts[4] = (double)parts->per_acceleration;
        fmu->answer_is_current = 1;
    }
}

double oc_fmu_real(oc_fmu *fmu, const oc_fmu_variable *variable) {
    double value;
    update_answer(fmu, variable);
    memcpy(&value, member(fmu, variable), sizeof value);
    return value;
}

int32_t oc_fmu_integer(oc_fmu *fmu, const oc_fmu_variable *variable) {
    int32_t value;
    update_answer(fmu, variable);
    memcpy(&value, member(fmu, variable), sizeof value);
    return value;
}

void oc_fmu_set_real(oc_fmu *fmu, const oc_fmu_variable *variable, double value) {
    memcpy(member(fmu, variable), &value, sizeof value);
}

void oc_fmu_set_integer(oc_fmu *fmu, const oc_fmu_variable *variable, int32_t value) {
    memcpy(member(fmu, variable), &value, sizeof value);
}

size_t oc_fmu_image_size(void) {
    return token_size + sizeof(oc_fmu) + sum_size;
}

/* FNV-1a: it finds damage, as of a file that was cut or edited, and is no signature. */
static uint32_t sum_of(const unsigned char *bytes, size_t count) {
    uint32_t sum = 2166136261u;
    for (size_t k = 0; k < count; ++k) {
        sum = (sum ^ bytes[k]) * 16777619u;
    }
    return sum;
}

void oc_fmu_to_image(const oc_fmu *fmu, unsigned char *image) {
    memset(image, 0, token_size);
    strncpy((char *)image, oc_fmu_token, token_size - 1);
    memcpy(image + token_size, fmu, sizeof *fmu);
    const uint32_t sum = sum_of(image, token_size + sizeof *fmu);
    memcpy(image + token_size + sizeof *fmu, &sum, sum_size);
}

const char *oc_fmu_from_image(oc_fmu *fmu, const unsigned char *image, size_t size) {
    if (size != oc_fmu_image_size()) {
        return "the saved state has the wrong size";
    }
    if (strncmp((const char *)image, oc_fmu_token, token_size) != 0) {
        return "the saved state is another FMU's";
    }
    const uint32_t sum = sum_of(image, token_size + sizeof *fmu);
    if (memcmp(image + token_size + sizeof *fmu, &sum, sum_size) != 0) {
        return "the saved state is damaged";
    }
    memcpy(fmu, image + token_size, sizeof *fmu);
    return NULL;
}

/* The functions of FMI 3.0 that a co-simulation FMU without clocks or arrays needs. */

#include <stdlib.h>
#include <string.h>

#include "fmi3Functions.h"
#include "instance.h"

typedef struct {
    oc_fmu fmu; /* the whole state */
    fmi3LogMessageCallback log;
    fmi3InstanceEnvironment environment;
} component;

enum { message_size = 160 };

static fmi3Status fail(const component *c, const char *what, const char *which) {
    if (c->log != NULL) {
        char message[message_size] = {0};
        strncpy(message, what, message_size - 1);
        strncat(message, which, message_size - 1 - strlen(message));
        c->log(c->environment, fmi3Error, "logStatusError", message);
    }
    return fmi3Error;
}

static const char bad_reference[] = "no variable of this type has this value reference";
static const char not_settable[] = "cannot be set now: ";

const char *fmi3GetVersion(void) {
    return fmi3Version;
}

fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean on, size_t count, const fmi3String categories[]) {
    (void)instance, (void)on, (void)count, (void)categories; /* always logs errors, and nothing else */
    return fmi3OK;
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                         fmi3Boolean logging, fmi3Boolean event_mode, fmi3Boolean early_return,
                                         const fmi3ValueReference intermediate[], size_t intermediate_count,
                                         fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                         fmi3IntermediateUpdateCallback update) {
    (void)name, (void)resources, (void)visible, (void)logging, (void)early_return;
    (void)intermediate, (void)intermediate_count, (void)update;
    const component probe = {.log = log, .environment = environment};
    if (event_mode) {
        fail(&probe, "this FMU has no event mode", "");
        return NULL;
    }
    if (token == NULL || strcmp(token, oc_fmu_token) != 0) {
        fail(&probe, "the instantiation token is not this FMU's: ", oc_fmu_token);
        return NULL;
    }
    component *c = calloc(1, sizeof *c);
    if (c == NULL) {
        return NULL;
    }
    oc_fmu_reset(&c->fmu);
    c->log = log;
    c->environment = environment;
    return c;
}

void fmi3FreeInstance(fmi3Instance instance) {
    free(instance);
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean tolerance_defined, fmi3Float64 tolerance,
                                       fmi3Float64 start, fmi3Boolean stop_defined, fmi3Float64 stop) {
    (void)tolerance_defined, (void)tolerance, (void)stop_defined, (void)stop;
    component *c = instance;
    if (c->fmu.phase != OC_FMU_INSTANTIATED) {
        return fail(c, "fmi3EnterInitializationMode comes before the simulation", "");
    }
    c->fmu.now = start;
    c->fmu.phase = OC_FMU_INITIALIZING;
    return fmi3OK;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance) {
    component *c = instance;
    if (c->fmu.phase != OC_FMU_INITIALIZING) {
        return fail(c, "fmi3ExitInitializationMode follows fmi3EnterInitializationMode", "");
    }
    const char *const wrong = oc_fmu_begin(&c->fmu);
    return wrong == NULL ? fmi3OK : fail(c, "parameter out of its range or missing: ", wrong);
}

fmi3Status fmi3Terminate(fmi3Instance instance) {
    component *c = instance;
    c->fmu.phase = OC_FMU_ENDED;
    return fmi3OK;
}

fmi3Status fmi3Reset(fmi3Instance instance) {
    component *c = instance;
    oc_fmu_reset(&c->fmu);
    return fmi3OK;
}

/* One getter and one setter a type; KIND is that of its variables, `value` one of them. */
#define GETTER(TYPE, KIND, VALUE)                                                                                      \
    fmi3Status fmi3Get##TYPE(fmi3Instance instance, const fmi3ValueReference references[], size_t count,               \
                             fmi3##TYPE values[], size_t value_count) {                                                \
        component *c = instance;                                                                                       \
        for (size_t k = 0; k < count; ++k) {                                                                           \
            const oc_fmu_variable *variable = oc_fmu_find(references[k], KIND);                                        \
            if (variable == NULL || value_count != count) {                                                            \
                return fail(c, bad_reference, "");                                                                     \
            }                                                                                                          \
            values[k] = VALUE;                                                                                         \
        }                                                                                                              \
        return fmi3OK;                                                                                                 \
    }

#define SETTER(TYPE, KIND, IS_POSSIBLE, SET)                                                                           \
    fmi3Status fmi3Set##TYPE(fmi3Instance instance, const fmi3ValueReference references[], size_t count,               \
                             const fmi3##TYPE values[], size_t value_count) {                                          \
        component *c = instance;                                                                                       \
        for (size_t k = 0; k < count; ++k) {                                                                           \
            const fmi3##TYPE value = values[k];                                                                        \
            const oc_fmu_variable *variable = oc_fmu_find(references[k], KIND);                                        \
            if (variable == NULL || value_count != count) {                                                            \
                return fail(c, bad_reference, "");                                                                     \
            }                                                                                                          \
            if (!oc_fmu_settable(&c->fmu, variable) || !(IS_POSSIBLE)) {                                               \
                return fail(c, not_settable, variable->name);                                                          \
            }                                                                                                          \
            SET;                                                                                                       \
        }                                                                                                              \
        return fmi3OK;                                                                                                 \
    }

GETTER(Float64, OC_FMU_REAL, oc_fmu_real(&c->fmu, variable))
GETTER(Int32, OC_FMU_INTEGER, oc_fmu_integer(&c->fmu, variable))
GETTER(Int64, OC_FMU_ENUMERATION, oc_fmu_integer(&c->fmu, variable)) /* FMI 3.0 reads enumerations as these */
GETTER(Boolean, OC_FMU_BOOLEAN, oc_fmu_integer(&c->fmu, variable) != 0)
SETTER(Float64, OC_FMU_REAL, true, oc_fmu_set_real(&c->fmu, variable, value))
SETTER(Int32, OC_FMU_INTEGER, true, oc_fmu_set_integer(&c->fmu, variable, value))
SETTER(Int64, OC_FMU_ENUMERATION, value >= INT32_MIN && value <= INT32_MAX,
       oc_fmu_set_integer(&c->fmu, variable, (int32_t)value))
SETTER(Boolean, OC_FMU_BOOLEAN, true, oc_fmu_set_integer(&c->fmu, variable, value ? 1 : 0))

fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *state) {
    const component *c = instance;
    if (*state == NULL) {
        *state = malloc(sizeof c->fmu);
    }
    if (*state == NULL) {
        return fail(c, "no memory for a state", "");
    }
    memcpy(*state, &c->fmu, sizeof c->fmu);
    return fmi3OK;
}

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState state) {
    component *c = instance;
    memcpy(&c->fmu, state, sizeof c->fmu);
    return fmi3OK;
}

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *state) {
    (void)instance;
    free(*state);
    *state = NULL;
    return fmi3OK;
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState state, size_t *size) {
    (void)instance, (void)state;
    *size = oc_fmu_image_size();
    return fmi3OK;
}

fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState state, fmi3Byte image[], size_t size) {
    if (size < oc_fmu_image_size()) {
        return fail(instance, "too little room for the state", "");
    }
    oc_fmu_to_image(state, image);
    return fmi3OK;
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte image[], size_t size, fmi3FMUState *state) {
    oc_fmu *read = malloc(sizeof *read);
    if (read == NULL) {
        return fail(instance, "no memory for a state", "");
    }
    const char *const wrong = oc_fmu_from_image(read, image, size);
    if (wrong != NULL) {
        free(read);
        return fail(instance, wrong, "");
    }
    *state = read;
    return fmi3OK;
}

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 time, fmi3Float64 step, fmi3Boolean no_going_back,
                      fmi3Boolean *events, fmi3Boolean *terminate, fmi3Boolean *early_return, fmi3Float64 *last) {
    (void)no_going_back;
    component *c = instance;
    *events = fmi3False;
    *terminate = fmi3False;
    *early_return = fmi3False;
    *last = c->fmu.now;
    if (c->fmu.phase != OC_FMU_STEPPING) {
        return fail(c, "fmi3DoStep comes after fmi3ExitInitializationMode", "");
    }
    if (!oc_fmu_advance(&c->fmu, time, step)) {
        return fail(c, "time must go forward by a positive step", "");
    }
    *last = c->fmu.now;
    return fmi3OK;
}

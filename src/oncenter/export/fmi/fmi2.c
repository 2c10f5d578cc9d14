/* The functions of FMI 2.0 for co-simulation. */

#include <stdlib.h>
#include <string.h>

#include "fmi2Functions.h"
#include "instance.h"

typedef struct {
    oc_fmu fmu; /* the whole state */
    fmi2CallbackLogger log;
    fmi2ComponentEnvironment environment;
    char *name;
} component;

static fmi2Status fail(const component *c, const char *what, const char *which) {
    if (c->log != NULL) {
        c->log(c->environment, c->name, fmi2Error, "logStatusError", "%s%s", what, which);
    }
    return fmi2Error;
}

static const char bad_reference[] = "no variable of this type has this value reference";
static const char not_settable[] = "cannot be set now: ";

const char *fmi2GetTypesPlatform(void) {
    return fmi2TypesPlatform;
}

const char *fmi2GetVersion(void) {
    return fmi2Version;
}

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t count, const fmi2String categories[]) {
    (void)c, (void)on, (void)count, (void)categories; /* always logs errors, and nothing else */
    return fmi2OK;
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging) {
    (void)resources, (void)visible, (void)logging;
    component probe = {.log = functions == NULL ? NULL : functions->logger,
                       .environment = functions == NULL ? NULL : functions->componentEnvironment,
                       .name = (char[]){"oncenter"}};
    if (type != fmi2CoSimulation) {
        fail(&probe, "this FMU is for co-simulation only", "");
        return NULL;
    }
    if (guid == NULL || strcmp(guid, oc_fmu_token) != 0) {
        fail(&probe, "the GUID is not this FMU's: ", oc_fmu_token);
        return NULL;
    }
    component *c = calloc(1, sizeof *c);
    const size_t length = name == NULL ? 0 : strlen(name);
    char *copy = calloc(1, length + 1);
    if (c == NULL || copy == NULL) {
        free(c);
        free(copy);
        return NULL;
    }
    if (length > 0) {
        memcpy(copy, name, length);
    }
    oc_fmu_reset(&c->fmu);
    c->log = probe.log;
    c->environment = probe.environment;
    c->name = copy;
    return c;
}

void fmi2FreeInstance(fmi2Component instance) {
    component *c = instance;
    if (c != NULL) {
        free(c->name);
        free(c);
    }
}

fmi2Status fmi2SetupExperiment(fmi2Component instance, fmi2Boolean tolerance_defined, fmi2Real tolerance,
                               fmi2Real start, fmi2Boolean stop_defined, fmi2Real stop) {
    (void)tolerance_defined, (void)tolerance, (void)stop_defined, (void)stop;
    component *c = instance;
    c->fmu.now = start;
    return fmi2OK;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component instance) {
    component *c = instance;
    if (c->fmu.phase != OC_FMU_INSTANTIATED) {
        return fail(c, "fmi2EnterInitializationMode comes before the simulation", "");
    }
    c->fmu.phase = OC_FMU_INITIALIZING;
    return fmi2OK;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component instance) {
    component *c = instance;
    if (c->fmu.phase != OC_FMU_INITIALIZING) {
        return fail(c, "fmi2ExitInitializationMode follows fmi2EnterInitializationMode", "");
    }
    const char *const wrong = oc_fmu_begin(&c->fmu);
    return wrong == NULL ? fmi2OK : fail(c, "parameter out of its range or missing: ", wrong);
}

fmi2Status fmi2Terminate(fmi2Component instance) {
    component *c = instance;
    c->fmu.phase = OC_FMU_ENDED;
    return fmi2OK;
}

fmi2Status fmi2Reset(fmi2Component instance) {
    component *c = instance;
    oc_fmu_reset(&c->fmu);
    return fmi2OK;
}

/* FMI 2.0 reads enumerations as integers. */
static const oc_fmu_variable *fmi2_integer(fmi2ValueReference reference) {
    const oc_fmu_variable *integer = oc_fmu_find(reference, OC_FMU_INTEGER);
    return integer != NULL ? integer : oc_fmu_find(reference, OC_FMU_ENUMERATION);
}

/* One getter and one setter a type; FOUND is its variable, `value` one of the values. */
#define GETTER(TYPE, FOUND, VALUE)                                                                                     \
    fmi2Status fmi2Get##TYPE(fmi2Component instance, const fmi2ValueReference references[], size_t count,              \
                             fmi2##TYPE values[]) {                                                                    \
        component *c = instance;                                                                                       \
        for (size_t k = 0; k < count; ++k) {                                                                           \
            const oc_fmu_variable *variable = FOUND;                                                                   \
            if (variable == NULL) {                                                                                    \
                return fail(c, bad_reference, "");                                                                     \
            }                                                                                                          \
            values[k] = VALUE;                                                                                         \
        }                                                                                                              \
        return fmi2OK;                                                                                                 \
    }

#define SETTER(TYPE, FOUND, SET)                                                                                       \
    fmi2Status fmi2Set##TYPE(fmi2Component instance, const fmi2ValueReference references[], size_t count,              \
                             const fmi2##TYPE values[]) {                                                              \
        component *c = instance;                                                                                       \
        for (size_t k = 0; k < count; ++k) {                                                                           \
            const fmi2##TYPE value = values[k];                                                                        \
            const oc_fmu_variable *variable = FOUND;                                                                   \
            if (variable == NULL) {                                                                                    \
                return fail(c, bad_reference, "");                                                                     \
            }                                                                                                          \
            if (!oc_fmu_settable(&c->fmu, variable)) {                                                                 \
                return fail(c, not_settable, variable->name);                                                          \
            }                                                                                                          \
            SET;                                                                                                       \
        }                                                                                                              \
        return fmi2OK;                                                                                                 \
    }

GETTER(Real, oc_fmu_find(references[k], OC_FMU_REAL), oc_fmu_real(&c->fmu, variable))
GETTER(Integer, fmi2_integer(references[k]), oc_fmu_integer(&c->fmu, variable))
GETTER(Boolean, oc_fmu_find(references[k], OC_FMU_BOOLEAN), oc_fmu_integer(&c->fmu, variable) ? fmi2True : fmi2False)
SETTER(Real, oc_fmu_find(references[k], OC_FMU_REAL), oc_fmu_set_real(&c->fmu, variable, value))
SETTER(Integer, fmi2_integer(references[k]), oc_fmu_set_integer(&c->fmu, variable, value))
SETTER(Boolean, oc_fmu_find(references[k], OC_FMU_BOOLEAN),
       oc_fmu_set_integer(&c->fmu, variable, value != fmi2False))

fmi2Status fmi2GetString(fmi2Component instance, const fmi2ValueReference references[], size_t count,
                         fmi2String values[]) {
    (void)references, (void)values;
    return count == 0 ? fmi2OK : fail(instance, bad_reference, "");
}

fmi2Status fmi2SetString(fmi2Component instance, const fmi2ValueReference references[], size_t count,
                         const fmi2String values[]) {
    (void)references, (void)values;
    return count == 0 ? fmi2OK : fail(instance, bad_reference, "");
}

fmi2Status fmi2GetFMUstate(fmi2Component instance, fmi2FMUstate *state) {
    const component *c = instance;
    if (*state == NULL) {
        *state = malloc(sizeof c->fmu);
    }
    if (*state == NULL) {
        return fail(c, "no memory for a state", "");
    }
    memcpy(*state, &c->fmu, sizeof c->fmu);
    return fmi2OK;
}

fmi2Status fmi2SetFMUstate(fmi2Component instance, fmi2FMUstate state) {
    component *c = instance;
    memcpy(&c->fmu, state, sizeof c->fmu);
    return fmi2OK;
}

fmi2Status fmi2FreeFMUstate(fmi2Component instance, fmi2FMUstate *state) {
    (void)instance;
    free(*state);
    *state = NULL;
    return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component instance, fmi2FMUstate state, size_t *size) {
    (void)instance, (void)state;
    *size = oc_fmu_image_size();
    return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component instance, fmi2FMUstate state, fmi2Byte image[], size_t size) {
    if (size < oc_fmu_image_size()) {
        return fail(instance, "too little room for the state", "");
    }
    oc_fmu_to_image(state, (unsigned char *)image);
    return fmi2OK;
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component instance, const fmi2Byte image[], size_t size, fmi2FMUstate *state) {
    oc_fmu *read = malloc(sizeof *read);
    if (read == NULL) {
        return fail(instance, "no memory for a state", "");
    }
    const char *const wrong = oc_fmu_from_image(read, (const unsigned char *)image, size);
    if (wrong != NULL) {
        free(read);
        return fail(instance, wrong, "");
    }
    *state = read;
    return fmi2OK;
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component instance, const fmi2ValueReference unknowns[],
                                        size_t unknown_count, const fmi2ValueReference knowns[], size_t known_count,
                                        const fmi2Real seed[], fmi2Real sensitivity[]) {
    (void)unknowns, (void)unknown_count, (void)knowns, (void)known_count, (void)seed, (void)sensitivity;
    return fail(instance, "derivatives are not provided", "");
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component instance, const fmi2ValueReference references[], size_t count,
                                       const fmi2Integer order[], const fmi2Real values[]) {
    (void)references, (void)count, (void)order, (void)values;
    return fail(instance, "inputs are not interpolated", "");
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component instance, const fmi2ValueReference references[], size_t count,
                                        const fmi2Integer order[], fmi2Real values[]) {
    (void)references, (void)count, (void)order, (void)values;
    return fail(instance, "derivatives are not provided", "");
}

fmi2Status fmi2DoStep(fmi2Component instance, fmi2Real time, fmi2Real step, fmi2Boolean no_going_back) {
    (void)no_going_back;
    component *c = instance;
    if (c->fmu.phase != OC_FMU_STEPPING) {
        return fail(c, "fmi2DoStep comes after fmi2ExitInitializationMode", "");
    }
    return oc_fmu_advance(&c->fmu, time, step) ? fmi2OK : fail(c, "time must go forward by a positive step", "");
}

fmi2Status fmi2CancelStep(fmi2Component instance) {
    return fail(instance, "a step is over when fmi2DoStep returns", "");
}

fmi2Status fmi2GetStatus(fmi2Component instance, const fmi2StatusKind kind, fmi2Status *value) {
    (void)kind, (void)value;
    return fail(instance, "a step is over when fmi2DoStep returns", "");
}

fmi2Status fmi2GetRealStatus(fmi2Component instance, const fmi2StatusKind kind, fmi2Real *value) {
    const component *c = instance;
    if (kind != fmi2LastSuccessfulTime) {
        return fail(c, "a step is over when fmi2DoStep returns", "");
    }
    *value = c->fmu.now;
    return fmi2OK;
}

fmi2Status fmi2GetIntegerStatus(fmi2Component instance, const fmi2StatusKind kind, fmi2Integer *value) {
    (void)kind, (void)value;
    return fail(instance, "a step is over when fmi2DoStep returns", "");
}

fmi2Status fmi2GetBooleanStatus(fmi2Component instance, const fmi2StatusKind kind, fmi2Boolean *value) {
    if (kind != fmi2Terminated) {
        return fail(instance, "a step is over when fmi2DoStep returns", "");
    }
    *value = fmi2False;
    return fmi2OK;
}

fmi2Status fmi2GetStringStatus(fmi2Component instance, const fmi2StatusKind kind, fmi2String *value) {
    (void)kind, (void)value;
    return fail(instance, "a step is over when fmi2DoStep returns", "");
}

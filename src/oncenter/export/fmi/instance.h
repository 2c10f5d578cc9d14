#ifndef OC_FMU_INSTANCE_H
#define OC_FMU_INSTANCE_H
/* An instance of the monitor as an FMU holds it, the same for FMI 2.0 and 3.0.
 *
 * Plain data without a pointer: an FMU's state is a copy of it. SI and rad, as in the core. */

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "monitor.h"

enum {
    OC_FMU_SIGNALS = 10, /* bits of oc_signals.valid; the written table checks both counts */
    OC_FMU_PARTS = 5     /* members of oc_offset_parts */
};

typedef enum { OC_FMU_INSTANTIATED, OC_FMU_INITIALIZING, OC_FMU_STEPPING, OC_FMU_ENDED } oc_fmu_phase;

/* Parameters and inputs as the importer sets them, outputs as it reads them. What is no double is an int32_t here. */
typedef struct {
    oc_fmu_phase phase;
    double now;                    /* s, the communication point */
    double due;                    /* s, of the next tick */
    int32_t clock_started;
    /* parameters */
    double rate_hz;
    oc_vehicle vehicle;
    oc_params params;
    int32_t method, angle_method;  /* oc_method, oc_angle_method */
    int32_t traffic_side;          /* as in oc_vehicle */
    /* inputs */
    oc_signals tick;
    int32_t available[OC_FMU_SIGNALS]; /* by place of the bit */
    /* outputs */
    oc_output output;
    int32_t angle_status, fault;   /* oc_status, oc_fault */
    int32_t reasons[OC_REASON_COUNT];
    oc_answer answer;
    double offset_parts[OC_FMU_PARTS]; /* members of oc_offset_parts in their order */
    int32_t answer_is_current;
    /* the core */
    oc_coefficients coefficients;
    oc_state state;
} oc_fmu;

typedef enum { OC_FMU_REAL, OC_FMU_INTEGER, OC_FMU_BOOLEAN, OC_FMU_ENUMERATION } oc_fmu_type;

typedef enum {
    OC_FMU_INDEPENDENT,
    OC_FMU_PARAMETER, /* fixed: set before the simulation */
    OC_FMU_INPUT,
    OC_FMU_OUTPUT,    /* of the last tick */
    OC_FMU_ANSWER     /* of all ticks so far */
} oc_fmu_role;

/* A variable's value reference is its place in the table. */
typedef struct {
    oc_fmu_type type;
    oc_fmu_role role;
    size_t offset; /* of an oc_fmu's member: a double, or an int32_t */
    double start;  /* of parameters and inputs */
    const char *name;
} oc_fmu_variable;

/* Written by the export, from the table that the model description is written from. */
extern const oc_fmu_variable oc_fmu_variables[];
extern const uint32_t oc_fmu_variable_count;
extern const char oc_fmu_token[];

/* All parameters and inputs as the vehicle file says. */
void oc_fmu_reset(oc_fmu *fmu);

/* From parameters to coefficients, and ignition. What is wrong with the parameters, or NULL. */
const char *oc_fmu_begin(oc_fmu *fmu);

/* All ticks that are due from `time` until `step` later, both s. False when time is no number or runs backward. */
bool oc_fmu_advance(oc_fmu *fmu, double time, double step);

/* The variable, or NULL where there is none of this type by this reference. */
const oc_fmu_variable *oc_fmu_find(uint32_t reference, oc_fmu_type type);

/* Whether it may be set now. */
bool oc_fmu_settable(const oc_fmu *fmu, const oc_fmu_variable *variable);

double oc_fmu_real(oc_fmu *fmu, const oc_fmu_variable *variable);
int32_t oc_fmu_integer(oc_fmu *fmu, const oc_fmu_variable *variable);
void oc_fmu_set_real(oc_fmu *fmu, const oc_fmu_variable *variable, double value);
void oc_fmu_set_integer(oc_fmu *fmu, const oc_fmu_variable *variable, int32_t value);

/* A state as bytes: this very FMU's on this kind of machine, or refused by name. */
size_t oc_fmu_image_size(void);
void oc_fmu_to_image(const oc_fmu *fmu, unsigned char *image);
const char *oc_fmu_from_image(oc_fmu *fmu, const unsigned char *image, size_t size);

#endif

/* What FMI 3.0 asks every FMU to export and this one has no use for: each refuses. */

#include <stddef.h>

#include "fmi3Functions.h"

typedef const fmi3ValueReference *References;

/* A function of an instance and of so many further parameters. */
#define REFUSE_0(NAME) \
    fmi3Status NAME(fmi3Instance instance) { (void)instance; return fmi3Error; }
#define REFUSE_1(NAME, A) \
    fmi3Status NAME(fmi3Instance instance, A a) { (void)instance, (void)a; return fmi3Error; }
#define REFUSE_2(NAME, A, B) \
    fmi3Status NAME(fmi3Instance instance, A a, B b) { (void)instance, (void)a, (void)b; return fmi3Error; }
#define REFUSE_3(NAME, A, B, C) \
    fmi3Status NAME(fmi3Instance instance, A a, B b, C c) \
    { (void)instance, (void)a, (void)b, (void)c; return fmi3Error; }
#define REFUSE_4(NAME, A, B, C, D) \
    fmi3Status NAME(fmi3Instance instance, A a, B b, C c, D d) \
    { (void)instance, (void)a, (void)b, (void)c, (void)d; return fmi3Error; }
#define REFUSE_5(NAME, A, B, C, D, E) \
    fmi3Status NAME(fmi3Instance instance, A a, B b, C c, D d, E e) \
    { (void)instance, (void)a, (void)b, (void)c, (void)d, (void)e; return fmi3Error; }
#define REFUSE_6(NAME, A, B, C, D, E, F) \
    fmi3Status NAME(fmi3Instance instance, A a, B b, C c, D d, E e, F f) \
    { (void)instance, (void)a, (void)b, (void)c, (void)d, (void)e, (void)f; return fmi3Error; }
#define REFUSE_8(NAME, A, B, C, D, E, F, G, H) \
    fmi3Status NAME(fmi3Instance instance, A a, B b, C c, D d, E e, F f, G g, H h) \
    { (void)instance, (void)a, (void)b, (void)c, (void)d, (void)e, (void)f, (void)g, (void)h; return fmi3Error; }
#define REFUSE_GET_AND_SET(TYPE) \
    REFUSE_4(fmi3Get##TYPE, References, size_t, fmi3##TYPE *, size_t) \
    REFUSE_4(fmi3Set##TYPE, References, size_t, const fmi3##TYPE *, size_t)

REFUSE_0(fmi3EnterEventMode)
REFUSE_GET_AND_SET(Float32)
REFUSE_GET_AND_SET(Int8)
REFUSE_GET_AND_SET(UInt8)
REFUSE_GET_AND_SET(Int16)
REFUSE_GET_AND_SET(UInt16)
REFUSE_GET_AND_SET(UInt32)
REFUSE_GET_AND_SET(UInt64)
REFUSE_GET_AND_SET(String)
REFUSE_5(fmi3GetBinary, References, size_t, size_t *, fmi3Binary *, size_t)
REFUSE_3(fmi3GetClock, References, size_t, fmi3Clock *)
REFUSE_5(fmi3SetBinary, References, size_t, const size_t *, const fmi3Binary *, size_t)
REFUSE_3(fmi3SetClock, References, size_t, const fmi3Clock *)
REFUSE_2(fmi3GetNumberOfVariableDependencies, fmi3ValueReference, size_t *)
REFUSE_6(fmi3GetVariableDependencies, fmi3ValueReference, size_t *, fmi3ValueReference *, size_t *,
         fmi3DependencyKind *, size_t)
REFUSE_8(fmi3GetDirectionalDerivative, References, size_t, References, size_t, const fmi3Float64 *, size_t,
         fmi3Float64 *, size_t)
REFUSE_8(fmi3GetAdjointDerivative, References, size_t, References, size_t, const fmi3Float64 *, size_t, fmi3Float64 *,
         size_t)
REFUSE_0(fmi3EnterConfigurationMode)
REFUSE_0(fmi3ExitConfigurationMode)
REFUSE_4(fmi3GetIntervalDecimal, References, size_t, fmi3Float64 *, fmi3IntervalQualifier *)
REFUSE_5(fmi3GetIntervalFraction, References, size_t, fmi3UInt64 *, fmi3UInt64 *, fmi3IntervalQualifier *)
REFUSE_3(fmi3GetShiftDecimal, References, size_t, fmi3Float64 *)
REFUSE_4(fmi3GetShiftFraction, References, size_t, fmi3UInt64 *, fmi3UInt64 *)
REFUSE_3(fmi3SetIntervalDecimal, References, size_t, const fmi3Float64 *)
REFUSE_4(fmi3SetIntervalFraction, References, size_t, const fmi3UInt64 *, const fmi3UInt64 *)
REFUSE_3(fmi3SetShiftDecimal, References, size_t, const fmi3Float64 *)
REFUSE_4(fmi3SetShiftFraction, References, size_t, const fmi3UInt64 *, const fmi3UInt64 *)
REFUSE_0(fmi3EvaluateDiscreteStates)
REFUSE_6(fmi3UpdateDiscreteStates, fmi3Boolean *, fmi3Boolean *, fmi3Boolean *, fmi3Boolean *, fmi3Boolean *,
         fmi3Float64 *)
REFUSE_0(fmi3EnterContinuousTimeMode)
REFUSE_3(fmi3CompletedIntegratorStep, fmi3Boolean, fmi3Boolean *, fmi3Boolean *)
REFUSE_1(fmi3SetTime, fmi3Float64)
REFUSE_2(fmi3SetContinuousStates, const fmi3Float64 *, size_t)
REFUSE_2(fmi3GetContinuousStateDerivatives, fmi3Float64 *, size_t)
REFUSE_2(fmi3GetEventIndicators, fmi3Float64 *, size_t)
REFUSE_2(fmi3GetContinuousStates, fmi3Float64 *, size_t)
REFUSE_2(fmi3GetNominalsOfContinuousStates, fmi3Float64 *, size_t)
REFUSE_1(fmi3GetNumberOfEventIndicators, size_t *)
REFUSE_1(fmi3GetNumberOfContinuousStates, size_t *)
REFUSE_0(fmi3EnterStepMode)
REFUSE_5(fmi3GetOutputDerivatives, References, size_t, const fmi3Int32 *, fmi3Float64 *, size_t)
REFUSE_2(fmi3ActivateModelPartition, fmi3ValueReference, fmi3Float64)

fmi3Instance fmi3InstantiateModelExchange(fmi3String instanceName, fmi3String instantiationToken,
                                          fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn,
                                          fmi3InstanceEnvironment instanceEnvironment,
                                          fmi3LogMessageCallback logMessage) {
    (void)instanceName, (void)instantiationToken, (void)resourcePath, (void)visible, (void)loggingOn;
    (void)instanceEnvironment, (void)logMessage;
    return NULL;
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String instanceName, fmi3String instantiationToken,
                                               fmi3String resourcePath, fmi3Boolean visible, fmi3Boolean loggingOn,
                                               fmi3InstanceEnvironment instanceEnvironment,
                                               fmi3LogMessageCallback logMessage, fmi3ClockUpdateCallback clockUpdate,
                                               fmi3LockPreemptionCallback lockPreemption,
                                               fmi3UnlockPreemptionCallback unlockPreemption) {
    (void)instanceName, (void)instantiationToken, (void)resourcePath, (void)visible, (void)loggingOn;
    (void)instanceEnvironment, (void)logMessage, (void)clockUpdate, (void)lockPreemption, (void)unlockPreemption;
    return NULL;
}

#include "monitor.h"

#include <stddef.h>

const char *oc_version(void) {
    /* written from the header's numbers, each below 10, without stdio */
    static const char version[] = {'0' + OC_VERSION_MAJOR, '.', '0' + OC_VERSION_MINOR, '.', '0' + OC_VERSION_PATCH, 0};
    return version;
}

const char *oc_error_name(oc_error error) {
    static const char *const names[OC_ERROR_COUNT] = {"ok",   "vehicle", "params", "rate",
                                                       "null", "setup",   "state"};
    return (unsigned)error < OC_ERROR_COUNT ? names[error] : "unknown";
}

const char *oc_status_name(oc_status status) {
    static const char *const names[OC_STATUS_COUNT] = {"unobservable", "converging", "valid", "invalid"};
    return (unsigned)status < OC_STATUS_COUNT ? names[status] : "unknown";
}

const char *oc_method_name(oc_method method) {
    static const char *const names[OC_METHOD_COUNT] = {"thesis", "joint", "wheel-speed"};
    return (unsigned)method < OC_METHOD_COUNT ? names[method] : "unknown";
}

const char *oc_angle_method_name(oc_angle_method method) {
    static const char *const names[OC_ANGLE_METHOD_COUNT] = {
        "observer", "wheel-speed", "wheel-speed-exact", "yaw-rate", "yaw-rate-understeer", "side-slip"};
    return (unsigned)method < OC_ANGLE_METHOD_COUNT ? names[method] : "unknown";
}

const char *oc_reason_name(oc_reason reason) {
    static const char *const names[OC_REASON_COUNT] = {
        "missing_signal", "time", "gap", "settling", "speed", "curvature", "longitudinal_acceleration",
        "bank", "window", "yaw_rate_bias", "lateral_acceleration", "signal_fault",
        "intervention", "reverse", "steering_assist"};
    uint32_t k = 0;
    while (k < OC_REASON_COUNT && (uint32_t)reason != 1u << k) {
        ++k;
    }
    return k < OC_REASON_COUNT ? names[k] : NULL;
}

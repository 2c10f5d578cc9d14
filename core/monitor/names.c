#include "monitor.h"

#include <stddef.h>

const char *oc_version(void) {
    /* written from the header's numbers, each below 10, without stdio */
    static const char version[] = {'0' + OC_VERSION_MAJOR, '.', '0' + OC_VERSION_MINOR, '.', '0' + OC_VERSION_PATCH, 0};
    return version;
}

const char *oc_error_name(oc_error error) {
    static const char *const names[OC_ERROR_COUNT] = {"ok", "vehicle", "params", "rate"};
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
    switch (reason) {
    case OC_REASON_MISSING_SIGNAL: return "missing_signal";
    case OC_REASON_TIME: return "time";
    case OC_REASON_GAP: return "gap";
    case OC_REASON_SETTLING: return "settling";
    case OC_REASON_SPEED: return "speed";
    case OC_REASON_CURVATURE: return "curvature";
    case OC_REASON_LONGITUDINAL_ACCELERATION: return "longitudinal_acceleration";
    case OC_REASON_BANK: return "bank";
    case OC_REASON_WINDOW: return "window";
    case OC_REASON_YAW_RATE_BIAS: return "yaw_rate_bias";
    case OC_REASON_LATERAL_ACCELERATION: return "lateral_acceleration";
    case OC_REASON_COUNT:
    default: break;
    }
    return NULL;
}

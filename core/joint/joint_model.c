#include "joint_model.h"

/* 1 deg is the constant 0.017453292 rad, so that all machines have the same bits. */
static const oc_joint_model model = {
    .terms = {
        /* terms.toml: priors */
        [YAW_ACCELERATION] = {0.0f, 100.0f * 0.017453292f},
        [JERK] = {0.0f, 10.0f * 0.017453292f},
        [FIFTH_WHEEL] = {0.0f, 1.5f * 0.017453292f},
        [UNEVEN] = {0.0f, 0.007f},
        [YAW_RATE_BIAS] = {0.0f, 1.0f * 0.017453292f},
        [WIND] = {0.0f, 0.05f},
        [WIND_ACROSS] = {0.0f, 0.05f},
        [CREEP] = {100.0f * 0.017453292f, 0.7f},
        [FRICTION] = {0.1f, 0.15f},
        [UNLOADING] = {0.0f, 0.15f},
        [WIDTH] = {4.0f * 0.017453292f, 6.0f * 0.017453292f},
        [UNWINDING] = {0.0f, 0.6f},
        [WINDUP] = {1.0f * 0.017453292f, 2.0f * 0.017453292f},
        [WHEELBASE] = {0.0f, 0.05f},
        [GRADIENT] = {0.4f * 0.017453292f, 0.4f * 0.017453292f},
        /* end */
    },
    .little_play = 2.0f * 0.017453292f,
};

const oc_joint_model *oc_joint_model_get(void) {
    return &model;
}

"""openpilot's paramsd: an extended Kalman filter over the linear single-track model, gated by its own estimate.

State: stiffness factor s, steer ratio i, slow offset, fast offset, speeds u and v of the centre of gravity, yaw rate r,
steering wheel angle, roll of the road. With d = (angle - offsets)/i,

    v' = s ((-(C_f + C_r) v - (C_f a - C_r b) r)/(m u) + C_f d/m) - u r - g roll
    r' = s ((-(C_f a - C_r b) v - (C_f a^2 + C_r b^2) r)/(J u) + C_f a d/J)

and all other states are random walks. Angle and speed are observed at every tick, yaw rate, roll and "the fast offset
is zero" at 20 Hz. A truck's bus has no roll: (a_y - r v)/g from accelerometer and gyro is used.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numba import njit

from oncenter.signals import DEGREE, STANDARD_GRAVITY
from rivals import MINUTE_TICKS, Array, Course, Known

TICK_S = 0.01
SLOW_TICKS = 5  # 20 Hz
SPEED_MIN_M_S = 1.0
ANGLE_MAX_RAD = 45.0 * DEGREE
OFFSET_VALID_MAX_RAD = 10.0 * DEGREE
RATIO_VALID, STIFFNESS_VALID = (0.5, 2.0), (0.2, 5.0)  # relative to the initial value
# Standard deviation of each state's change per second; its square is also the initial covariance.
WANDER = np.array([5e-4, 0.01, 0.02 * DEGREE, 0.25 * DEGREE, 0.1, 0.01, 0.1 * DEGREE, 0.1 * DEGREE, 1.0 * DEGREE])
ANGLE_SD_RAD = 0.05 * DEGREE
SPEED_SD_M_S = 0.1
YAW_RATE_SD_RAD_S = 0.1 * DEGREE  # Table 1's noise
ROLL_SD_RAD = 1.0 * DEGREE
FAST_OFFSET_SD_RAD = 10.0 * DEGREE

STATES = 9
STIFFNESS, RATIO, SLOW, FAST, U, V, YAW_RATE, ANGLE, ROLL = range(STATES)


def openpilot(columns: Mapping[str, Array], known: Known) -> Course:
    value, sd, valid = _course(
        columns["steering_wheel_angle_rad"],
        columns["yaw_rate_rad_s"],
        columns["vehicle_speed_m_s"],
        columns["lateral_acceleration_m_s2"],
        body_of(known),
        known.steering_ratio,
    )
    return Course(value, sd, valid)


def body_of(known: Known) -> Array:
    """(C_f + C_r)/m, (C_f a - C_r b)/m, C_f/m, (C_f a - C_r b)/J, (C_f a^2 + C_r b^2)/J, C_f a/J."""
    a, b = known.front_axle_distance_m, known.wheelbase_m - known.front_axle_distance_m
    front, rear = known.front_cornering_stiffness_n_rad, known.rear_cornering_stiffness_n_rad
    m, J = known.mass_kg, known.yaw_inertia_kg_m2
    turning = front * a - rear * b
    return np.array(
        [(front + rear) / m, turning / m, front / m, turning / J, (front * a * a + rear * b * b) / J, front * a / J]
    )


@njit(cache=True)
def predict(x, P, body, dt):
    """One Euler step of x, and of P with the Jacobian, whose rows except those of v and r are identity."""
    s, i, u, v, r = x[STIFFNESS], x[RATIO], x[U], x[V], x[YAW_RATE]
    d = (x[ANGLE] - x[SLOW] - x[FAST]) / i
    by_v = -body[0] * v / u - body[1] * r / u + body[2] * d
    by_r = -body[3] * v / u - body[4] * r / u + body[5] * d
    F = np.zeros((2, STATES))
    F[0, STIFFNESS], F[1, STIFFNESS] = by_v, by_r
    F[0, RATIO], F[1, RATIO] = -s * body[2] * d / i, -s * body[5] * d / i
    F[0, SLOW] = F[0, FAST] = -s * body[2] / i
    F[1, SLOW] = F[1, FAST] = -s * body[5] / i
    F[0, ANGLE], F[1, ANGLE] = s * body[2] / i, s * body[5] / i
    F[0, U] = s * (body[0] * v + body[1] * r) / (u * u) - r
    F[1, U] = s * (body[3] * v + body[4] * r) / (u * u)
    F[0, V], F[1, V] = -s * body[0] / u, -s * body[3] / u
    F[0, YAW_RATE], F[1, YAW_RATE] = -s * body[1] / u - u, -s * body[4] / u
    F[0, ROLL] = -STANDARD_GRAVITY
    x[V] += dt * (s * by_v - u * r - STANDARD_GRAVITY * x[ROLL])
    x[YAW_RATE] += dt * s * by_r
    moved = np.zeros((2, STATES))
    for row in range(2):
        for column in range(STATES):
            for k in range(STATES):
                moved[row, column] += F[row, k] * P[k, column]
    for column in range(STATES):
        P[V, column] += dt * moved[0, column]
        P[YAW_RATE, column] += dt * moved[1, column]
    moved[:] = 0.0
    for row in range(2):
        for column in range(STATES):
            for k in range(STATES):
                moved[row, column] += F[row, k] * P[column, k]
    for column in range(STATES):
        P[column, V] += dt * moved[0, column]
        P[column, YAW_RATE] += dt * moved[1, column]
    for k in range(STATES):
        P[k, k] += dt * WANDER[k] * WANDER[k]


@njit(cache=True)
def observe(x, P, which, seen, sd):
    """Measurement update: state `which` was observed as `seen`."""
    spread = P[which, which] + sd * sd
    gain = P[:, which] / spread
    x += gain * (seen - x[which])
    row = P[which].copy()
    for k in range(STATES):
        for j in range(STATES):
            P[k, j] -= gain[k] * row[j]


@njit(cache=True)
def begin(x, P, ratio, speed):
    x[:] = 0.0
    x[STIFFNESS], x[RATIO], x[U] = 1.0, ratio, speed
    P[:] = 0.0
    for k in range(STATES):
        P[k, k] = WANDER[k] * WANDER[k]


@njit(cache=True)
def _course(angle, r, v, a_y, body, ratio):
    minutes = len(angle) // MINUTE_TICKS
    value, sd = np.full(minutes, np.nan), np.full(minutes, np.nan)
    valid = np.zeros(minutes, np.bool_)
    x, P = np.zeros(STATES), np.zeros((STATES, STATES))
    begun = False
    for k in range(len(angle)):
        if v[k] > SPEED_MIN_M_S and abs(angle[k]) < ANGLE_MAX_RAD:
            if not begun:
                begin(x, P, ratio, v[k])
                begun = True
            predict(x, P, body, TICK_S)
            observe(x, P, ANGLE, angle[k], ANGLE_SD_RAD)
            observe(x, P, U, v[k], SPEED_SD_M_S)
            if k % SLOW_TICKS == 0:
                if not np.isnan(r[k]):
                    observe(x, P, YAW_RATE, r[k], YAW_RATE_SD_RAD_S)
                roll = (a_y[k] - r[k] * v[k]) / STANDARD_GRAVITY
                if not np.isnan(roll):
                    observe(x, P, ROLL, roll, ROLL_SD_RAD)
                observe(x, P, FAST, 0.0, FAST_OFFSET_SD_RAD)
            if not (np.all(np.isfinite(x)) and np.all(np.isfinite(P))) or x[U] <= 0.0:
                begun = False  # the filter diverged and restarts
        if (k + 1) % MINUTE_TICKS == 0 and begun:
            minute = k // MINUTE_TICKS
            value[minute], sd[minute] = x[SLOW], np.sqrt(max(P[SLOW, SLOW], 0.0))
            valid[minute] = (
                abs(x[SLOW]) < OFFSET_VALID_MAX_RAD
                and RATIO_VALID[0] * ratio < x[RATIO] < RATIO_VALID[1] * ratio
                and STIFFNESS_VALID[0] < x[STIFFNESS] < STIFFNESS_VALID[1]
            )
    return value, sd, valid

// The filters of autoware.py and openpilot.py in the language that their trucks run: the same steps in the same order.
// openpilot's has compile-time sizes, and a prediction changes only what its Jacobian changes, as in the code
// that openpilot generates.

#include <cmath>
#include <cstddef>

namespace {

constexpr std::size_t MINUTE_TICKS = 6000, TENTH = 10;  // at 100 Hz
constexpr double DEGREE = 3.14159265358979323846 / 180.0, GRAVITY = 9.80665;

// Scalar Kalman filter at 10 Hz.
double autoware(std::size_t count, const double *wheel, const double *r, const double *v, double L, double ratio) {
    double theta = 0.0, P = 0.5;
    for (std::size_t k = TENTH; k < count; k += TENTH) {
        const double delta = wheel[k] / ratio, before = wheel[k - TENTH] / ratio;
        const bool good = v[k] >= 1.0 && std::fabs(r[k]) <= 0.02 && std::fabs(delta) <= 0.03 &&
                          std::fabs((delta - before) / 0.1) <= 0.02;
        if (!good)
            continue;
        const double phi = v[k] / L;
        P += 1e-6;
        const double gain = P * phi / (0.5 + phi * phi * P);
        theta += gain * (r[k] - phi * delta - phi * theta);
        P *= 1.0 - gain * phi;
    }
    return -theta * ratio;
}

enum { STIFFNESS, RATIO, SLOW, FAST, U, V, YAW_RATE, ANGLE, ROLL, STATES };
constexpr double WANDER[STATES] = {5e-4, 0.01, 0.02 * DEGREE, 0.25 * DEGREE, 0.1, 0.01, 0.1 * DEGREE, 0.1 * DEGREE, DEGREE};

// Extended Kalman filter over the linear single-track model.
struct Paramsd {
    double x[STATES], P[STATES][STATES];

    void begin(double ratio, double speed) {
        *this = {};
        x[STIFFNESS] = 1.0, x[RATIO] = ratio, x[U] = speed;
        for (int k = 0; k < STATES; k++)
            P[k][k] = WANDER[k] * WANDER[k];
    }

    void predict(const double *body, double dt) {
        const double s = x[STIFFNESS], i = x[RATIO], u = x[U], v = x[V], r = x[YAW_RATE];
        const double d = (x[ANGLE] - x[SLOW] - x[FAST]) / i;
        const double by_v = -body[0] * v / u - body[1] * r / u + body[2] * d;
        const double by_r = -body[3] * v / u - body[4] * r / u + body[5] * d;
        const double F[2][STATES] = {
            {by_v, -s * body[2] * d / i, -s * body[2] / i, -s * body[2] / i,
             s * (body[0] * v + body[1] * r) / (u * u) - r, -s * body[0] / u, -s * body[1] / u - u, s * body[2] / i,
             -GRAVITY},
            {by_r, -s * body[5] * d / i, -s * body[5] / i, -s * body[5] / i,
             s * (body[3] * v + body[4] * r) / (u * u), -s * body[3] / u, -s * body[4] / u, s * body[5] / i, 0.0},
        };
        x[V] += dt * (s * by_v - u * r - GRAVITY * x[ROLL]);
        x[YAW_RATE] += dt * s * by_r;
        double moved[2][STATES] = {};
        for (int row = 0; row < 2; row++)
            for (int k = 0; k < STATES; k++)
                for (int column = 0; column < STATES; column++)
                    moved[row][column] += F[row][k] * P[k][column];
        for (int column = 0; column < STATES; column++) {
            P[V][column] += dt * moved[0][column];
            P[YAW_RATE][column] += dt * moved[1][column];
        }
        for (int row = 0; row < 2; row++)
            for (int column = 0; column < STATES; column++) {
                double sum = 0.0;
                for (int k = 0; k < STATES; k++)
                    sum += F[row][k] * P[column][k];
                moved[row][column] = sum;
            }
        for (int column = 0; column < STATES; column++) {
            P[column][V] += dt * moved[0][column];
            P[column][YAW_RATE] += dt * moved[1][column];
        }
        for (int k = 0; k < STATES; k++)
            P[k][k] += dt * WANDER[k] * WANDER[k];
    }

    void observe(int which, double observed, double sd) {
        const double spread = P[which][which] + sd * sd, innovation = observed - x[which];
        double gain[STATES], row[STATES];
        for (int k = 0; k < STATES; k++) {
            gain[k] = P[k][which] / spread;
            row[k] = P[which][k];
        }
        for (int k = 0; k < STATES; k++) {
            x[k] += gain[k] * innovation;
            for (int j = 0; j < STATES; j++)
                P[k][j] -= gain[k] * row[j];
        }
    }

    bool is_lost() const {
        double sum = 0.0;  // not finite where one of them is not
        for (int k = 0; k < STATES; k++) {
            sum += 0.0 * x[k];
            for (int j = 0; j < STATES; j++)
                sum += 0.0 * P[k][j];
        }
        return !(sum == 0.0) || x[U] <= 0.0;
    }
};

double openpilot(std::size_t count, const double *angle, const double *r, const double *v, const double *a_y,
                 const double *body, double ratio) {
    Paramsd filter = {};
    bool begun = false;
    for (std::size_t k = 0; k < count; k++) {
        if (!(v[k] > 1.0 && std::fabs(angle[k]) < 45.0 * DEGREE))
            continue;
        if (!begun)
            filter.begin(ratio, v[k]);
        filter.predict(body, 0.01);
        filter.observe(ANGLE, angle[k], 0.05 * DEGREE);
        filter.observe(U, v[k], 0.1);
        if (k % 5 == 0) {
            const double roll = (a_y[k] - r[k] * v[k]) / GRAVITY;
            if (!std::isnan(r[k]))
                filter.observe(YAW_RATE, r[k], 0.1 * DEGREE);
            if (!std::isnan(roll))
                filter.observe(ROLL, roll, DEGREE);
            filter.observe(FAST, 0.0, 10.0 * DEGREE);
        }
        begun = !filter.is_lost();
    }
    return begun ? filter.x[SLOW] : NAN;
}

}  // namespace

// Offsets at the steering wheel after the last tick, rad.
extern "C" double autoware_offset(std::size_t count, const double *wheel, const double *r, const double *v, double L,
                                  double ratio) {
    return autoware(count, wheel, r, v, L, ratio);
}

extern "C" double openpilot_offset(std::size_t count, const double *angle, const double *r, const double *v,
                                   const double *a_y, const double *body, double ratio) {
    return openpilot(count, angle, r, v, a_y, body, ratio);
}

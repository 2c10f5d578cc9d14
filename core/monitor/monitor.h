#ifndef OC_MONITOR_H
#define OC_MONITOR_H
/* Figure 15 as one function, and the interface for firmware and Python. This is its manual.
 *
 * Result. The offset is the reading of the steering wheel angle sensor without lateral force, in the middle of the free
 * play: true angle = measured angle - offset. Use it only while its status is OC_VALID; +-1.96 standard deviations are
 * a 95 % interval. The angle in the output needs no sensor; use it while its status is OC_VALID or OC_CONVERGING.
 *
 * Signs and units. SI and rad, at every interface. ISO 8855: a left turn is positive for angle, offset, yaw rate,
 * lateral acceleration and torque; speed is positive forward. The accelerometer measures specific force: at rest on a
 * road that falls to the right it reads positive. signals.h and vehicle.h have the unit and range of each member,
 * params.h those of each parameter. A signal beyond the range of any road vehicle counts as missing.
 *
 * Memory. The caller owns all structs; the core has no globals and no heap. Coefficients follow from vehicle, params
 * and rate, and are constant. State is plain data that may be copied, compared and saved (save.h): tracking (filters
 * and pending blocks, lost at ignition), evidence (kept) and learned (the estimates).
 *
 * Order of calls.
 *   1. oc_params_defaults; then change what the truck needs: known play, axle layout, ...
 *   2. oc_setup, at power-up and after a change of vehicle, params or rate. If it fails, ticks are refused.
 *   3. oc_init, or oc_restore of save.h, once. Where the vehicle has changed, what was learned is of another one: init.
 *   4. oc_restart at each ignition, if the state has been restored or was kept in RAM.
 *   5. oc_step at each tick, at the rate of oc_setup, also while signals are missing or the truck stands.
 *   6. oc_answer_get at any time: everything about all ticks. It changes nothing.
 *
 * Time. `time` of a tick is in seconds, from any zero, and increases by 1 / rate_hz; jitter is harmless. Pass the time
 * at which the signals were received, so that lost ticks are visible. A tick whose time does not increase is rejected,
 * OC_REASON_TIME. So are all ticks while a second of them, without its longest hole, takes more than 1.5 or less than 1
 * / 1.5 s: another rate than in oc_setup, or a time in ms. After a correct second this needs eleven wrong ones in
 * succession.
 *
 * ABI. Compile core and callers with the same options: the size of an enum (-fshort-enums, usual on ARM) and the
 * alignment of a double change the structs. So may each version. Images of save.h are the same bytes everywhere.
 *
 * Tasks. Calls for one state must not interrupt each other: make them in one task, or lock the state. Calls for two
 * states may run at once, also with the same coefficients. The README has time, stack and memory.
 *
 * Errors. oc_setup, oc_step and oc_answer_get return OC_OK, or an error for a NULL, for coefficients without a
 * successful oc_setup and for a state without oc_init; output or answer are zero then, which is unobservable. The
 * output of oc_step may be NULL. Functions that return a name return "unknown", or NULL where it says so. All other
 * pointers must be valid.
 *
 * Checked in each tick, with a named reason or fault: missing and implausible signals, time, rate, gaps; signals that
 * contradict the others (signal_fault: stuck, filled, clipped, noise, sign, scale, lag), and faults of the angle sensor
 * (fault). The offset is OC_INVALID during a fault.
 *
 * Not checked: wheelbase, steering ratio and traffic side of another truck, within their ranges; wheel speeds of
 * another axle; a signal that is wrong by a few percent; an angle from which the sender has subtracted an offset.
 * `oncenter offset` on a recorded drive judges the whole log and names these, as far as they show. */

#include "angle.h"
#include "assignment.h"
#include "clock.h"
#include "estimate.h"
#include "gyro_bias.h"
#include "joint.h"
#include "motion.h"
#include "offset.h"
#include "params.h"
#include "preprocess.h"
#include "sensor_fault.h"
#include "signals.h"
#include "smooth.h"
#include "speed_floor.h"
#include "standstill.h"
#include "status_watch.h"
#include "torque.h"
#include "trig.h"
#include "understeer.h"
#include "vehicle.h"
#include "wheel_speed.h"

/* The version is defined here only. */
enum { OC_VERSION_MAJOR = 0, OC_VERSION_MINOR = 2, OC_VERSION_PATCH = 0 };

typedef enum {
    OC_OK = 0,
    OC_ERROR_VEHICLE, /* oc_vehicle_check names the member; NULL: the method needs a track width */
    OC_ERROR_PARAMS,  /* oc_params_check names the parameter */
    OC_ERROR_RATE,    /* not 20 to 200 Hz, or cutoff_hz is 0.45 of it or more */
    OC_ERROR_NULL,    /* a pointer is NULL */
    OC_ERROR_SETUP,   /* the coefficients are not of a successful oc_setup */
    OC_ERROR_STATE,   /* the state is not of oc_init, or its restoring is not complete */
    OC_ERROR_COUNT
} oc_error;

typedef struct {
    oc_vehicle vehicle;
    oc_params params;
    oc_preprocess preprocess;
    oc_assignment_design assignment;
    oc_gyro_bias_design gyro_bias;
    oc_joint_design joint;
    oc_torque_design torque;
    oc_angle_design angle;
    double rate_hz, tick_s;
    double ratio_times_wheelbase; /* m, i*L */
    double ratio_times_rear_weight; /* steering wheel angle per angle of a steered rear axle; 0: none is steered */
    double ticks_per_batch;
    int32_t steered;              /* valid bits of the angle by which the truck turns */
    int32_t needed;               /* valid bits of all signals of the method */
    int32_t observed;             /* the same of the angle method; the mean bank replaces a missing accelerometer */
    int32_t wheel_axle;           /* axle whose wheel speeds give the motion: the rear one if its track is given */
    double offset_per_mismatch;   /* rad of residual per r_l/r_r - 1 of that axle, i*L/track */
    int32_t ticks_per_block, blocks_until_final;
    int32_t ticks_until_new_clock; /* successive rejected ticks until the clock counts as set back */
    int32_t pieces_per_tick;      /* of deferred work */
} oc_coefficients;

typedef struct {
    oc_clock clock;
    int32_t has_complete;       /* a tick with all its signals has occurred */
    int32_t running;            /* the filters have a state; not at standstill */
    double last_complete;       /* s, of the last tick with all its signals */
    float braked_s;             /* s, until the truck and the filters swing out after an intervention */
    oc_status_watch statuses;
    oc_assignment assignment;
    oc_preprocess_state preprocess;
    oc_pending straight;        /* for the offset */
    oc_pending cornering;       /* for the understeer gradient */
    oc_joint_tracking joint;
    oc_angle_tracking angle;
    oc_fault_watch fault;
} oc_tracking;

/* Memory of the last answers, in addition to their statuses. */
typedef struct {
    float recent_offset;                /* rad, recent mean of the joint method's offset */
    int32_t offset_trusted;             /* has been accurate enough to learn K_us */
} oc_verdicts;

typedef struct {
    oc_offset offset;
    oc_understeer understeer;
    oc_standstill standstill;
    oc_speed_floor speed_floor;
    oc_gyro_bias gyro_bias;
    oc_wheel_speed wheel_speed;
    oc_joint joint;
    oc_torque torque;
    oc_angle_evidence angle;
    oc_fault_evidence fault;
    oc_verdicts verdicts;
    uint64_t ticks;              /* all ticks that advanced the clock */
    uint64_t rejected[OC_REASON_COUNT]; /* ticks by reason bit; a tick may have several */
    uint64_t unused_motion;      /* ticks with any reason but a window and time */
    double bank_ticks, bank_sum; /* m/s^2, sum of (33) above the minimum speed, whatever the other reasons */
    oc_bank_watch bank_watch;    /* the same, by minutes */
} oc_evidence;

/* The current estimates. */
typedef struct {
    oc_estimate offset;                 /* rad */
    oc_estimate understeer_gradient;    /* rad/(m/s^2), K_us/g at the road wheel */
    oc_estimate backlash;               /* rad, full width, wind-up of the column included; joint method */
    oc_estimate unloading_acceleration; /* m/s^2, neutral lateral acceleration, as measured; joint method */
    oc_estimate equivalent_wheelbase;   /* m, of (10); an error of the ratio counts as one of the wheelbase */
    oc_offset_parts parts;              /* of the offset's uncertainty */
    oc_angle_truck truck;               /* for the angle without its sensor */
} oc_learned;

enum { OC_LEARNED_ESTIMATES = 5 };

enum { OC_RATE_MIN_HZ = 20, OC_RATE_MAX_HZ = 200 }; /* of ticks */

enum { OC_STATE_READY = 0x0C57A7E };

typedef struct {
    oc_tracking tracking;
    oc_evidence evidence;
    oc_learned learned; /* follows from evidence at each final block */
    int32_t ready;      /* OC_STATE_READY by oc_init; another value refuses ticks */
} oc_state;

/* The covariances of the offset with other estimates of a drive, to combine several drives. */
typedef struct {
    double understeer_gradient;    /* rad^2/(m/s^2) */
    double unloading_acceleration; /* rad m/s^2 */
    double backlash;               /* rad^2 */
} oc_offset_covariances;

/* One tick's output. The motion is one filter delay old. */
typedef struct {
    double time;                 /* s, of the last accepted tick */
    double vehicle_speed;        /* m/s */
    oc_motion motion;
    uint32_t reasons;            /* oc_reason, 0: clean */
    float offset_lean;           /* rad, see oc_estimate */
    oc_status offset_status;     /* invalid: the sensor is at fault (`fault`); unobservable: also a combined one */
    double offset;               /* rad, final evidence only */
    double offset_sd;            /* rad, about the offset, all parts together */
    oc_offset_parts offset_parts; /* of its uncertainty */
    double understeer_gradient;  /* rad/(m/s^2), 0 until learned */
    double backlash;             /* rad, 0 until learned */
    double place;                /* in the play: 1 left flank, -1 right flank; 0 until learned */
    double unloading_acceleration; /* m/s^2, neutral lateral acceleration, as measured; without play its prior */
    double evidence;             /* s of driving in the offset */
    double yaw_rate_bias;        /* rad/s, by wheels and standstill */
    double yaw_rate_bias_sd;     /* rad/s */
    oc_angle angle;              /* now; angle.delay: how late an estimate is */
    oc_fault fault;              /* of the steering wheel angle sensor */
    double fault_since;          /* s */
    double fault_confidence;     /* lower bound of its probability, 0 to 1 */
    oc_signal_fault signal_fault; /* of a signal as its source sends it; the offset is invalid then */
    int32_t signals_at_fault;    /* oc_signal_bit */
} oc_output;

typedef struct {
    /* rad; where a rear axle steers and its zero is not given: of both axles' sensors together */
    oc_estimate offset;
    oc_offset_parts offset_parts;          /* of its uncertainty */
    oc_offset_covariances offset_covariances; /* of the drive's part; joint method */
    double offset_temporary;               /* rad, pending blocks included */
    double offset_variance_if_independent; /* rad^2, (43) */
    oc_estimate understeer_gradient;       /* rad/(m/s^2) */
    oc_estimate backlash;                  /* rad, full width */
    oc_estimate unloading_acceleration;    /* m/s^2, neutral lateral acceleration, as measured */
    oc_estimate equivalent_wheelbase;      /* m; unobservable: the vehicle file's */
    oc_fault fault;                        /* of the angle sensor; during a fault the offset is invalid */
    oc_signal_fault signal_fault;          /* of a signal as its source sends it; the offset is invalid then */
    int32_t signals_at_fault;              /* oc_signal_bit */
    double signal_fault_value;             /* number in gaps, s of lag or at one value, factor, size of a jump */
    int32_t changes;                       /* found in the drive; the last OC_CHANGES_MAX are in */
    oc_changed changed[OC_CHANGES_MAX];    /* the k-th at k modulo OC_CHANGES_MAX */
    oc_estimate yaw_rate_bias;             /* rad/s, now; without wheel speeds, by standstill */
    double yaw_rate_bias_wheel_time;       /* s of wheel speeds in it; 0: standstill alone */
    double yaw_rate_bias_alarm_time;       /* s during which it changed faster than the filter follows */
    oc_estimate wheel_radius_mismatch_rear, wheel_radius_mismatch_front; /* r_l/r_r - 1 */
    double leaked_rear, leaked_front;      /* change of r_l/r_r in this drive by a tyre that loses air; 0: none */
    oc_estimate standstill_lateral_acceleration; /* m/s^2: bias plus slope of the ground */
    double loaded_left_s, loaded_right_s;     /* s of lateral force that loaded a flank; joint method */
    double lacking_to_left, lacking_to_right; /* s of lateral force that the flanks still need; joint method */
    double unexplained;                       /* rad, sd of the prediction error of a second's mean; joint method */
    double yaw_rate_noise;                    /* rad/s, sd of a second's mean; joint method */
    double steered_s, steered_since_s, steered_by; /* s, s of used driving, rad: something seems to steer; 0: nothing */
    double offset_per_yaw_rate_bias; /* s: rad of offset per rad/s, mean of i*L/v, (48); joint method: i*L/mean(v) */
    double bank_mean;                      /* m/s^2, above the minimum speed */
    double traffic_side;                   /* the vehicle's; 0 also where the banked bends show that it is wrong */
    double bank_time;                      /* s in it */
    double bank_low, bank_high;            /* m/s^2, minimum and maximum of its minutes; 0: less than one minute */
    int32_t accelerometer_wanders;         /* the joint method models its zero as a random walk */
    int32_t offset_walks;                  /* the joint method models the offset as a random walk: the sensor slips */
    int32_t accelerometer_runs_away;       /* minutes differ by more than roads bank: its zero drifts */
    double duration, used, unused;         /* s; duration = used + unused */
    double rejected[OC_REASON_COUNT];      /* s by reason bit; window includes pending ticks */
} oc_answer;

const char *oc_version(void);
const char *oc_error_name(oc_error error);
const char *oc_reason_name(oc_reason reason); /* NULL when it is none */
const char *oc_status_name(oc_status status);
const char *oc_method_name(oc_method method);
const char *oc_angle_method_name(oc_angle_method method);

/* Name of the first member out of its range, or NULL. */
const char *oc_vehicle_check(const oc_vehicle *vehicle);

/* rate_hz: of the ticks, OC_RATE_MIN_HZ to OC_RATE_MAX_HZ. The wheel speeds' method needs a track width, the angle by
 * front wheel speeds the front's. */
oc_error oc_setup(oc_coefficients *coefficients, const oc_vehicle *vehicle, const oc_params *params, double rate_hz);

/* Nothing is learned. */
void oc_init(oc_state *state);

/* Ignition, or the next log: tracking is lost, time may start at any value. Evidence stays, less certain by what may
 * change while the ignition is off (between_drives.h). elapsed_s: that time; 0 or negative: unknown. */
void oc_restart(oc_state *state, double elapsed_s);

/* One tick. `output`: of this tick, or NULL. */
oc_error oc_step(oc_state *state, const oc_coefficients *coefficients, const oc_signals *tick, oc_output *output);

/* One step per row; `outputs` has as many rows, or is NULL. For whole logs: does not check its call. */
void oc_run(oc_state *state, const oc_coefficients *coefficients, const oc_columns *columns, oc_output *outputs);

/* About all ticks so far. */
oc_error oc_answer_get(const oc_state *state, const oc_coefficients *coefficients, oc_answer *answer);

/* The answer that other priors give on the same evidence: the joint method's equations of a copied state, solved anew
 * by the priors of these coefficients. */
oc_error oc_answer_by_priors(oc_state *copy, const oc_coefficients *coefficients, oc_answer *answer);

#endif

#ifndef OC_JOINT_H
#define OC_JOINT_H
/* Offset, understeer gradient, play and neutral lateral acceleration, estimated together by a hypothesis set. Each
 * hypothesis starts from another play and estimates all four. Its weight follows from its prediction errors.
 *
 * About every tenth tick is a sample, and a second has about ten samples. In the next second the hypotheses process
 * them piece by piece, so that the load of the ticks is even. A hypothesis adds a second to its evidence; in the next
 * piece it solves its equations; in the one after, which is the first of the next hypothesis, it moves toward the
 * solution and adds the rest of the samples. The last piece ends the round. Corrections apply to all hypotheses between
 * two rounds (docs/method.md, "Rounds"). */

#include <stdbool.h>
#include <stdint.h>

#include "change.h"
#include "estimate.h"
#include "hypothesis.h"

enum {
    OC_JOINT_HYPOTHESES = 12,
    OC_JOINT_LATER_STARTS = 2 * OC_JOINT_HYPOTHESES,
    OC_JOINT_SAMPLES = 12,  /* maximum in a second, reached at 24 Hz */
    OC_JOINT_SECONDS_PER_SOLVING = 4, /* even, and a divisor of OC_SECONDS_PER_LONG_BLOCK */
    OC_CHANGES_MAX = 6
};

/* A change found during a drive. */
typedef struct {
    double time;                    /* s */
    double before, before_sd;       /* rad, the offset before it */
    oc_change change;
} oc_changed;

/* The motion at one tick, filtered, the yaw rate corrected. */
typedef struct {
    double angle;                /* rad, as measured */
    double rear_part;            /* rad, of the angle: i*w times the rear axle's angle */
    double residual;             /* rad, angle less rear_part and i*L*r/v */
    double yaw_rate;             /* rad/s */
    double lateral_acceleration; /* m/s^2, as measured */
    float raw[OC_NOISY];         /* m/s^2 and rad/s, not filtered */
    double curvature;            /* 1/m */
    double speed;                /* m/s */
    int32_t axle;                /* that resists turning, by its status: 1 down, -1 lifted, 0 unknown */
    bool usable;                 /* the gate is open */
    bool suspected;              /* the angle sensor may be at fault: predicted, not learned from */
} oc_joint_tick;

typedef struct {
    oc_hypothesis_design hypothesis;
    oc_noise_design noise;
    double tick_s;
    double bank_share;           /* weight of a new tick in the smoothed bank */
    float alignment_share, wind_share; /* shares of pull_sd^2; the rest is an unmeasured bank */
    float tyre_share;            /* share of r*v that the tyres carry, in addition to the measured bank */
    float bank_unmeasured;       /* 1: no accelerometer measures the bank; else 0 */
    float unmeasured_bank;       /* m/s^2, by which such a bank may reduce the lateral force; else 0 */
    float tandem;                /* m^2/s^2, c of docs/method.md (axles that resist turning), with all axles down */
    float memory_s;              /* maximum time constant of forgetting */
    int32_t ticks_per_sample, samples_per_second;
} oc_joint_design;

/* The samples of one second of the clock. A second of evidence is as many consecutive usable ones, from any one on. */
typedef struct {
    oc_motion_sample samples[OC_JOINT_SAMPLES];
    int32_t count;
    int32_t suspected;           /* the sensor, in the second of evidence that ends among them */
    float curvature;             /* 1/m, mean of that second */
} oc_collected;

/* Lost at ignition, and after a hole. At standstill the hypotheses complete their round. */
typedef struct {
    int32_t running;
    int32_t in_second;           /* consecutive usable samples in the growing second of evidence */
    int32_t suspected;           /* the sensor, at one of these samples */
    double yaw_rate;             /* rad/s, of the last sample */
    double lateral_acceleration; /* m/s^2, on the tyres, of the last sample */
    double bank;                 /* m/s^2, a_y - r*v, smoothed */
    double load_bank;            /* the same, the longer the noisier it is: of the play's load */
    float curvature_sum;         /* 1/m, of the samples in the second */
    float turned;                /* rad, change of the heading since the last sample */
    float articulation;          /* rad, of a trailer of the usual length */
    float fifth_wheel;           /* state of its friction, -1 to 1 */
    oc_noise_watch noise;
    oc_prior prior;              /* of this round */
    oc_collected filling;        /* the second being collected */
    oc_collected collected;      /* the previous second, for the hypotheses */
    int32_t due;                 /* pieces of deferred work, the one that ends the round among them; 0: no round */
    int32_t next;                /* first sample that the present hypothesis processes after its solution */
    int32_t learned;             /* the present hypothesis learned from a second of evidence */
    int32_t loads_rare_flank;    /* the collected samples load a flank that was seldom loaded */
    int32_t solves_all;          /* all hypotheses solve in this round, even without new evidence */
    float min_error;             /* rad, minimum prediction error of the second of evidence */
    float wound, inner;          /* rad, the best hypothesis's operators at the last sample */
    oc_equations equations;      /* of the present hypothesis; here to save stack */
} oc_joint_tracking;

typedef struct {
    int32_t started;
    int32_t count;               /* active hypotheses, the first ones of the array */
    int32_t best;                /* index of the best hypothesis */
    int32_t next_start;          /* index of the next start */
    int32_t phase;               /* ticks since the last sample was due */
    int32_t in_block, in_long_block;
    int32_t lost;                /* place in the play and heading are unknown */
    int32_t solves_all;          /* after a correction: all hypotheses solve in the next round */
    int32_t axle;                /* of the last tick */
    int32_t ignitions;           /* since the last tick */
    int32_t alarmed;             /* a change was suspected for long: the offset may walk */
    int32_t changes;             /* number found; the last OC_CHANGES_MAX are kept */
    oc_second second;            /* context of the next whole second */
    float off_s;                 /* ignition off since the last tick */
    float along, across;         /* cosine and sine of the heading, from when it was last lost */
    float loaded_left_s, loaded_right_s; /* s of lateral force beyond friction, on either side of a_0 */
    float checked_s;             /* s of settled evidence after forgetting, of which: */
    float outlying_s;            /* s that are far above the prediction, less those far below */
    float outlying_sum;          /* rad s, their errors */
    float outlying_width;        /* rad, of the play by which they are counted */
    float outlying_since_s;      /* s of used driving before the first of them */
    oc_change_watch watch;
    double speed_mean;              /* m/s, over all usable samples */
    double bank_mean, bank_samples; /* m/s^2, a_y - r*v, over the same samples */
    double crown_bank, crown_samples; /* the same, of those on straights */
    float removed[2], removed_samples[2]; /* m/s^2, crown_bank less those in bends to the left and to the right */
    oc_changed changed[OC_CHANGES_MAX];
    oc_hypothesis hypotheses[OC_JOINT_HYPOTHESES];
} oc_joint;

typedef struct {
    float value, sd;
} oc_found;

typedef struct {
    oc_found of[OC_OF_COUNT]; /* offset, play's width: rad, gradient: rad/(m/s^2), unloading: m/s^2, wheelbase: l */
    oc_offset_parts parts;    /* of the offset's uncertainty */
    float offset_covariance[OC_OF_OFFSET]; /* of the offset's drive part with the other quantities */
    float lean;               /* rad, middle of the offset's interval less the offset */
    float used;               /* s of driving */
} oc_joint_answer;

/* lowpass: of the signals. pull_sd: m/s^2, sd of all shifts of a_0: wheel alignment, mean wind, an unmeasured bank.
 * measures_bank: an accelerometer measures the bank. memory_s: maximum time constant of forgetting. */
void oc_joint_setup(oc_joint_design *design, const oc_lowpass *lowpass, double rate_hz, double steering_ratio,
                    double ratio_times_wheelbase, float pull_sd, bool measures_bank, double memory_s);

/* A hole: place in the play and heading are unknown. The next round makes the corrections of an interrupted one. */
void oc_joint_restart(oc_joint *joint, oc_joint_tracking *tracking);

/* Ignition after `off_s` seconds, 0 or less where unknown: the same, and from the next tick on the truck may have
 * changed. */
void oc_joint_ignition(oc_joint *joint, oc_joint_tracking *tracking, float off_s);

/* The next tick. After ignition, hole or standstill `running` is 0; after ignition or hole `lost` is set, too. True
 * when a second is collected: then begin a round. */
bool oc_joint_collect(oc_joint *joint, oc_joint_tracking *tracking, const oc_joint_design *design,
                      const oc_joint_tick *tick);

/* Standstill: no samples. True where a correction needs a round without samples. */
bool oc_joint_standstill(oc_joint *joint, oc_joint_tracking *tracking, const oc_joint_design *design);

/* Begins a round on the collected samples, with the present priors. */
void oc_joint_begin_round(oc_joint *joint, oc_joint_tracking *tracking, const oc_joint_design *design,
                          const oc_prior *prior);

/* One piece of the round that is due, between two ticks. True when it ends a round that had evidence or a correction.
 * `last_offset`: the published offset; `time`: s, of the last tick. */
bool oc_joint_work(oc_joint *joint, oc_joint_tracking *tracking, const oc_joint_design *design,
                   const oc_estimate *last_offset, double time);

/* Corrects the evidence of all hypotheses where the mean yaw rate so far was corrected by `rad_s` too little. They
 * solve in the next round. False where the correction is negligible or a round is active. has_banks: corrects the
 * measured banks, too. */
bool oc_joint_correct(oc_joint *joint, const oc_joint_tracking *tracking, const oc_joint_design *design, float rad_s,
                      bool has_banks);

/* Lets all hypotheses learn gradient and wheelbase anew, near the last ones. */
void oc_joint_change_load(oc_joint *joint);

/* Records the change with the offset before it, and adapts all hypotheses to it. */
void oc_joint_note_change(oc_joint *joint, const oc_change *change, const oc_estimate *before, double time);

/* Whether the best hypothesis models the accelerometer's zero as a random walk. */
bool oc_joint_wanders(const oc_joint *joint);

/* Whether the best hypothesis models the offset as a random walk. */
bool oc_joint_walks(const oc_joint *joint);

/* m^2/s^2, c of the axles that resist turning: by the status of the tag axle, or smaller where a short wheelbase shows
 * that it is up. */
float oc_joint_tandem(const oc_joint *joint, const oc_joint_design *design);

/* s, time constant of forgetting: short at first, since early slopes were linearised far from the solution. */
float oc_joint_memory(const oc_joint *joint, const oc_joint_design *design);

/* s of lateral force until a flank of the play counts as loaded; side: 1 left, -1 right. 0 where play was identified
 * and the flank was loaded for a moment. */
double oc_joint_flank_lacking(const oc_joint *joint, const oc_joint_design *design, int32_t side);

/* rad, mean error of the seconds far from the prediction, where so many are on one side that something seems to steer:
 * of the play, one flank then stays loaded for minutes. Else 0. */
float oc_joint_steered_by(const oc_joint *joint);

/* s, load on a flank that is sure: an error there is no play. */
float oc_joint_sure_flank_s(void);

/* Whether a_0 is far from its prior while one flank was loaded for a shorter time. */
bool oc_joint_is_implausible(const oc_joint *joint);

/* Place in the play at the last sample, by the best hypothesis: 1 on the left flank, -1 on the right. */
double oc_joint_place(const oc_joint *joint, const oc_joint_tracking *tracking);

/* The weighted mean over the hypotheses, and its standard deviation. */
void oc_joint_answer_get(oc_joint_answer *answer, const oc_joint *joint, const oc_joint_design *design);

#endif

#ifndef OC_JOINT_H
#define OC_JOINT_H
/* Offset, understeer gradient, play and neutral lateral acceleration, estimated together by a hypothesis set. Each
 * hypothesis starts elsewhere and estimates all of them; its weight follows from its prediction errors.
 *
 * About every tenth tick is a sample, and about ten samples are collected. Then the hypotheses take turns, two ticks
 * each, so that the load is even: each takes in all these samples, and then solves its equations. Corrections reach
 * all hypotheses at once, between two such rounds (docs/method.md, "Rounds"). */

#include <stdbool.h>
#include <stdint.h>

#include "change.h"
#include "estimate.h"
#include "hypothesis.h"

enum {
    OC_JOINT_HYPOTHESES = 12,
    OC_JOINT_LATER_STARTS = 2 * OC_JOINT_HYPOTHESES,
    OC_JOINT_SAMPLES = 12,  /* of a second at most, which it is at 24 Hz */
    OC_JOINT_SECONDS_PER_SOLVING = 4, /* even, and a divisor of OC_SECONDS_PER_LONG_BLOCK */
    OC_CHANGES_MAX = 6
};

/* A change in a drive. */
typedef struct {
    double time;                    /* s */
    double before, before_sd;       /* rad, the offset until then */
    oc_change change;
} oc_changed;

/* The motion at one tick, filtered, the yaw rate corrected. */
typedef struct {
    double angle;                /* rad, as measured */
    double residual;             /* rad, angle less i*L*r/v */
    double yaw_rate;             /* rad/s */
    double lateral_acceleration; /* m/s^2, as measured */
    float raw[OC_NOISY];         /* m/s^2 and rad/s, not filtered */
    double curvature;            /* 1/m */
    double speed;                /* m/s */
    bool usable;                 /* the gate is open */
    bool doubted;                /* the angle's sensor may be at fault: predicted, not learned from */
} oc_joint_tick;

typedef struct {
    oc_hypothesis_design hypothesis;
    oc_noise_design noise;
    double tick_s;
    double bank_share;           /* of a new tick in the smoothed bank */
    float alignment_share, wind_share; /* of pull_sd^2; the rest is an unmeasured bank */
    float borne;                 /* the tyres' share of r*v, beside the measured bank */
    float unseen;                /* 1: no accelerometer measures the bank; else 0 */
    float tandem;                /* m^2/s^2, c of docs/method.md's axles that resist turning, all axles down */
    float memory_s;              /* maximum time constant of forgetting */
    int32_t ticks_per_sample, samples_per_second;
    int32_t solves_at_once;      /* 1: a hypothesis takes in and solves in one tick, since a second has few */
} oc_joint_design;

/* The samples of one second by the clock. A second of evidence is as many usable ones in a row, wherever they begin. */
typedef struct {
    oc_motion_sample samples[OC_JOINT_SAMPLES];
    int32_t count;
    int32_t doubted;             /* the sensor is, in the second of evidence that ends among them */
    float curvature;             /* 1/m, mean of that second */
} oc_collected;

/* Lost at ignition, and after a hole. While the truck stands the hypotheses end their round. */
typedef struct {
    int32_t running;
    int32_t in_second;           /* usable samples in a row, of the second of evidence that fills */
    int32_t doubted;             /* one of these is */
    double yaw_rate;             /* rad/s, of the last sample */
    double lateral_acceleration; /* m/s^2, on the tyres, of the last sample */
    double bank;                 /* m/s^2, a_y - r*v smoothed */
    float curvature_sum;         /* 1/m, of the samples in the second */
    float turned;                /* rad, since the last sample */
    float articulation;          /* rad, of a trailer of the usual length */
    float fifth_wheel;           /* place in its friction, -1 to 1 */
    oc_noise_watch noise;
    oc_prior prior;              /* of this round */
    oc_collected filling;        /* the second being collected */
    oc_collected taken;          /* the one before, for the hypotheses */
    int32_t turns;               /* left in the round: two of each hypothesis, and one to end it; 0: none */
    int32_t next;                /* sample that the hypothesis in turn takes in after it solved */
    int32_t learned;             /* it learned from a second of evidence */
    int32_t unfamiliar;          /* the taken samples load a flank that was seldom loaded */
    int32_t solves_all;          /* each solves its equations in this round, learning or not */
    float min_error;             /* rad, minimum prediction error of the second of evidence */
    float wound, inner;          /* rad, where the best hypothesis's operators are at the last sample */
    oc_equations equations;      /* of the hypothesis in turn; here to save stack */
} oc_joint_tracking;

typedef struct {
    int32_t started;
    int32_t count;               /* active hypotheses, the first so many */
    int32_t best;                /* hypothesis */
    int32_t next_start;          /* index of the next start */
    int32_t phase;               /* ticks since a sample was due */
    int32_t in_block, in_long_block;
    int32_t lost;                /* wheel and heading are unknown */
    int32_t solves_all;          /* after a correction: each solves in the next round */
    int32_t changes;             /* found; the last of them are kept */
    oc_second second;            /* of the next whole second */
    float along, across;         /* cosine and sine of the heading since it was lost */
    float to_left, to_right;     /* s of lateral force beyond friction on either side of a_0 */
    oc_change_watch watch;
    double speed_mean;              /* m/s, over all usable samples */
    double bank_mean, bank_samples; /* m/s^2, a_y - r*v over the same */
    oc_changed changed[OC_CHANGES_MAX];
    oc_hypothesis hypotheses[OC_JOINT_HYPOTHESES];
} oc_joint;

typedef struct {
    float value, sd;
} oc_found;

typedef struct {
    oc_found of[OC_OF_COUNT]; /* offset, play's width: rad, gradient: rad/(m/s^2), unloading: m/s^2, wheelbase: l */
    oc_offset_parts parts;    /* of the offset's uncertainty */
    float with_offset[OC_OF_OFFSET]; /* covariances of the offset, the drive's part, with the others */
    float lean;               /* rad, from the offset to the middle of its interval */
    float used;               /* s */
} oc_joint_answer;

/* lowpass: of the signals. pull_sd: m/s^2, of all that shifts a_0: wheel alignment, mean wind, an unmeasured bank.
 * sees_bank: an accelerometer measures the bank. memory_s: maximum time constant of forgetting. */
void oc_joint_setup(oc_joint_design *design, const oc_lowpass *lowpass, double rate_hz, double steering_ratio,
                    double ratio_times_wheelbase, float pull_sd, bool sees_bank, double memory_s);

/* Ignition: wheel and heading are unknown. The next round makes the corrections of a round that is cut short. */
void oc_joint_lose(oc_joint *joint, oc_joint_tracking *tracking);

/* The next tick. After an ignition, a hole or a standstill `running` is 0, and after the first two `lost` is set. True
 * when a second is collected: then begin a round. */
bool oc_joint_collect(oc_joint *joint, oc_joint_tracking *tracking, const oc_joint_design *design,
                      const oc_joint_tick *tick);

/* The truck stands: nothing is collected. True where a correction needs a round without samples. */
bool oc_joint_stand(oc_joint *joint, oc_joint_tracking *tracking, const oc_joint_design *design);

/* Begins a round on the collected samples, with the priors as of now. */
void oc_joint_begin_round(oc_joint *joint, oc_joint_tracking *tracking, const oc_joint_design *design,
                          const oc_prior *prior);

/* The next hypothesis takes its turn, if a round is active. True when that ended a round with evidence or a correction.
 * `last_offset` is the last answer, `time` (s) is now. */
bool oc_joint_take_turn(oc_joint *joint, oc_joint_tracking *tracking, const oc_joint_design *design,
                        const oc_estimate *last_offset, double time);

/* The yaw rates so far were corrected by rad/s too little, on average: corrects the evidence of all hypotheses, which
 * solve their equations in the next round. False where it is negligible, or while a round is active. Measured banks
 * (has_banks) are corrected, too. */
bool oc_joint_correct(oc_joint *joint, const oc_joint_tracking *tracking, const oc_joint_design *design, float rad_s,
                      bool has_banks);

/* Records the change with the offset before it, and adapts all hypotheses to it. */
void oc_joint_note_change(oc_joint *joint, const oc_change *change, const oc_estimate *before, double time);

/* Whether the best hypothesis believes that the accelerometer's zero wanders. */
bool oc_joint_wanders(const oc_joint *joint);

/* m^2/s^2, c of the axles that resist turning: less where the wheelbase shows that the tag axle is up. */
float oc_joint_tandem(const oc_joint *joint, const oc_joint_design *design);

/* s, time constant of forgetting: short at first, since early slopes were taken far from the solution. */
float oc_joint_memory(const oc_joint *joint, const oc_joint_design *design);

/* s of lateral force that the play's flank still needs, 1 left or -1 right, to count as loaded; 0 where it was loaded
 * at least for a moment and play was found. */
double oc_joint_flank_lacking(const oc_joint *joint, const oc_joint_design *design, int32_t side);

/* Whether the neutral acceleration is far from what the roads say, by few seconds on one of the flanks. */
bool oc_joint_is_doubtful(const oc_joint *joint);

/* Place in the play by the best hypothesis at the last sample: 1 on the left flank, -1 on the right. */
double oc_joint_place(const oc_joint *joint, const oc_joint_tracking *tracking);

/* The weighted mean over the hypotheses, and its spread. */
void oc_joint_answer_get(oc_joint_answer *answer, const oc_joint *joint, const oc_joint_design *design);

#endif

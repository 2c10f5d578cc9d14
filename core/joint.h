#ifndef OC_JOINT_H
#define OC_JOINT_H
/* Offset, understeer gradient, play and the side force at which the steering unloads, estimated together: a bank of
 * hypotheses that start apart, each of which learns them all; how well each foretold the measured angle is its weight.
 *
 * A tick in ten or so is a sample, and ten samples or so are collected. Then the hypotheses take turns, one a tick:
 * each takes all these samples in and solves its equations, so that no tick is a spike. What concerns all of them
 * happens to all at once, between two such rounds. */

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

/* What changed in a drive. */
typedef struct {
    double time;                    /* s, when */
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
    bool doubted;                /* the angle's sensor may be at fault: it is predicted and not learned from */
} oc_joint_tick;

typedef struct {
    oc_hypothesis_design hypothesis;
    oc_noise_design noise;
    double rate_hz, tick_s;
    double side_force_share;     /* of a new tick in the smoothed bank */
    float borne;                 /* share of r*v that the tyres bear, beside the bank that is seen */
    float unseen;                /* 1: no accelerometer tells the bank; 0 */
    float tandem;                /* m^2/s^2, side force on the front tyres by curvature, with all axles down */
    float memory_s;              /* how far back evidence reaches at most */
    int32_t ticks_per_sample, samples_per_second;
} oc_joint_design;

/* The samples of one second by the clock. A second of evidence is as many usable ones in a row, wherever they begin. */
typedef struct {
    oc_motion_sample samples[OC_JOINT_SAMPLES];
    int32_t count;
    float curvature;             /* 1/m, mean of the second of evidence that ends among them */
    int32_t doubted;             /* that second is */
} oc_collected;

/* Lost at ignition, and after a hole. While the truck stands the hypotheses end their round. */
typedef struct {
    int32_t running;
    int32_t in_second;           /* usable samples in a row, of the second of evidence that fills */
    float curvature_sum;         /* 1/m, of these */
    int32_t doubted;             /* one of these is */
    float turned;                /* rad, since the last sample */
    double yaw_rate;             /* rad/s, of the tick before, as is the acceleration: as neighbours both would be
                                  * loaded at once from a tick just stored, for which processors wait */
    double bank;                 /* m/s^2, a_y - r*v smoothed */
    double lateral_acceleration; /* m/s^2 */
    oc_noise_watch noise;
    oc_prior prior;              /* of this round */
    oc_collected filling;        /* the second that is collected, and */
    oc_collected taken;          /* the one before, which the hypotheses take in */
    int32_t turns;               /* that are left of the round: one of each hypothesis, and one to end it; 0: none */
    int32_t solves_all;          /* each solves its equations in this round, whether it learns or not */
    float min_error;           /* rad, of the second of evidence, by the hypothesis that predicted it best */
    float wound, inner;          /* rad, where the best hypothesis's operators are at the last sample */
    oc_equations equations;      /* of the hypothesis in turn; here, since firmware's stack is small */
} oc_joint_tracking;

typedef struct {
    int32_t started;
    int32_t count;               /* hypotheses that run, the first so many; the others were not needed */
    int32_t best;                /* hypothesis */
    int32_t next_start;                /* of the starts, which one is next */
    int32_t phase;               /* ticks since a sample was due */
    int32_t in_block, in_long_block;
    float along, across;         /* cosine and sine of the heading since it was lost */
    int32_t lost;                /* the wheel may be elsewhere, and the heading another */
    oc_second second;            /* what the next whole second will be */
    float to_left, to_right;     /* s during which the side force was clearly to either side of a_0 */
    int32_t solves_all;          /* something was corrected: each solves its equations in the next round */
    double speed_mean;           /* m/s, and */
    double bank_mean, bank_samples; /* m/s^2, a_y - r*v over all usable samples */
    oc_change_watch watch;
    int32_t changes;             /* seen; the last of them are kept */
    oc_changed changed[OC_CHANGES_MAX];
    oc_hypothesis hypotheses[OC_JOINT_HYPOTHESES];
} oc_joint;

typedef struct {
    float value, sd;
} oc_found;

typedef struct {
    oc_found of[OC_ASKED]; /* offset and play's width: rad, gradient: rad/(m/s^2), unloading: m/s^2; wheelbase: share by
                            * which the truck turns as if it were longer */
    float identified_sd;         /* rad, of the offset but for pull and wind, which no drive tells */
    float lean;            /* rad, from the offset to where it is expected with their share in a_0 */
    float used;            /* s */
} oc_joint_answer;

/* lowpass: through which the signals come. pull_sd: m/s^2, of wheel alignment and mean wind, which shift a_0, and
 * of the bank where it is not seen; sees_bank: an accelerometer does; memory_s: how far back evidence reaches. */
void oc_joint_setup(oc_joint_design *design, const oc_lowpass *lowpass, double rate_hz, double steering_ratio,
                    double ratio_times_wheelbase, float pull_sd, bool sees_bank, double memory_s);

/* Ignition: wheel and heading may be elsewhere. What a round that is cut short had to correct is left to the next. */
void oc_joint_lose(oc_joint *joint, oc_joint_tracking *tracking);

/* One tick later than the one before; after an ignition, a hole or a standstill `running` is 0, and after the first two
 * `lost` is set. True when a second is collected: a round is then to begin. */
bool oc_joint_collect(oc_joint *joint, oc_joint_tracking *tracking, const oc_joint_design *design,
                      const oc_joint_tick *tick);

/* The truck stands: nothing is collected. True where a correction asks for a round without samples. */
bool oc_joint_stand(oc_joint *joint, oc_joint_tracking *tracking, const oc_joint_design *design);

/* The hypotheses are to take in what was collected, with what is believed beforehand as of now. */
void oc_joint_begin_round(oc_joint *joint, oc_joint_tracking *tracking, const oc_prior *prior);

/* The next hypothesis takes its turn, if a round is going on. True when that ended a round from which something was
 * learned: `last_offset` (rad) is what was answered before, `time` (s) is now. */
bool oc_joint_take_turn(oc_joint *joint, oc_joint_tracking *tracking, const oc_joint_design *design,
                        const oc_estimate *last_offset, double time);

/* The yaw rates so far were corrected by rad/s too little, on average: all hypotheses correct what they gathered, and
 * solve their equations in the next round. False where that is not worth it, or while a round is going on. Banks that
 * an accelerometer measured move with them. */
bool oc_joint_correct(oc_joint *joint, const oc_joint_tracking *tracking, const oc_joint_design *design, float rad_s,
                      bool has_banks);

/* What the set says is put down as what it was until the change, and all hypotheses go on with the other. */
void oc_joint_note_change(oc_joint *joint, const oc_change *change, const oc_estimate *before, double time);

/* m^2/s^2, of side force on the front tyres by curvature: axles that resist turning, as many as seem to be down. */
float oc_joint_tandem(const oc_joint *joint, const oc_joint_design *design);

/* s, how far back its evidence reaches: not far at first, when it was gathered far from where the hypotheses went. */
float oc_joint_memory(const oc_joint *joint, const oc_joint_design *design);

/* s of side force clearly to one side, 1 left or -1 right, that are lacking before the play's flank there is seen; 0
 * where that flank was seen at least for a moment and play was found. */
double oc_joint_flank_lacking(const oc_joint *joint, const oc_joint_design *design, int32_t side);

/* Where in the play the best hypothesis has the last sample, from -1 to 1: 1 is the flank of a left turn. */
double oc_joint_place(const oc_joint *joint, const oc_joint_tracking *tracking);

/* The hypotheses' mean by their weights, and what that leaves open. */
void oc_joint_answer_get(oc_joint_answer *answer, const oc_joint *joint, const oc_joint_design *design);

#endif

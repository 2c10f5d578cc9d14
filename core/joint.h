#ifndef OC_JOINT_H
#define OC_JOINT_H
/* Offset, understeer gradient, play and the side force at which the steering unloads, estimated together: a bank of
 * hypotheses that start apart, each of which learns them all; how well each foretold the measured angle is its weight.
 *
 * A tick in ten or so is a sample. The hypotheses take it in a few at a time, so that no tick is a spike. */

#include <stdbool.h>
#include <stdint.h>

#include "change.h"
#include "estimate.h"
#include "hypothesis.h"

enum {
    OC_JOINT_HYPOTHESES = 12,
    OC_JOINT_LATER_STARTS = 2 * OC_JOINT_HYPOTHESES,
    OC_JOINT_WAITING = 10, /* samples that wait at most */
    OC_JOINT_STEP = 4,     /* samples that take a hypothesis as long as a step of its equations */
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
    double time;                 /* s */
    double angle;                /* rad, as measured */
    double residual;             /* rad, angle less i*L*r/v */
    double yaw_rate;             /* rad/s */
    double lateral_acceleration; /* m/s^2, as measured */
    float raw[OC_NOISY];         /* m/s^2 and rad/s, not filtered */
    double curvature;            /* 1/m */
    double speed;                /* m/s */
    const oc_estimate *told;     /* rad, the offset as last answered */
    bool usable;                 /* the gate is open */
    bool busy;                   /* with other work: the bank's waits */
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
    int32_t work_per_tick;       /* samples taken in by a hypothesis, or OC_JOINT_STEP for a step of its equations */
} oc_joint_design;

/* A sample that waits for the hypotheses to take it in. */
typedef struct {
    oc_motion_sample sample;
    int32_t begins_second, ends_second;
} oc_joint_waiting;

/* What the hypotheses are at: some samples, which each takes in; then, where these end a second, the equations of each.
 * Meanwhile more samples wait. */
typedef struct {
    int32_t samples;             /* of those that wait, the first so many; 0: all is done */
    int32_t turn, taken;         /* the hypothesis that takes them in, and how many it has */
    int32_t solved;              /* hypotheses */
    int32_t solves;              /* whether there are equations to solve */
    int32_t ended;               /* with something concluded, which is told a tick later */
    float least_error;           /* rad, of the second that ends: by the hypothesis that foretold it best */
    oc_solving solving;          /* of the hypothesis in turn */
} oc_joint_work;

/* Lost at ignition, and while the truck stands. */
typedef struct {
    int32_t running;
    int32_t in_second;           /* samples of the second that fills */
    int32_t stands;              /* the truck does */
    float turned;                /* rad, since the last sample */
    double yaw_rate;             /* rad/s, of the tick before, as is the acceleration: as neighbours both would be
                                  * loaded at once from a tick just stored, for which processors wait */
    double bank;                 /* m/s^2, a_y - r*v smoothed */
    double lateral_acceleration; /* m/s^2 */
    int32_t prior_due;           /* before equations are solved, and at the first tick: whoever updates sets it then */
    oc_noise_watch noise;
    oc_prior prior;
    oc_joint_work work;
    int32_t first, count;        /* of the samples that wait, a ring */
    oc_joint_waiting waiting[OC_JOINT_WAITING];
} oc_joint_tracking;

typedef struct {
    int32_t started;
    int32_t count;               /* hypotheses that run, the first so many; the others were not needed */
    int32_t begun, found;        /* of them that ever took a sample in, and that did since the wheel was lost */
    int32_t best;                /* hypothesis */
    int32_t born;                /* of the starts, which one is next */
    int32_t phase;               /* ticks since a sample was due */
    int32_t in_block, in_long_block;
    float along, across;         /* cosine and sine of the heading since it was lost */
    int32_t lost;                /* the wheel may be elsewhere, and the heading another */
    oc_second second;            /* what the next whole second will be */
    float to_left, to_right;     /* s during which the side force was clearly to either side of a_0 */
    float correction;            /* rad/s, of the yaw rates so far, and */
    int32_t corrected;           /* how many hypotheses have it, and */
    int32_t concluded;           /* of how many the conclusions show it */
    int32_t loaded;              /* how many hypotheses know of the last load that changed the bends */
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
    float told_sd;         /* rad, of the offset but for pull and wind, which no drive tells */
    float lean;            /* rad, from the offset to where it is expected with their share in a_0 */
    float used;            /* s */
} oc_joint_answer;

/* lowpass: through which the signals come. pull_sd: m/s^2, of wheel alignment and mean wind, which shift a_0, and
 * of the bank where it is not seen; sees_bank: an accelerometer does; memory_s: how far back evidence reaches. */
void oc_joint_setup(oc_joint_design *design, const oc_lowpass *lowpass, double rate_hz, double steering_ratio,
                    double ratio_times_wheelbase, float pull_sd, bool sees_bank, double memory_s);

/* One tick later than the one before; after an ignition, a hole or a standstill tracking is all zero, and after the
 * first two `lost` is set. True when a second was learned from. */
bool oc_joint_update(oc_joint *joint, oc_joint_tracking *tracking, const oc_joint_design *design,
                     const oc_joint_tick *tick);

/* While the truck stands: what corrects the drive before is concluded. The next tick that moves finds tracking all
 * zero. */
void oc_joint_stand(oc_joint *joint, oc_joint_tracking *tracking, const oc_joint_design *design,
                    const oc_prior *prior);

/* The yaw rates so far were corrected by rad/s too little, on average. False where that is not worth it, or the last
 * correction has not come to all hypotheses yet. Banks that an accelerometer told move with them. */
bool oc_joint_correct(oc_joint *joint, float rad_s, bool has_banks);

/* What the bank says is put down as what it was until the change, and the bank goes on with the other.
 * Not while a hypothesis's equations are half solved: all conclude anew, from the first on. */
void oc_joint_note_change(oc_joint *joint, const oc_change *change, const oc_estimate *before, double time);

/* m^2/s^2, of side force on the front tyres by curvature: axles that resist turning, as many as seem to be down. */
float oc_joint_tandem(const oc_joint *joint, const oc_joint_design *design);

/* s, how far back its evidence reaches: not far at first, when it was gathered far from where the hypotheses went. */
float oc_joint_memory(const oc_joint *joint, const oc_joint_design *design);

/* s of side force clearly to one side, 1 left or -1 right, that are lacking before the play's flank there is seen; 0
 * where that flank was seen at least for a moment and play was found. */
double oc_joint_flank_lacking(const oc_joint *joint, const oc_joint_design *design, int32_t side);

/* Where in the play the best hypothesis has the last sample, from -1 to 1: 1 is the flank of a left turn. */
double oc_joint_place(const oc_joint *joint);

/* The hypotheses' mean by their weights, and what that leaves open. */
void oc_joint_answer_get(oc_joint_answer *answer, const oc_joint *joint, const oc_joint_design *design);

#endif

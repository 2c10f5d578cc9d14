#ifndef OC_JOINT_H
#define OC_JOINT_H
/* Offset, understeer gradient, play and the side force at which the steering unloads, estimated together: a bank of
 * hypotheses that start apart, each of which learns them all; how well each foretold the measured angle is its weight.
 *
 * A tick in ten or so is a sample. The hypotheses take it in a few at a time, so that no tick is a spike. */

#include <stdbool.h>
#include <stdint.h>

#include "change.h"
#include "hypothesis.h"

enum { OC_JOINT_HYPOTHESES = 12, OC_CHANGES_MAX = 8 };

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
    double curvature;            /* 1/m */
    double speed;                /* m/s */
    double yaw_rate_bias;        /* rad/s, by which the yaw rate was corrected; the prior has its spread */
    bool usable;                 /* the gate is open */
} oc_joint_tick;

typedef struct {
    oc_hypothesis_design hypothesis;
    double rate_hz;
    double side_force_share;     /* of a new tick in the smoothed bank */
    float memory_s;              /* how far back evidence reaches at most */
    int32_t ticks_per_sample, hypotheses_per_tick, samples_per_second;
} oc_joint_design;

/* Lost at ignition, and while the truck stands. */
typedef struct {
    int32_t running;
    int32_t taken;               /* hypotheses that have it */
    double bank;                 /* m/s^2, a_y - r*v smoothed */
    double yaw_rate, lateral_acceleration; /* of the tick before */
    oc_motion_sample sample;
    oc_prior prior;              /* at the sample; whoever updates sets it where oc_joint_begins_sample */
} oc_joint_tracking;

typedef struct {
    int32_t started;
    int32_t best;                /* hypothesis */
    int32_t born;                /* of the starts, which one is next */
    int32_t phase;               /* ticks since a sample was due */
    int32_t in_second;           /* samples of the second that fills */
    int32_t in_block, in_long_block;
    double heading;              /* rad, since it was lost */
    int32_t lost;                /* the wheel may be elsewhere, and the heading another */
    oc_second second;            /* what the next whole second will be */
    float to_left, to_right;     /* s during which the side force was clearly to either side of a_0 */
    double yaw_rate_bias;          /* rad/s, at the last sample */
    double yaw_rate_bias_variance; /* rad^2/s^2, the least so far; 0: none */
    float correction;            /* rad/s, of the yaw rates so far, and */
    int32_t corrected;           /* how many hypotheses have it */
    double speed_mean;           /* m/s, and */
    double bank_mean, bank_samples; /* m/s^2, a_y - r*v over all usable samples */
    oc_change_watch watch;
    int32_t changes;             /* seen; the last of them are kept */
    oc_changed changed[OC_CHANGES_MAX];
    oc_hypothesis hypotheses[OC_JOINT_HYPOTHESES];
} oc_joint;

typedef struct {
    double offset, offset_sd;       /* rad */
    double gradient, gradient_sd;   /* rad/(m/s^2) */
    double backlash, backlash_sd;   /* rad, full width */
    double unloading, unloading_sd; /* m/s^2 */
    double wheelbase, wheelbase_sd; /* share by which the truck turns as if it were longer */
    double used;                    /* s */
} oc_joint_answer;

/* pull_sd: m/s^2, of wheel alignment and mean wind, which shift a_0; memory_s: how far back evidence reaches. */
void oc_joint_setup(oc_joint_design *design, double rate_hz, double steering_ratio, double ratio_times_wheelbase,
                    double pull_sd, double memory_s);

/* One tick later than the one before; after an ignition, a hole or a standstill tracking is all zero, and after the first
 * two `lost` is set. True when a second was learned
 * from. */
bool oc_joint_update(oc_joint *joint, oc_joint_tracking *tracking, const oc_joint_design *design,
                     const oc_joint_tick *tick);

/* While the truck stands: what that tells of the yaw rate's bias (rad/s) holds for the drive before, too. The next tick
 * that moves finds tracking all zero. */
void oc_joint_stand(oc_joint *joint, const oc_joint_design *design, const oc_prior *prior, double yaw_rate_bias);

/* Whether the next tick is a sample. */
bool oc_joint_begins_sample(const oc_joint *joint);

/* s of side force clearly to one side, 1 left or -1 right, that are lacking before the play's flank there is seen; 0 where
 * that flank was seen at least for a moment and play was found. */
double oc_joint_flank_lacking(const oc_joint *joint, int32_t side);

/* Where in the play the best hypothesis has the last sample, from -1 to 1: 1 is the flank of a left turn. */
double oc_joint_place(const oc_joint *joint);

/* The hypotheses' mean by their weights, and what that leaves open. */
oc_joint_answer oc_joint_answer_get(const oc_joint *joint);

#endif

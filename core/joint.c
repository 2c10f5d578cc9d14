#include "joint.h"

#include <math.h>
#include "trig.h"

static const double sample_s = 0.1;
static const double side_force_s = 1.0; /* a bank lasts longer; the accelerometer's noise does not */
static const float one_degree = 0.017453292f; /* rad */

static const double quarter_turn = 1.5707963267948966; /* rad */
static const float least_correction = 1e-6f; /* rad/s */

/* A flank of the play counts as seen after so long with a side force that is so clearly beyond friction. */
static const float flank_s = 4.0f;
static const float clearly = 0.02f;                    /* m/s^2 */
static const float width_sd = 6.0f * 0.017453292f;     /* rad, prior */
static const float always_doubtful = 0.2f;             /* of that variance, whatever was found */
static const float found_width = 2.0f * 0.017453292f;  /* rad: so much play is no chance find */

void oc_joint_setup(oc_joint_design *design, double rate_hz, double steering_ratio, double ratio_times_wheelbase,
                    double pull_sd, double memory_s) {
    const int32_t ticks = (int32_t)(sample_s * rate_hz + 0.5);
    const double step_s = ticks / rate_hz;
    oc_hypothesis_setup(&design->hypothesis, step_s, steering_ratio, ratio_times_wheelbase, pull_sd);
    design->rate_hz = rate_hz;
    design->side_force_share = 1.0 / (side_force_s * rate_hz);
    design->memory_s = (float)memory_s;
    design->ticks_per_sample = ticks;
    design->hypotheses_per_tick = (OC_JOINT_HYPOTHESES + ticks - 1) / ticks;
    design->samples_per_second = (int32_t)(1.0 / step_s + 0.5);
}

/* Little, some and much play; wheels that side force carries through it, sooner or later, or that stay where they rub;
 * and an accelerometer that may be off to either side. */
static oc_play start_of(int32_t k) {
    static const float widths[3] = {2.0f, 6.0f, 12.0f}; /* deg */
    static const float unloadings[3] = {-0.2f, 0.0f, 0.2f};
    static const float creep = 100.0f * 0.017453292f;
    const int32_t kind = k % 4;
    oc_play play = {.half_width = 0.5f * widths[k / 4] * one_degree, .friction = -1.0f};
    if (kind > 0) {
        play.creep = creep;
        play.windup = 0.25f * one_degree;
        play.friction = 0.06f;
        play.unloading = unloadings[kind - 1];
    }
    return play;
}

static void start(oc_joint *joint, const oc_joint_design *design, double angle) {
    *joint = (oc_joint){
        .started = 1,
        .corrected = OC_JOINT_HYPOTHESES,
        .second = {
            .second_s = design->hypothesis.step_s * (float)design->samples_per_second,
            .memory_share = 1.0f,
            .trial_s = 60.0f,
            .reference = one_degree * one_degree,
            .learns = 1,
        },
    };
    for (int32_t k = 0; k < OC_JOINT_HYPOTHESES; ++k) {
        const oc_play play = start_of(k);
        oc_hypothesis_start(&joint->hypotheses[k], &design->hypothesis, &play, angle);
    }
}

/* After a standstill wheel and heading are as they were left, or nearly so. */
static void restart(oc_joint *joint, const oc_joint_design *design, double angle) {
    if (!joint->started) {
        start(joint, design, angle);
    }
    joint->in_second = 0;
    if (!joint->lost) {
        return;
    }
    for (int32_t k = 0; k < OC_JOINT_HYPOTHESES; ++k) {
        oc_hypothesis_restart(&joint->hypotheses[k], angle);
    }
    joint->heading = 0.0;
    joint->lost = 0;
}

/* What the tyres carry. Turning says it with less noise than the accelerometer, which is needed for the bank alone. */
static oc_motion_sample sample_of(const oc_joint_tick *tick, const oc_joint_tracking *before, double heading,
                                  double rate_hz) {
    return (oc_motion_sample){
        .angle = tick->angle,
        .residual = (float)tick->residual,
        .lateral_acceleration = (float)(tick->yaw_rate * tick->speed + before->bank),
        .yaw_acceleration = (float)((tick->yaw_rate - before->yaw_rate) * rate_hz),
        .jerk = (float)((tick->lateral_acceleration - before->lateral_acceleration) * rate_hz),
        .curvature = (float)tick->curvature,
        .speed = (float)tick->speed,
        .wind = {(float)(tick->speed / 20.0 * oc_sin(heading + quarter_turn)),
                 (float)(tick->speed / 20.0 * oc_sin(heading))},
        .usable = tick->usable,
    };
}

/* What is learned of a bias that has not changed holds for the yaw rates before as well: of its last move, the share by
 * which it became surer than it ever was. A bias that only wanders, or that is sought anew after an ignition or a jump,
 * does not become so. */
static float correction_of(oc_joint *joint, double bias, double sd) {
    const double variance = sd * sd;
    const double least = joint->yaw_rate_bias_variance;
    const double moved = bias - joint->yaw_rate_bias;
    joint->yaw_rate_bias = bias;
    if (least > 0.0 && !(variance < least)) {
        return 0.0f;
    }
    joint->yaw_rate_bias_variance = variance;
    return least > 0.0 ? (float)((1.0 - variance / least) * moved) : 0.0f;
}

/* A correction goes to one hypothesis after the other, and to each once, whatever comes between. */
static void begin_correction(oc_joint *joint, double bias, const oc_prior *prior) {
    if (joint->corrected < OC_JOINT_HYPOTHESES) {
        return;
    }
    joint->correction = correction_of(joint, bias, (double)prior->yaw_rate_bias_sd);
    joint->corrected = 0;
    joint->bank_mean += (double)joint->correction * joint->speed_mean;
}

static void correct_hypothesis(oc_joint *joint, int32_t k, const oc_joint_design *design, const oc_prior *prior) {
    if (k < joint->corrected) {
        return;
    }
    joint->corrected = k + 1;
    if (fabsf(joint->correction) > least_correction && joint->second.used_s > 0.0f) {
        oc_hypothesis_correct(&joint->hypotheses[k], &design->hypothesis, prior, joint->correction);
    }
}

static void turn_phase(oc_joint *joint, const oc_joint_design *design) {
    joint->phase = joint->phase + 1 < design->ticks_per_sample ? joint->phase + 1 : 0;
}

void oc_joint_stand(oc_joint *joint, const oc_joint_design *design, const oc_prior *prior, double yaw_rate_bias) {
    if (!joint->started) {
        return;
    }
    if (joint->phase == 0) {
        begin_correction(joint, yaw_rate_bias, prior);
    }
    turn_phase(joint, design);
    for (int32_t k = 0; k < design->hypotheses_per_tick && joint->corrected < OC_JOINT_HYPOTHESES; ++k) {
        correct_hypothesis(joint, joint->corrected, design, prior);
    }
}

static bool is_newborn(const oc_joint *joint, const oc_hypothesis *h) {
    return h->age <= joint->second.trial_s && joint->second.used_s > joint->second.trial_s;
}

static int32_t best_of(const oc_joint *joint) {
    int32_t best = joint->best;
    for (int32_t k = 0; k < OC_JOINT_HYPOTHESES; ++k) {
        const oc_hypothesis *h = &joint->hypotheses[k];
        if (!is_newborn(joint, h) && h->cost < joint->hypotheses[best].cost) {
            best = k;
        }
    }
    return best;
}

static void see_flank(oc_joint *joint, const oc_motion_sample *sample, float step_s) {
    const oc_hypothesis *best = &joint->hypotheses[joint->best];
    const float load = oc_play_load(&best->play, sample);
    const float friction = best->play.friction > 0.0f ? best->play.friction : 0.0f;
    const float beyond = clearly + friction + sqrtf(best->unloading_variance);
    joint->to_left += load > beyond ? step_s : 0.0f;
    joint->to_right += load < -beyond ? step_s : 0.0f;
}

/* Two hypotheses that went the same way say the same twice. */
static bool are_twins(const oc_hypothesis *a, const oc_hypothesis *b) {
    static const float near = 0.1f * 0.017453292f; /* rad */
    return fabsf(a->play.half_width - b->play.half_width) < near && fabsf(a->play.windup - b->play.windup) < near &&
           fabsf(a->offset - b->offset) < near && (a->play.friction < 0.0f) == (b->play.friction < 0.0f);
}

/* The worst hypothesis if it is hopeless, or else one that another of the elder ones says as well. */
static int32_t dispensable(const oc_joint *joint) {
    static const float hopeless = 20.0f; /* of cost */
    int32_t worst = joint->best;
    for (int32_t k = 0; k < OC_JOINT_HYPOTHESES; ++k) {
        const oc_hypothesis *h = &joint->hypotheses[k];
        if (!is_newborn(joint, h) && h->cost > joint->hypotheses[worst].cost) {
            worst = k;
        }
    }
    if (joint->hypotheses[worst].cost > joint->hypotheses[joint->best].cost + hopeless) {
        return worst;
    }
    for (int32_t k = 0; k < OC_JOINT_HYPOTHESES; ++k) {
        const oc_hypothesis *h = &joint->hypotheses[k];
        if (k != joint->best && !is_newborn(joint, h) && are_twins(h, &joint->hypotheses[joint->best])) {
            return k;
        }
    }
    return -1;
}

/* Now and then another hypothesis takes the place of one that is not needed, lest all of them went astray at first. */
static void renew(oc_joint *joint, const oc_hypothesis_design *design) {
    const int32_t k = dispensable(joint);
    if (k >= 0) {
        oc_hypothesis *h = &joint->hypotheses[k];
        const oc_play play = start_of(joint->born);
        joint->born = (joint->born + 1) % OC_JOINT_HYPOTHESES;
        oc_hypothesis_start(h, design, &play, (double)h->place.inner);
    }
}

static float clamped(float value, float low, float high) {
    if (value < low) {
        return low;
    }
    return value > high ? high : value;
}

/* What the next whole second will be. */
static void turn_second(oc_joint *joint, const oc_joint_design *design) {
    oc_second *second = &joint->second;
    const float least = 0.05f * one_degree;
    joint->best = best_of(joint);
    second->best_cost = joint->hypotheses[joint->best].cost;
    const float noise = oc_hypothesis_noise(&joint->hypotheses[joint->best]);
    second->reference = noise > least * least ? noise : least * least;
    second->used_s += second->second_s;
    second->trial_s = clamped(0.05f * second->used_s, 60.0f, 600.0f);
    if (second->long_block_ends) {
        renew(joint, &design->hypothesis);
    }
    second->blocks += second->block_ends;
    second->long_blocks += second->long_block_ends;
    joint->in_block = second->block_ends ? 0 : joint->in_block + 1;
    joint->in_long_block = second->long_block_ends ? 0 : joint->in_long_block + 1;
    second->block_ends = joint->in_block + 1 == OC_SECONDS_PER_BLOCK;
    second->long_block_ends = joint->in_long_block + 1 == OC_SECONDS_PER_LONG_BLOCK;
    /* a short memory at first, since early evidence was gathered far from where the hypotheses went */
    const float memory = 60.0f + 0.5f * second->used_s;
    second->memory_share = 1.0f - second->second_s / (memory < design->memory_s ? memory : design->memory_s);
}

/* Errors of what was foretold are watched once there is something to doubt. */
static void watch(oc_joint *joint, double time) {
    static const float learned_s = 300.0f; /* hypotheses that still go their ways err, too */
    const oc_hypothesis *best = &joint->hypotheses[joint->best];
    if (!(best->age > learned_s)) {
        joint->second.learns = 1;
        return;
    }
    const oc_joint_answer before = oc_joint_answer_get(joint);
    const oc_change change = oc_change_update(&joint->watch, (double)best->error,
                                              sqrt((double)joint->second.reference), (double)best->curvature);
    joint->second.learns = !oc_change_suspected(&joint->watch);
    if (change.kind == OC_CHANGE_NONE) {
        return;
    }
    joint->changed[joint->changes % OC_CHANGES_MAX] = (oc_changed){
        .time = time - change.seconds,
        .before = before.offset,
        .before_sd = before.offset_sd,
        .change = change,
    };
    ++joint->changes;
    for (int32_t k = 0; k < OC_JOINT_HYPOTHESES; ++k) {
        if (change.kind == OC_CHANGE_OFFSET) {
            oc_hypothesis_remounted(&joint->hypotheses[k], (float)change.size, (float)change.seconds);
        } else {
            oc_hypothesis_loaded(&joint->hypotheses[k]);
        }
    }
}

/* All hypotheses have taken the sample in. */
static void sampled(oc_joint *joint, const oc_joint_design *design, const oc_motion_sample *sample, double bank,
                    double time) {
    if (!sample->usable) {
        joint->in_second = 0;
        return;
    }
    const double memory = 10.0 * (double)design->memory_s;
    joint->bank_samples += joint->bank_samples < memory ? 1.0 : 0.0;
    joint->bank_mean += (bank - joint->bank_mean) / joint->bank_samples;
    joint->speed_mean += ((double)sample->speed - joint->speed_mean) / joint->bank_samples;
    see_flank(joint, sample, design->hypothesis.step_s);
    if (++joint->in_second == design->samples_per_second) {
        joint->in_second = 0;
        const bool learned = joint->second.learns;
        watch(joint, time);
        if (learned) {
            turn_second(joint, design);
        }
    }
}

/* Some more hypotheses take the sample in, and learn where it makes a second whole. */
static bool take_in(oc_joint *joint, oc_joint_tracking *tracking, const oc_joint_design *design,
                    const oc_joint_tick *tick) {
    const oc_motion_sample *sample = &tracking->sample;
    const oc_prior *prior = &tracking->prior;
    const bool ends_second = sample->usable && joint->in_second + 1 == design->samples_per_second;
    const int32_t end = tracking->taken + design->hypotheses_per_tick;
    for (; tracking->taken < end && tracking->taken < OC_JOINT_HYPOTHESES; ++tracking->taken) {
        oc_hypothesis *h = &joint->hypotheses[tracking->taken];
        correct_hypothesis(joint, tracking->taken, design, prior);
        oc_hypothesis_sample(h, &design->hypothesis, sample, joint->in_second == 0);
        if (ends_second) {
            oc_hypothesis_second(h, &design->hypothesis, prior, &joint->second, design->samples_per_second);
        }
    }
    if (tracking->taken < OC_JOINT_HYPOTHESES) {
        return false;
    }
    sampled(joint, design, sample, tracking->bank, tick->time);
    return ends_second;
}

bool oc_joint_begins_sample(const oc_joint *joint) {
    return joint->phase == 0;
}

bool oc_joint_update(oc_joint *joint, oc_joint_tracking *tracking, const oc_joint_design *design,
                     const oc_joint_tick *tick) {
    const double bank = tick->lateral_acceleration - tick->yaw_rate * tick->speed;
    bool learned = false;
    if (!tracking->running) {
        restart(joint, design, tick->angle);
        *tracking = (oc_joint_tracking){
            .running = 1,
            .prior = tracking->prior,
            .bank = bank,
            .taken = OC_JOINT_HYPOTHESES,
            .yaw_rate = tick->yaw_rate,
            .lateral_acceleration = tick->lateral_acceleration,
        };
    }
    joint->heading += tick->yaw_rate / design->rate_hz;
    tracking->bank += (bank - tracking->bank) * design->side_force_share;
    if (joint->phase == 0) {
        tracking->sample = sample_of(tick, tracking, joint->heading, design->rate_hz);
        tracking->taken = 0;
        begin_correction(joint, tick->yaw_rate_bias, &tracking->prior);
    }
    turn_phase(joint, design);
    if (tracking->taken < OC_JOINT_HYPOTHESES) {
        learned = take_in(joint, tracking, design, tick);
    }
    tracking->yaw_rate = tick->yaw_rate;
    tracking->lateral_acceleration = tick->lateral_acceleration;
    return learned;
}

double oc_joint_place(const oc_joint *joint) {
    const oc_hypothesis *best = &joint->hypotheses[joint->best];
    const double place = (double)(best->place.wound - best->place.inner) / (double)best->play.half_width;
    if (place < -1.0) {
        return -1.0;
    }
    return place > 1.0 ? 1.0 : place;
}

double oc_joint_flank_lacking(const oc_joint *joint, int32_t side) {
    static const float hardly_s = 1.0f;
    const float seen = side > 0 ? joint->to_left : joint->to_right;
    const bool found = 2.0f * joint->hypotheses[joint->best].play.half_width > found_width && seen > hardly_s;
    return found || seen > flank_s ? 0.0 : (double)(flank_s - seen);
}

static float share_of(float value) {
    if (value < 0.0f) {
        return 0.0f;
    }
    return value > 1.0f ? 1.0f : value;
}

/* Of time, before it tells as much as if its seconds were independent. */
static float longer_by_correlation(const oc_hypothesis *h) {
    const float f = h->blocks.factor > h->long_blocks.factor ? h->blocks.factor : h->long_blocks.factor;
    return f > 1.0f ? sqrtf(f) : 1.0f;
}

/* The variance of a width that nobody saw. On one flank only, all play is taken for offset. A width that was found was
 * found by leaving that flank; that there is hardly any is believed only where the side force was on both sides, and else
 * the midpoint stays as uncertain as half the play is beforehand. */
static double unseen_width_variance(const oc_joint *joint, const oc_hypothesis *h) {
    const float seen = joint->to_left < joint->to_right ? joint->to_left : joint->to_right;
    const float missing = share_of(1.0f - seen / (flank_s * longer_by_correlation(h)));
    const float little = share_of(1.0f - 2.0f * h->play.half_width / found_width);
    const float doubtful = little > always_doubtful ? little : always_doubtful;
    return (double)(missing * doubtful * width_sd * width_sd);
}

/* exp(-x), near enough for a weight, for x >= 0. */
static double likelihood(double x) {
    double power = 1.0 / (1.0 + x / 32.0);
    for (int32_t k = 0; k < 5; ++k) {
        power *= power;
    }
    return power;
}

/* Of values that each have a variance: mean, and variance within and between. */
typedef struct {
    double weight, sum, squares, variances;
} mixture;

static void mix(mixture *mixture, double weight, double value, double variance) {
    mixture->weight += weight;
    mixture->sum += weight * value;
    mixture->squares += weight * value * value;
    mixture->variances += weight * variance;
}

static double mean_of(const mixture *mixture) {
    return mixture->sum / mixture->weight;
}

static double sd_of(const mixture *mixture) {
    const double mean = mean_of(mixture);
    const double between = mixture->squares / mixture->weight - mean * mean;
    return sqrt(mixture->variances / mixture->weight + (between > 0.0 ? between : 0.0));
}

oc_joint_answer oc_joint_answer_get(const oc_joint *joint) {
    mixture offset = {0}, gradient = {0}, backlash = {0}, unloading = {0}, wheelbase = {0};
    const oc_hypothesis *best = &joint->hypotheses[joint->best];
    for (int32_t k = 0; k < OC_JOINT_HYPOTHESES; ++k) {
        const oc_hypothesis *h = &joint->hypotheses[k];
        if (is_newborn(joint, h)) {
            continue;
        }
        const double weight = likelihood(h->cost > best->cost ? (double)(h->cost - best->cost) : 0.0);
        const double unseen = unseen_width_variance(joint, h);
        mix(&offset, weight, (double)(h->offset - best->offset),
            (double)h->offset_variance + 0.25 * unseen);
        mix(&gradient, weight, (double)h->gradient, (double)h->gradient_variance);
        mix(&backlash, weight, 2.0 * (double)(h->play.half_width + h->play.windup), (double)h->width_variance + unseen);
        mix(&wheelbase, weight, (double)h->wheelbase, (double)h->wheelbase_variance);
        mix(&unloading, weight, (double)h->unloading, (double)h->unloading_variance);
    }
    return (oc_joint_answer){
        .offset = (double)best->offset + mean_of(&offset),
        .offset_sd = sd_of(&offset),
        .gradient = mean_of(&gradient),
        .gradient_sd = sd_of(&gradient),
        .backlash = mean_of(&backlash),
        .backlash_sd = sd_of(&backlash),
        .unloading = mean_of(&unloading),
        .unloading_sd = sd_of(&unloading),
        .wheelbase = mean_of(&wheelbase),
        .wheelbase_sd = sd_of(&wheelbase),
        .used = (double)joint->second.used_s,
    };
}

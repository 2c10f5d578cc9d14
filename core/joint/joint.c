#include "joint.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

#include "bounds.h"
#include "hypothesis_set.h"
#include "signals.h"

/* Derived. */
static const float wind_speed = 20.0f; /* m/s, at which terms.toml defines a_c and a_s */

/* Numerical. */
static const float initial_error = 0.017453292f; /* rad, unit of costs before the first solution */
static const float correction_min = 3.5e-5f;     /* rad/s; a smaller one moves the offset by less than 0.01 deg */

/* Tuned, in tuned.toml: joint */
static const double bank_filter_s = 0.3; /* s: time constant of a_y - r v */
static const float load_noise = 0.02f; /* m/s^2: sd of the accelerometer's noise in the load up to load_bank_s_max */
static const float load_bank_s_max = 2.0f; /* s: maximum time constant of a_y - r v in the load */
static const double wandering_memory_s = 200.0; /* s: memory of the mean bank if the zero is a random walk */
static const float crowned_curvature = 0.0007f; /* 1/m: curvature up to which a road is crowned */
static const float banked_curvature_min = 0.004f; /* 1/m: curvature from which bends may be superelevated in full */
static const float banked_curvature = 0.006f; /* 1/m: the same, usual */
static const float banked_curvature_max = 0.0125f; /* 1/m: the same, up to which; junctions are tighter */
static const float outlying_error = 1.5f * 0.017453292f; /* rad: minimum error of a second far from the prediction */
static const float outlying_max = 8.0f * 0.017453292f; /* rad: maximum error of such a second */
static const float outlying_sds = 4.0f; /* the same, in standard deviations of the prediction error */
static const float outlying_gradient = 0.3f * 0.017453292f; /* rad/(m/s^2): growth of K, by snow, that explains one */
static const float prior_discount_max = 25.0f; /* maximum reduction of the weight of a_0's prior */
static const float trailer_m = 7.0f; /* m: from the hitch to the axles' middle, of most semitrailers */
static const float fifth_wheel_slip = 0.2f * 0.017453292f; /* rad: articulation until its friction is full */
static const float tag_axle_shortening = 0.15f; /* share of the wheelbase at which the tag axle is up */
static const float tag_axle_fade = 0.1f; /* share over which c fades; up to 5 % is a vehicle file's error */
static const float tyre_share_in_bends = 0.7f; /* share of r v on the tyres without an accelerometer */
static const float bend_error = 0.002f; /* 1/rad: error over the squared angle of a bend, 1 deg at 24 m */
static const float solve_all_until_s = 120.0f; /* s: used driving until the hypotheses solve every few seconds only */
/* end */

void oc_joint_setup(oc_joint_design *design, const oc_lowpass *lowpass, double rate_hz, double steering_ratio,
                    double ratio_times_wheelbase, float pull_sd, bool measures_bank, double memory_s) {
    const int32_t ticks = (int32_t)(rate_hz / (double)OC_STEPS_PER_SECOND + 0.5);
    const double step_s = ticks / rate_hz;
    oc_hypothesis_setup(&design->hypothesis, step_s, steering_ratio, ratio_times_wheelbase, pull_sd);
    oc_noise_setup(&design->noise, lowpass, rate_hz, ticks);
    design->tick_s = 1.0 / rate_hz;
    design->bank_share = design->tick_s / bank_filter_s;
    design->tyre_share = measures_bank ? 1.0f : tyre_share_in_bends;
    design->bank_unmeasured = measures_bank ? 0.0f : 1.0f;
    design->hypothesis.prior_discount_max = measures_bank ? prior_discount_max : 1.0f;
    design->memory_s = (float)memory_s;
    design->ticks_per_sample = ticks;
    design->samples_per_second = (int32_t)(1.0 / step_s + 0.5);
}

static void start(oc_joint *joint, const oc_joint_design *design, double angle) {
    joint->started = 1;
    joint->count = OC_JOINT_HYPOTHESES;
    joint->second = (oc_second){
        .second_s = design->hypothesis.step_s * (float)design->samples_per_second,
        .memory_share = 1.0f,
        .probation_s = 60.0f,
        .reference = initial_error * initial_error,
        .weight = 1.0f,
        .learns = 1,
    };
    for (int32_t k = 0; k < OC_JOINT_HYPOTHESES; ++k) {
        const oc_play play = oc_joint_start_of(k, &design->hypothesis.known);
        oc_hypothesis_start(&joint->hypotheses[k], &play, angle);
    }
}

/* Place in the play and heading are unknown. */
static void reset_places(oc_joint *joint, double angle) {
    for (int32_t k = 0; k < joint->count; ++k) {
        oc_hypothesis_restart(&joint->hypotheses[k], angle);
    }
    oc_change_settle(&joint->watch);
    joint->along = 1.0f;
    joint->across = 0.0f;
}

void oc_joint_restart(oc_joint *joint, oc_joint_tracking *tracking) {
    joint->lost = 1;
    joint->solves_all = joint->solves_all || (tracking->due > 0 && tracking->solves_all);
    const oc_prior prior = tracking->prior; /* of the evidence, which stays */
    memset(tracking, 0, sizeof *tracking);  /* not a struct of zeros, which takes 2 KiB of stack at -O0 */
    tracking->prior = prior;
}

void oc_joint_ignition(oc_joint *joint, oc_joint_tracking *tracking, float off_s) {
    oc_joint_restart(joint, tracking);
    if (joint->started) {
        ++joint->ignitions;
        joint->off_s += oc_max(off_s, 0.0f);
    }
}

static void change_between_drives(oc_joint *joint, const oc_joint_design *design) {
    if (joint->ignitions == 0) {
        return;
    }
    for (int32_t k = 0; k < joint->count; ++k) {
        oc_hypothesis_change_between_drives(&joint->hypotheses[k], &design->hypothesis, joint->off_s);
    }
    oc_joint_open_play(joint, &design->hypothesis.known);
    joint->ignitions = 0;
    joint->off_s = 0.0f;
    joint->solves_all = 1;
}

/* A standstill changes neither place in the play nor heading, so the round continues. */
static void begin_collecting(oc_joint *joint, oc_joint_tracking *tracking, const oc_joint_design *design,
                             const oc_joint_tick *tick, double bank) {
    const bool lost = joint->lost || !joint->started;
    if (!joint->started) {
        start(joint, design, tick->angle);
    }
    if (lost) {
        oc_joint_restart(joint, tracking); /* a hole only sets `lost` */
        reset_places(joint, tick->angle);
        change_between_drives(joint, design);
        joint->lost = 0;
        tracking->wound = tracking->inner = (float)tick->angle;
    }
    tracking->running = 1;
    tracking->filling.count = tracking->in_second = 0;
    tracking->turned = 0.0f;
    tracking->noise = (oc_noise_watch){0};
    tracking->bank = tracking->load_bank = bank;
    tracking->yaw_rate = tick->yaw_rate;
    tracking->lateral_acceleration = tick->lateral_acceleration;
}

bool oc_joint_wanders(const oc_joint *joint) {
    return joint->hypotheses[joint->best].wanders != 0;
}

bool oc_joint_walks(const oc_joint *joint) {
    return joint->hypotheses[joint->best].walks != 0;
}

float oc_joint_tandem(const oc_joint *joint, const oc_joint_design *design) {
    if (joint->axle != 0) {
        return joint->axle > 0 ? design->tandem : 0.0f;
    }
    if (design->hypothesis.known.product_doubt > 0.0f) {
        return design->tandem; /* a share of an assumed wheelbase shows no tag axle */
    }
    const float down = (joint->hypotheses[joint->best].wheelbase + tag_axle_shortening) / tag_axle_fade;
    return design->tandem * oc_clamp(down, 0.0f, 1.0f);
}

/* Turns the heading by a small angle, rad. Ignores a large one: no truck turns so fast, and the series would
 * diverge. */
static void turn_heading(oc_joint *joint, float angle) {
    const float squared = angle * angle;
    if (squared > 2.0f) {
        return;
    }
    const float cosine = 1.0f - 0.5f * squared, sine = angle - squared * angle / 6.0f;
    const float along = cosine * joint->along - sine * joint->across;
    const float across = sine * joint->along + cosine * joint->across;
    const float shortening = 1.5f - 0.5f * (along * along + across * across); /* against growth by rounding */
    joint->along = along * shortening;
    joint->across = across * shortening;
}

/* a = r v + smoothed bank; r v has less noise than the accelerometer (docs/method.md, "Model"). */
static oc_motion_sample sample_of(const oc_joint_tick *tick, const oc_joint_tracking *before, const oc_joint *joint,
                                  const oc_joint_design *design) {
    const double force = (double)design->tyre_share * tick->yaw_rate * tick->speed + before->bank;
    return (oc_motion_sample){
        .angle = (float)tick->angle,
        .rear_part = (float)tick->rear_part,
        .residual = (float)tick->residual,
        .lateral_acceleration = (float)force,
        .force = (float)(force - before->bank + before->load_bank),
        .yaw_acceleration = (float)(tick->yaw_rate - before->yaw_rate) / design->hypothesis.step_s,
        .jerk = (float)(force - before->lateral_acceleration) / design->hypothesis.step_s,
        .curvature = (float)tick->curvature,
        .fifth_wheel = before->fifth_wheel,
        .per_speed = 1.0f / (float)(tick->speed > 1.0 ? tick->speed : 1.0),
        .tandem = oc_joint_tandem(joint, design) * (float)tick->curvature,
        .wind = {(float)tick->speed / wind_speed * joint->along, (float)tick->speed / wind_speed * joint->across},
        .in_second = tick->usable ? before->in_second : -1,
    };
}

bool oc_joint_correct(oc_joint *joint, const oc_joint_tracking *tracking, const oc_joint_design *design, float rad_s,
                      bool has_banks) {
    if (!joint->started || tracking->due > 0 || !(fabsf(rad_s) > correction_min)) {
        return false;
    }
    const double by_speed = has_banks ? (double)rad_s * joint->speed_mean : 0.0;
    joint->bank_mean += by_speed;
    joint->crown_bank += by_speed;
    if (joint->second.used_s > 0.0f) {
        for (int32_t k = 0; k < joint->count; ++k) {
            oc_hypothesis_correct(&joint->hypotheses[k], &design->hypothesis, rad_s);
        }
        joint->solves_all = 1;
    }
    return true;
}

static void advance_phase(oc_joint *joint, const oc_joint_design *design) {
    joint->phase = joint->phase + 1 < design->ticks_per_sample ? joint->phase + 1 : 0;
}

/* The flank that a sample's lateral force loads, by the best hypothesis: 1 left, -1 right, 0 uncertain. */
static int32_t flank_of(const oc_joint *joint, const oc_joint_design *design, const oc_motion_sample *sample) {
    const oc_hypothesis *best = &joint->hypotheses[joint->best];
    const float load = oc_play_load(&best->play, sample);
    const float friction = oc_max(best->play.friction, 0.0f);
    const float beyond = load_noise + design->unmeasured_bank + friction +
                         sqrtf(best->variances.of[OC_OF_UNLOADING]);
    return load > beyond ? 1 : load < -beyond ? -1 : 0;
}

static void count_flank_time(oc_joint *joint, const oc_joint_design *design, const oc_motion_sample *sample) {
    const int32_t flank = flank_of(joint, design, sample);
    const float step_s = design->hypothesis.step_s;
    joint->loaded_left_s += flank > 0 ? step_s : 0.0f;
    joint->loaded_right_s += flank < 0 ? step_s : 0.0f;
}

/* A prediction error on a flank that was seldom loaded may be play, not a change. */
static bool loads_rare_flank(const oc_joint *joint, const oc_joint_tracking *tracking, const oc_joint_design *design) {
    for (int32_t n = 0; n < tracking->collected.count; ++n) {
        const int32_t flank = flank_of(joint, design, &tracking->collected.samples[n]);
        const float loaded_s = flank > 0 ? joint->loaded_left_s : joint->loaded_right_s;
        if (flank != 0 && loaded_s < oc_joint_sure_flank_s()) {
            return true;
        }
    }
    return false;
}

/* Suspicion stops learning, so a young hypothesis would stay young. Therefore only an old best one may raise it. */
static bool is_suspected(const oc_joint *joint) {
    return joint->hypotheses[joint->best].age > oc_joint_settled_s() && oc_change_suspected(&joint->watch);
}

static void watch_for_change(oc_joint *joint, const oc_joint_tracking *tracking, const oc_estimate *last_offset,
                             double time) {
    const oc_hypothesis *best = &joint->hypotheses[joint->best];
    if (!(best->age > oc_joint_settled_s()) || tracking->loads_rare_flank) {
        return;
    }
    const oc_change change = oc_change_update(&joint->watch, best->error, tracking->min_error,
                                              sqrtf(joint->second.reference), tracking->collected.curvature,
                                              joint->second.weight);
    joint->alarmed = joint->alarmed || change.seconds > 0.0f;
    if (change.kind != OC_CHANGE_NONE) {
        oc_joint_note_change(joint, &change, last_offset, time - change.seconds);
    }
}

/* Whether the collected samples load one flank throughout. Else the wheels may cross the play. */
static bool loads_one_flank(const oc_joint *joint, const oc_joint_tracking *tracking, const oc_joint_design *design) {
    const int32_t flank = flank_of(joint, design, &tracking->collected.samples[0]);
    for (int32_t n = 1; n < tracking->collected.count; ++n) {
        if (flank_of(joint, design, &tracking->collected.samples[n]) != flank) {
            return false;
        }
    }
    return flank != 0;
}

/* Whether another place in the play would explain the last prediction error but for outlying_error. */
static bool may_be_place(const oc_hypothesis *h) {
    const float half = h->play.half_width + h->play.windup;
    const float place = oc_clamp_size(h->places.wound - h->places.inner, half);
    return fabsf(place + h->error) < half + outlying_error;
}

/* m/s^2, mean over the collected samples. */
static float mean_load(const oc_joint *joint, const oc_joint_tracking *tracking) {
    float sum = 0.0f;
    for (int32_t n = 0; n < tracking->collected.count; ++n) {
        sum += oc_play_load(&joint->hypotheses[joint->best].play, &tracking->collected.samples[n]);
    }
    return sum / (float)tracking->collected.count;
}

/* Whether the last prediction error is far from what play, tyres, tight bends and noise explain. Tyres with less grip
 * need more angle in the load's direction. */
static bool is_outlying(const oc_joint *joint, const oc_joint_tracking *tracking, const oc_joint_design *design) {
    const oc_hypothesis *best = &joint->hypotheses[joint->best];
    const float error = fabsf(best->error) * sqrtf(joint->second.weight), load = mean_load(joint, tracking);
    const float along = best->error > 0.0f ? load : -load;
    const float by_tyres = design->hypothesis.steering_ratio * outlying_gradient * oc_max(along, 0.0f);
    const bool firm = !tracking->loads_rare_flank && loads_one_flank(joint, tracking, design);
    return error > outlying_error + by_tyres && error < outlying_max &&
           error * error > outlying_sds * outlying_sds * best->variance && (firm || !may_be_place(best));
}

/* Seconds far from the prediction on one side: where a motor steers for minutes, the driver's own steering is. */
static void count_outlying(oc_joint *joint, const oc_joint_tracking *tracking, const oc_joint_design *design) {
    const oc_hypothesis *best = &joint->hypotheses[joint->best];
    const float keep = joint->second.memory_share, seconds = joint->second.second_s;
    const float width = 2.0f * (best->play.half_width + best->play.windup);
    if (!(joint->second.used_s > oc_joint_settled_s())) {
        return;
    }
    if (fabsf(width - joint->outlying_width) > outlying_error) { /* they were counted by another play */
        joint->outlying_s = joint->outlying_sum = joint->outlying_since_s = 0.0f;
        joint->outlying_width = width;
    }
    joint->checked_s = keep * joint->checked_s + seconds;
    joint->outlying_s = keep * joint->outlying_s;
    joint->outlying_sum = keep * joint->outlying_sum;
    if (is_outlying(joint, tracking, design)) {
        joint->outlying_since_s = joint->outlying_since_s > 0.0f ? joint->outlying_since_s : joint->second.used_s;
        joint->outlying_s += best->error > 0.0f ? seconds : -seconds;
        joint->outlying_sum += seconds * best->error;
    }
}

/* Scaled to one curvature, since bends to the left and to the right differ. */
static void average_bend(oc_joint *joint, float bank, float curvature, float memory) {
    int32_t side = 0;
    if (curvature < 0.0f) { /* to the right */
        side = 1;
    }
    const float removed = ((float)joint->crown_bank - bank) * banked_curvature / fabsf(curvature);
    joint->removed_samples[side] = oc_min(joint->removed_samples[side] + 1.0f, memory);
    joint->removed[side] += (removed - joint->removed[side]) / joint->removed_samples[side];
}

/* Superelevation removes the crown, so the crown is that of the straights. */
static void average(oc_joint *joint, const oc_joint_design *design, const oc_joint_tick *tick, double bank) {
    const double memory = 10.0 * (oc_joint_wanders(joint) ? wandering_memory_s : (double)design->memory_s);
    const float curvature = (float)tick->curvature, size = fabsf(curvature);
    if (size < crowned_curvature) {
        joint->crown_samples = joint->crown_samples + 1.0 < memory ? joint->crown_samples + 1.0 : memory;
        joint->crown_bank += (bank - joint->crown_bank) / joint->crown_samples;
    }
    if (size > banked_curvature_min && size < banked_curvature_max) {
        average_bend(joint, (float)bank, curvature, (float)memory);
    }
    joint->bank_samples = joint->bank_samples + 1.0 < memory ? joint->bank_samples + 1.0 : memory;
    joint->bank_mean += (bank - joint->bank_mean) / joint->bank_samples;
    joint->speed_mean += (tick->speed - joint->speed_mean) / joint->bank_samples;
}

static bool ends_second(const oc_motion_sample *sample, const oc_joint_design *design) {
    return sample->in_second == design->samples_per_second - 1;
}

/* Between two samples. Dahl's friction: an articulation of fifth_wheel_slip takes it from zero to full. Without a
 * trailer this term stays near zero. */
static void articulate(oc_joint_tracking *tracking, const oc_joint_design *design, const oc_joint_tick *tick) {
    const float step_s = design->hypothesis.step_s;
    const float turned = tracking->turned - (float)tick->speed / trailer_m * tracking->articulation * step_s;
    tracking->articulation = oc_clamp_size(tracking->articulation + turned, 1.0f);
    tracking->fifth_wheel = oc_clamp_size(tracking->fifth_wheel + turned / fifth_wheel_slip, 1.0f);
}

/* Copies of the best hypothesis's operators follow each sample, since its own lag by a round. */
static void follow_best(const oc_joint *joint, oc_joint_tracking *tracking, const oc_joint_design *design,
                        const oc_motion_sample *sample) {
    const oc_hypothesis *best = &joint->hypotheses[joint->best];
    const oc_play_motion by = oc_hypothesis_motion(best, &design->hypothesis, sample);
    oc_play_follow(&tracking->wound, &tracking->inner, &best->play, &by);
}

/* True when a second of samples is collected. */
static bool collect_sample(oc_joint *joint, oc_joint_tracking *tracking, const oc_joint_design *design,
                           const oc_joint_tick *tick, double bank) {
    float share = 0.0f;
    if (tick->usable) {
        average(joint, design, tick, tracking->bank);
        share = 1.0f / (float)joint->bank_samples;
    }
    const float filtered[OC_NOISY] = {(float)bank, (float)tick->yaw_rate};
    oc_noise_update(&joint->second.noise, &tracking->noise, &design->noise, filtered, tick->raw, share);
    turn_heading(joint, tracking->turned);
    articulate(tracking, design, tick);
    tracking->turned = 0.0f;

    oc_collected *filling = &tracking->filling;
    oc_motion_sample *sample = &filling->samples[filling->count];
    ++filling->count;
    *sample = sample_of(tick, tracking, joint, design);
    tracking->yaw_rate = tick->yaw_rate;
    tracking->lateral_acceleration = (double)sample->lateral_acceleration;
    follow_best(joint, tracking, design, sample);
    const bool continues = sample->in_second > 0;
    tracking->curvature_sum = continues ? tracking->curvature_sum + sample->curvature : sample->curvature;
    tracking->suspected = tick->suspected || (continues && tracking->suspected);
    if (ends_second(sample, design)) {
        filling->suspected = tracking->suspected;
        filling->curvature = tracking->curvature_sum / (float)design->samples_per_second;
    }
    tracking->in_second = tick->usable && !ends_second(sample, design) ? tracking->in_second + 1 : 0;
    return filling->count == design->samples_per_second;
}

/* Weight of a tick in the bank of the play's load. The play's clamps rectify noise, so noise is averaged longer. */
static double load_share_of(const oc_joint *joint, const oc_joint_design *design) {
    const float noise = oc_noise_in_mean(&joint->second.noise, OC_NOISE_OF_ACCELERATION);
    const float time_s = oc_clamp(noise / (2.0f * load_noise * load_noise), (float)bank_filter_s, load_bank_s_max);
    return design->tick_s / (double)time_s;
}

bool oc_joint_collect(oc_joint *joint, oc_joint_tracking *tracking, const oc_joint_design *design,
                      const oc_joint_tick *tick) {
    const double bank = tick->lateral_acceleration - tick->yaw_rate * tick->speed;
    bool is_whole = false;
    if (!tracking->running) {
        begin_collecting(joint, tracking, design, tick, bank);
    }
    if (joint->axle * tick->axle < 0) { /* lifted or put down: other axle loads, another equivalent wheelbase */
        oc_joint_change_load(joint);
    }
    joint->axle = tick->axle;
    tracking->turned += (float)(tick->yaw_rate * design->tick_s);
    tracking->bank += (bank - tracking->bank) * design->bank_share;
    tracking->load_bank += (bank - tracking->load_bank) * load_share_of(joint, design);
    if (joint->phase == 0) {
        is_whole = collect_sample(joint, tracking, design, tick, bank);
    }
    if (joint->phase + 2 >= design->ticks_per_sample) { /* one of the two ticks before a sample's */
        oc_noise_tick(&tracking->noise, tick->raw);
    }
    advance_phase(joint, design);
    return is_whole;
}

bool oc_joint_standstill(oc_joint *joint, oc_joint_tracking *tracking, const oc_joint_design *design) {
    if (!joint->started) {
        return false;
    }
    advance_phase(joint, design);
    tracking->running = 0;
    tracking->filling.count = 0;
    return tracking->due == 0 && joint->solves_all;
}

/* The minimum over the old hypotheses: an error that not all of them have is no change of the truck. A young one, or
 * one whose offset walks, may have adapted to the change already. */
static void note_min_error(const oc_joint *joint, oc_joint_tracking *tracking, const oc_hypothesis *h) {
    if (!h->walks && h->age > oc_joint_settled_s() && h->cost < joint->second.best_cost + (float)OC_JOINT_REJECT_COST &&
        fabsf(h->error) < fabsf(tracking->min_error)) {
        tracking->min_error = h->error;
    }
}

/* After the first minutes one second changes little. Then each hypothesis solves every few seconds, one on probation
 * twice as often. Half as often is 1.1 times as fast, but 2 of 12 wrong vehicle files have no name then
 * (tests/test_findings.py). */
static bool is_due(const oc_joint *joint, int32_t k) {
    const bool on_probation = oc_hypothesis_is_on_probation(&joint->hypotheses[k], &joint->second);
    const int32_t every = on_probation ? OC_JOINT_SECONDS_PER_SOLVING / 2 : OC_JOINT_SECONDS_PER_SOLVING;
    return joint->second.used_s < solve_all_until_s || (joint->in_long_block + k) % every == 0;
}

/* Adds the collected samples up to the end of a second of evidence. At most one ends among them. */
static void take_in(oc_joint *joint, oc_joint_tracking *tracking, const oc_joint_design *design, int32_t k) {
    oc_hypothesis *h = &joint->hypotheses[k];
    int32_t n = 0;
    bool ends = false;
    while (n < tracking->collected.count && !ends) {
        const oc_motion_sample *sample = &tracking->collected.samples[n];
        oc_hypothesis_sample(h, &design->hypothesis, sample);
        ends = ends_second(sample, design);
        ++n;
    }
    if (ends) {
        oc_hypothesis_predict(h, &design->hypothesis, &joint->second, design->samples_per_second);
        note_min_error(joint, tracking, h);
    }
    tracking->learned = ends && joint->second.learns;
    if (tracking->learned) {
        oc_hypothesis_take_in(h, &design->hypothesis, &joint->second, design->samples_per_second);
    }
    tracking->next = n;
}

static void solve(oc_joint *joint, oc_joint_tracking *tracking, const oc_joint_design *design, int32_t k) {
    if (tracking->solves_all || (tracking->learned && is_due(joint, k))) {
        oc_hypothesis_solve(&joint->hypotheses[k], &design->hypothesis, &tracking->prior, &joint->second,
                            &tracking->equations);
    }
}

/* Moves toward the solution, then adds the rest of the samples. */
static void move_on(oc_joint *joint, oc_joint_tracking *tracking, const oc_joint_design *design, int32_t k) {
    oc_hypothesis *h = &joint->hypotheses[k];
    if (tracking->learned && (tracking->solves_all || is_due(joint, k))) {
        oc_hypothesis_relinearise(h, &design->hypothesis);
    }
    for (int32_t n = tracking->next; n < tracking->collected.count; ++n) {
        oc_hypothesis_sample(h, &design->hypothesis, &tracking->collected.samples[n]);
    }
}

/* True when the round had evidence or a correction. */
static bool end_round(oc_joint *joint, oc_joint_tracking *tracking, const oc_joint_design *design,
                      const oc_estimate *last_offset, double time) {
    bool has_evidence = false;
    for (int32_t n = 0; n < tracking->collected.count; ++n) {
        const oc_motion_sample *sample = &tracking->collected.samples[n];
        if (sample->in_second >= 0 && joint->second.learns) { /* else no hypothesis has seen this load */
            count_flank_time(joint, design, sample);
        }
        has_evidence = has_evidence || ends_second(sample, design);
    }
    if (has_evidence) {
        const bool learned = joint->second.learns;
        watch_for_change(joint, tracking, last_offset, time);
        if (!tracking->collected.suspected) {
            count_outlying(joint, tracking, design);
        }
        if (learned) {
            oc_joint_end_second(joint, design);
        }
    }
    const oc_places *places = &joint->hypotheses[joint->best].places;
    tracking->wound = places->wound;
    tracking->inner = places->inner;
    for (int32_t n = 0; n < tracking->filling.count; ++n) {
        follow_best(joint, tracking, design, &tracking->filling.samples[n]);
    }
    return has_evidence || tracking->solves_all;
}

bool oc_joint_work(oc_joint *joint, oc_joint_tracking *tracking, const oc_joint_design *design,
                   const oc_estimate *last_offset, double time) {
    const int32_t done = 2 * joint->count + 1 - tracking->due;
    const int32_t k = done / 2;
    --tracking->due;
    if (done != 2 * k) {
        solve(joint, tracking, design, k);
        return false;
    }
    if (k > 0) {
        move_on(joint, tracking, design, k - 1);
    }
    if (k == joint->count) {
        return end_round(joint, tracking, design, last_offset, time);
    }
    take_in(joint, tracking, design, k);
    return false;
}

/* Weight of the second that ends among the samples: less in tight bends and at low speed. The curvature's noise is the
 * yaw rate's over the speed, and the ratio of the steering varies with the angle. */
static float weight_of(const oc_joint *joint, const oc_collected *collected, const oc_joint_design *design) {
    const float reference = joint->second.reference;
    const float bend = design->hypothesis.ratio_times_wheelbase * collected->curvature;
    const float by_bend = bend_error * bend * bend;
    const float per_yaw_rate = design->hypothesis.ratio_times_wheelbase * collected->samples[0].per_speed;
    const float yaw_rate_noise = oc_noise_in_mean(&joint->second.noise, OC_NOISE_OF_YAW_RATE);
    const float by_yaw_rate = per_yaw_rate * per_yaw_rate * yaw_rate_noise;
    return reference / (reference + by_bend * by_bend + by_yaw_rate);
}

void oc_joint_begin_round(oc_joint *joint, oc_joint_tracking *tracking, const oc_joint_design *design,
                          const oc_prior *prior) {
    tracking->prior = *prior;
    tracking->collected = tracking->filling;
    tracking->filling.count = 0;
    tracking->due = 2 * joint->count + 1;
    tracking->solves_all = joint->solves_all;
    tracking->min_error = 1e9f;
    tracking->loads_rare_flank = loads_rare_flank(joint, tracking, design);
    joint->second.weight = weight_of(joint, &tracking->collected, design);
    joint->second.learns = !tracking->collected.suspected && !is_suspected(joint);
    joint->solves_all = 0;
}

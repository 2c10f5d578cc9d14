#include "joint.h"

#include <math.h>
#include <stddef.h>

#include "bounds.h"
#include "joint_bank.h"

static const double sample_s = 0.1;
static const double side_force_s = 0.3; /* the accelerometer's noise is shorter; much longer, and what is late is K */
static const float first_error = 0.017453292f; /* rad, by which errors are judged before a second was learned from */

static const float busy_ticks = 10.0f; /* of a second, with the gyro's block and the end of a second */
static const float wind_speed = 20.0f; /* m/s, at which a wind acts as it is written */
static const float witness_s = 300.0f; /* hypotheses that still go their ways err, too */
static const float unplaced_s = 20.0f; /* after the wheel may be elsewhere in its play, errors tell of that */
static const float least_correction = 3.5e-5f; /* rad/s, 0.002 deg/s: a hundredth of a degree */

/* A flank of the play is seen where the side force is so clearly beyond friction. */
static const float clearly = 0.02f;                    /* m/s^2 */

/* The prior of a_0 holds in any case as if five times as wide: so far an accelerometer is off by itself, and who sees
 * nothing comes back. Where none tells the bank, bends show flanks that are none, and it holds as it is. */
static const float crown_doubt = 25.0f;

/* A truck whose tag axle is up turns as if it were so much shorter, and the axle resists no more; by so much less a
 * vehicle file may be off. */
static const float tag_axle_share = 0.15f;
static const float tag_axle_doubt = 0.10f;

/* Roads lean into their bends, by nothing in a town to two thirds of r*v on a motorway. */
static const float borne_in_bends = 0.7f;
static const float unseen_bank = 0.2f;                 /* m/s^2, that a side force may be less than it is taken for */

void oc_joint_setup(oc_joint_design *design, const oc_lowpass *lowpass, double rate_hz, double steering_ratio,
                    double ratio_times_wheelbase, float pull_sd, bool sees_bank, double memory_s) {
    const int32_t ticks = (int32_t)(sample_s * rate_hz + 0.5);
    const double step_s = ticks / rate_hz;
    oc_hypothesis_setup(&design->hypothesis, step_s, steering_ratio, ratio_times_wheelbase, pull_sd);
    oc_noise_setup(&design->noise, lowpass, rate_hz, ticks);
    design->rate_hz = rate_hz;
    design->tick_s = 1.0 / rate_hz;
    design->side_force_share = design->tick_s / side_force_s;
    design->borne = sees_bank ? 1.0f : borne_in_bends;
    design->unseen = sees_bank ? 0.0f : 1.0f;
    design->hypothesis.most_doubt = sees_bank ? crown_doubt : 1.0f;
    design->memory_s = (float)memory_s;
    design->ticks_per_sample = ticks;
    design->samples_per_second = (int32_t)(1.0 / step_s + 0.5);
    /* whole steps a tick; some ticks of a second are busy otherwise */
    const int32_t of_each = design->samples_per_second + 2 + OC_SOLVING_STEPS * OC_JOINT_STEP;
    const float steps = (float)(OC_JOINT_HYPOTHESES / OC_JOINT_STEP * of_each);
    design->work_per_tick = OC_JOINT_STEP * (1 + (int32_t)(steps / ((float)rate_hz - busy_ticks)));
}

/* The hypotheses themselves start when they take their first sample in. */
static void start(oc_joint *joint, const oc_joint_design *design) {
    joint->started = 1;
    joint->lost = 1;
    joint->count = OC_JOINT_HYPOTHESES;
    joint->corrected = joint->concluded = joint->loaded = joint->count;
    joint->second = (oc_second){
        .second_s = design->hypothesis.step_s * (float)design->samples_per_second,
        .memory_share = 1.0f,
        .trial_s = 60.0f,
        .reference = first_error * first_error,
        .learns = 1,
    };
}

/* After a standstill wheel and heading are as they were left, or nearly so. */
static void restart(oc_joint *joint, const oc_joint_design *design) {
    if (!joint->started) {
        start(joint, design);
    }
    if (joint->lost) {
        joint->lost = 0;
        joint->found = 0;
        joint->watch = (oc_change_watch){.rest = oc_most(joint->watch.rest, unplaced_s)};
        joint->along = 1.0f;
        joint->across = 0.0f;
    }
}

float oc_joint_tandem(const oc_joint *joint, const oc_joint_design *design) {
    const float down = (joint->hypotheses[joint->best].wheelbase + tag_axle_share) / tag_axle_doubt;
    return design->tandem * oc_within(down, 0.0f, 1.0f);
}

/* Turns the heading by so many rad, a small angle; a large one is no truck's, and the heading would grow for ever. */
static void turn_heading(oc_joint *joint, float angle) {
    const float squared = angle * angle;
    if (squared > 2.0f) {
        return;
    }
    const float cosine = 1.0f - 0.5f * squared, sine = angle - squared * angle / 6.0f;
    const float along = cosine * joint->along - sine * joint->across;
    const float across = sine * joint->along + cosine * joint->across;
    const float shortening = 1.5f - 0.5f * (along * along + across * across); /* or it would grow by rounding */
    joint->along = along * shortening;
    joint->across = across * shortening;
}

/* What the tyres carry. Turning says it with less noise than the accelerometer, which is needed for the bank alone. */
static oc_motion_sample sample_of(const oc_joint_tick *tick, const oc_joint_tracking *before, const oc_joint *joint,
                                  const oc_joint_design *design) {
    const double rate_hz = design->rate_hz;
    return (oc_motion_sample){
        .angle = tick->angle,
        .residual = (float)tick->residual,
        .lateral_acceleration = (float)((double)design->borne * tick->yaw_rate * tick->speed + before->bank),
        .yaw_acceleration = (float)((tick->yaw_rate - before->yaw_rate) * rate_hz),
        .jerk = (float)((tick->lateral_acceleration - before->lateral_acceleration) * rate_hz),
        .curvature = (float)tick->curvature,
        .per_speed = 1.0f / (float)(tick->speed > 1.0 ? tick->speed : 1.0),
        .tandem = oc_joint_tandem(joint, design) * (float)tick->curvature,
        .wind = {(float)tick->speed / wind_speed * joint->along, (float)tick->speed / wind_speed * joint->across},
        .usable = tick->usable,
    };
}

/* A correction goes to one hypothesis after the other, and to each once, whatever comes between. */
bool oc_joint_correct(oc_joint *joint, float rad_s, bool has_banks) {
    if (!joint->started || joint->corrected < joint->count || !(fabsf(rad_s) > least_correction)) {
        return false;
    }
    joint->correction = rad_s;
    joint->corrected = 0;
    joint->bank_mean += has_banks ? (double)rad_s * joint->speed_mean : 0.0;
    return true;
}

/* True where there was anything to set right. A correction that began while samples were taken in waits for the first
 * hypothesis's turn. */
static bool correct_hypothesis(oc_joint *joint, int32_t k, const oc_joint_design *design) {
    if (k != joint->corrected) {
        return false;
    }
    joint->corrected = k + 1;
    if (!(joint->second.used_s > 0.0f)) {
        return false;
    }
    oc_hypothesis_correct(&joint->hypotheses[k], &design->hypothesis, joint->correction);
    joint->concluded = 0;
    return true;
}

static void turn_phase(oc_joint *joint, const oc_joint_design *design) {
    joint->phase = joint->phase + 1 < design->ticks_per_sample ? joint->phase + 1 : 0;
}

void oc_joint_stand(oc_joint *joint, oc_joint_tracking *tracking, const oc_joint_design *design,
                    const oc_prior *prior) {
    if (!joint->started) {
        return;
    }
    if (!tracking->stands) {
        *tracking = (oc_joint_tracking){0};
        tracking->stands = 1;
    }
    turn_phase(joint, design);
    oc_solving *solving = &tracking->work.solving;
    solving->due = 1;
    if (joint->corrected < joint->count) { /* a tick's work */
        for (int32_t k = 0; k < joint->count; ++k) {
            (void)correct_hypothesis(joint, k, design);
        }
        solving->step = 0; /* it begins with the first again: what was half solved may be another's */
    } else if (joint->concluded < joint->count &&
               oc_hypothesis_learn(&joint->hypotheses[joint->concluded], &design->hypothesis, prior, &joint->second,
                                   design->samples_per_second, solving)) {
        solving->step = 0;
        ++joint->concluded;
    }
}

static void see_flank(oc_joint *joint, const oc_joint_design *design, const oc_motion_sample *sample) {
    const oc_hypothesis *best = &joint->hypotheses[joint->best];
    const float load = oc_play_load(&best->play, sample);
    const float friction = oc_most(best->play.friction, 0.0f);
    const float beyond = clearly + unseen_bank * design->unseen + friction + sqrtf(best->variances.of[OC_OF_UNLOADING]);
    const float step_s = design->hypothesis.step_s;
    joint->to_left += load > beyond ? step_s : 0.0f;
    joint->to_right += load < -beyond ? step_s : 0.0f;
}

/* Errors of what was foretold are watched once there is something to doubt. */
static void watch(oc_joint *joint, const oc_joint_tick *tick, float least_error, float samples) {
    const oc_hypothesis *best = &joint->hypotheses[joint->best];
    if (!(best->age > witness_s)) {
        joint->second.learns = 1;
        return;
    }
    const float curvature = oc_hypothesis_turned(best) / samples;
    const oc_change change =
        oc_change_update(&joint->watch, best->error, least_error, sqrtf(joint->second.reference), curvature);
    joint->second.learns = !oc_change_suspected(&joint->watch);
    if (change.kind == OC_CHANGE_NONE) {
        return;
    }
    oc_joint_note_change(joint, &change, tick->told, tick->time - change.seconds);
}

/* What a usable sample says whatever the hypotheses make of it. */
static void average(oc_joint *joint, const oc_joint_design *design, double speed, double bank) {
    const double memory = 10.0 * (double)design->memory_s;
    joint->bank_samples += joint->bank_samples < memory ? 1.0 : 0.0;
    joint->bank_mean += (bank - joint->bank_mean) / joint->bank_samples;
    joint->speed_mean += (speed - joint->speed_mean) / joint->bank_samples;
}

static oc_joint_waiting *waiting_at(oc_joint_tracking *tracking, int32_t k) {
    const int32_t place = tracking->first + k;
    return &tracking->waiting[place < OC_JOINT_WAITING ? place : place - OC_JOINT_WAITING];
}

/* The samples that wait, as far as the first that ends a second. Where the gate is shut no second will end that shows
 * what a correction has changed. False where none waits. */
static bool begin_work(const oc_joint *joint, oc_joint_tracking *tracking) {
    oc_joint_work *work = &tracking->work;
    int32_t samples = 0;
    const oc_joint_waiting *last = NULL;
    while (samples < tracking->count && (last == NULL || !last->ends_second)) {
        last = waiting_at(tracking, samples);
        ++samples;
    }
    if (last == NULL) {
        return false;
    }
    const bool learns = last->ends_second && joint->second.learns;
    work->samples = samples;
    work->turn = work->taken = work->solved = 0;
    work->least_error = 1e9f;
    work->solves = learns || (joint->concluded < joint->count && (last->ends_second || !last->sample.usable));
    work->solving.step = 0;
    work->solving.learns = learns;
    return true;
}

/* What a hypothesis hears of before it takes its next sample in: that it starts, that the wheel was lost, another load,
 * another bias. Returns how many samples' time that took. */
static int32_t prepare(oc_joint *joint, int32_t k, double angle, const oc_joint_design *design) {
    oc_hypothesis *h = &joint->hypotheses[k];
    const bool starts = k >= joint->begun, restarts = k >= joint->found, loads = k >= joint->loaded;
    if (starts) {
        const oc_play play = oc_joint_start_of(k);
        oc_hypothesis_start(h, &play, angle);
        joint->begun = k + 1;
    } else if (restarts) {
        oc_hypothesis_restart(h, angle);
    }
    joint->found = restarts ? k + 1 : joint->found;
    if (loads) {
        oc_hypothesis_loaded(h);
        joint->loaded = k + 1;
    }
    const bool corrected = correct_hypothesis(joint, k, design);
    if (starts || loads) {
        return OC_JOINT_STEP - 1;
    }
    return restarts || corrected ? 1 : 0;
}

/* What surprises one hypothesis only is its own mistake, and no change of the truck. Who began lately goes along with
 * one, and is no witness. */
static void note_error(const oc_joint *joint, oc_joint_work *work, const oc_hypothesis *h) {
    if (h->age > witness_s && h->cost < joint->second.best_cost + (float)OC_JOINT_HOPELESS &&
        fabsf(h->error) < fabsf(work->least_error)) {
        work->least_error = h->error;
    }
}

/* One more hypothesis takes one more of the samples in. Returns how many that took as long as: to end a second with it
 * takes longer. */
static int32_t take_in(oc_joint *joint, oc_joint_tracking *tracking, const oc_joint_design *design) {
    oc_joint_work *work = &tracking->work;
    const int32_t k = work->turn;
    oc_hypothesis *h = &joint->hypotheses[k];
    const oc_joint_waiting *waiting = waiting_at(tracking, work->taken);
    int32_t took = 1;
    if (k >= joint->begun || k >= joint->found || k >= joint->loaded || k >= joint->corrected) {
        took += prepare(joint, k, waiting->sample.angle, design);
    }
    oc_hypothesis_sample(h, &design->hypothesis, &waiting->sample, waiting->begins_second != 0);
    if (waiting->ends_second) {
        oc_hypothesis_foretell(h, &design->hypothesis, &joint->second, design->samples_per_second);
        note_error(joint, work, h);
        took += 2;
    }
    if (++work->taken >= work->samples) {
        work->taken = 0;
        ++work->turn;
    }
    return took;
}

/* All hypotheses have the samples, and have learned where they ended a second. */
static void end_work(oc_joint *joint, oc_joint_tracking *tracking, const oc_joint_design *design,
                     const oc_joint_tick *tick) {
    oc_joint_work *work = &tracking->work;
    const bool ends_second = waiting_at(tracking, work->samples - 1)->ends_second != 0;
    const bool concluded = work->solves != 0;
    for (int32_t k = 0; k < work->samples; ++k) {
        const oc_motion_sample *sample = &waiting_at(tracking, k)->sample;
        if (sample->usable) {
            see_flank(joint, design, sample);
        }
    }
    tracking->first = (tracking->first + work->samples) % OC_JOINT_WAITING;
    tracking->count -= work->samples;
    joint->concluded = concluded ? joint->count : joint->concluded;
    work->samples = 0;
    if (ends_second) {
        const bool learned = joint->second.learns;
        watch(joint, tick, work->least_error, (float)design->samples_per_second);
        if (learned) {
            oc_joint_turn_second(joint, design);
        }
    }
    work->ended = ends_second || concluded;
}

/* After the first minutes a second is little: then only every few of them have equations solved, each hypothesis in
 * other seconds; more often of one that still finds its way, before its word counts. */
static bool is_due(const oc_joint *joint, int32_t k) {
    static const float begins_s = 120.0f;
    const bool newborn = oc_hypothesis_is_newborn(&joint->hypotheses[k], &joint->second);
    const int32_t every = newborn ? OC_JOINT_SECONDS_PER_SOLVING / 2 : OC_JOINT_SECONDS_PER_SOLVING;
    return joint->second.used_s < begins_s || joint->concluded < joint->count ||
           (joint->in_long_block + k) % every == 0;
}

static void solve_on(oc_joint *joint, oc_joint_tracking *tracking, const oc_joint_design *design) {
    oc_joint_work *work = &tracking->work;
    if (work->solving.step == 0) {
        work->solving.due = is_due(joint, work->solved);
    }
    if (oc_hypothesis_learn(&joint->hypotheses[work->solved], &design->hypothesis, &tracking->prior, &joint->second,
                            design->samples_per_second, &work->solving)) {
        work->solving.step = 0;
        ++work->solved;
    }
}

/* A tick's share of what is to be done. The end of a second has a tick of its own, and so has what whoever called makes
 * of it: true then. */
static bool work_on(oc_joint *joint, oc_joint_tracking *tracking, const oc_joint_design *design,
                     const oc_joint_tick *tick, int32_t share) {
    oc_joint_work *work = &tracking->work;
    int32_t left = share;
    if (work->ended) {
        work->ended = 0;
        return true;
    }
    while (left > 0) {
        if (work->samples == 0 && !begin_work(joint, tracking)) {
            return false;
        }
        if (work->turn < joint->count) {
            left -= take_in(joint, tracking, design);
        } else if (work->solves && work->solved < joint->count) {
            if (left < OC_JOINT_STEP && left < share) {
                return false;
            }
            solve_on(joint, tracking, design);
            left -= OC_JOINT_STEP;
        } else if (left == design->work_per_tick) { /* none of it is done, and no sample was taken */
            end_work(joint, tracking, design, tick);
            return false;
        } else if (work->solves || waiting_at(tracking, work->samples - 1)->ends_second) {
            return false;
        } else {
            end_work(joint, tracking, design, tick);
        }
    }
    return false;
}

/* The sample at this tick waits behind the others. */
static void take_sample(oc_joint *joint, oc_joint_tracking *tracking, const oc_joint_design *design,
                        const oc_joint_tick *tick, double bank) {
    float share = 0.0f;
    if (tick->usable) {
        average(joint, design, tick->speed, tracking->bank);
        share = 1.0f / (float)joint->bank_samples;
    }
    const float filtered[OC_NOISY] = {(float)bank, (float)tick->yaw_rate};
    oc_noise_update(&joint->second.noise, &tracking->noise, &design->noise, filtered, tick->raw, share);
    turn_heading(joint, tracking->turned);
    tracking->turned = 0.0f;
    const bool begins = tracking->in_second == 0;
    tracking->in_second = tick->usable ? tracking->in_second + 1 : 0;
    const bool ends = tracking->in_second == design->samples_per_second;
    tracking->in_second = ends ? 0 : tracking->in_second;
    oc_joint_waiting *waiting = waiting_at(tracking, tracking->count);
    waiting->sample = sample_of(tick, tracking, joint, design);
    waiting->begins_second = begins;
    waiting->ends_second = ends;
    ++tracking->count;
    if (ends || !tick->usable) { /* equations may be solved */
        tracking->prior_due = 1;
    }
}

bool oc_joint_update(oc_joint *joint, oc_joint_tracking *tracking, const oc_joint_design *design,
                     const oc_joint_tick *tick) {
    const double bank = tick->lateral_acceleration - tick->yaw_rate * tick->speed;
    bool concluded = false;
    const bool begins = !tracking->running;
    if (begins) {
        const oc_prior prior = tracking->prior;
        restart(joint, design);
        *tracking = (oc_joint_tracking){0};
        tracking->running = 1;
        tracking->prior = prior;
        tracking->bank = bank;
        tracking->yaw_rate = tick->yaw_rate;
        tracking->lateral_acceleration = tick->lateral_acceleration;
    }
    tracking->turned += (float)(tick->yaw_rate * design->tick_s);
    tracking->bank += (bank - tracking->bank) * design->side_force_share;
    if (joint->phase == 0) {
        while (tracking->count == OC_JOINT_WAITING) { /* the share is such that it never comes so far */
            concluded = work_on(joint, tracking, design, tick, design->work_per_tick) || concluded;
        }
        take_sample(joint, tracking, design, tick, bank);
    }
    if (joint->phase + 2 >= design->ticks_per_sample) { /* one of the two before a sample's */
        oc_noise_tick(&tracking->noise, tick->raw);
    }
    const int32_t share = design->work_per_tick - (joint->phase == 0 ? 1 : 0); /* a sample taken is work, too */
    turn_phase(joint, design);
    if (!tick->busy && !begins) {
        concluded = work_on(joint, tracking, design, tick, share) || concluded;
    }
    tracking->yaw_rate = tick->yaw_rate;
    tracking->lateral_acceleration = tick->lateral_acceleration;
    return concluded;
}

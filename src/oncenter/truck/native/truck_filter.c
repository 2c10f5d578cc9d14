#include "truck_filter.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum {
    N = TRUCK_STATES,
    S = TRUCK_SEEN,
    STATED_SIZE = TRUCK_CHANGE_COUNT, /* a change of the offset by a stated size */
    WAYS = 2 * (STATED_SIZE + 1) * TRUCK_MODES, /* on from a history, by one drive, at most */
    CHOSEN = 2 * TRUCK_KEPT
};

/* Derived. */
static const double log_two_pi = 1.8378770664093453;

/* Tuned, in tuned.toml: truck_filter */
static const double negligible = 12.0; /* log weight below the best history's, from which a history is discarded */
static const double alike = 0.25; /* squared distance over variance, below which two histories become one */
/* log weight below the best history's by the banks, from which only a stated change is tried */
static const double changes_from = 7.0;
static const double as_stated = 0.9; /* probability that a stated size was stored once and with the right sign */
/* end */

/* A way on from a history: what changed, the mode of the drive, and whether the drive is wrong. */
typedef struct {
    double log_weight;
    int32_t from, change, mode;
    bool wrong;
} way;

/* How the drive depends on the state, and what is expected of it. */
typedef struct {
    double of_state[TRUCK_SEEN][TRUCK_STATES]; /* covariance with the state */
    double mean[TRUCK_SEEN];
    double covariance[TRUCK_SEEN][TRUCK_SEEN];
} expected;

/* exp of a normal density's weight, and what the update needs. */
typedef struct {
    double log_weight;
    double vector[TRUCK_SEEN];
    double information[TRUCK_SEEN][TRUCK_SEEN];
} innovation;

typedef struct {
    double row[TRUCK_SEEN][TRUCK_STATES];
} view;

static view view_of(const truck_drive *drive) {
    view v;
    memset(&v, 0, sizeof v);
    v.row[TRUCK_SEEN_OFFSET][TRUCK_OFFSET] = 1.0;
    v.row[TRUCK_SEEN_OFFSET][TRUCK_PULL] = drive->per_pull;
    v.row[TRUCK_SEEN_OFFSET][TRUCK_CROWN] = drive->per_crown;
    v.row[TRUCK_SEEN_OFFSET][TRUCK_STEER] = drive->load;
    v.row[TRUCK_SEEN_OFFSET][TRUCK_STEER_BENT] = drive->load_bent;
    v.row[TRUCK_SEEN_PLAY][TRUCK_PLAY] = 1.0;
    v.row[TRUCK_SEEN_NEUTRAL][TRUCK_BIAS] = 1.0;
    v.row[TRUCK_SEEN_NEUTRAL][TRUCK_PULL] = 1.0;
    return v;
}

static double log_sum(double a, double b) {
    const double high = a > b ? a : b, low = a > b ? b : a;
    return high + log1p(exp(low - high));
}

/* Kalman update by a reading of the bias and the region's crown. */
static void read_bank(truck_history *h, const truck_bank *bank) {
    if (!(bank->variance > 0.0)) {
        return;
    }
    double gain[TRUCK_STATES];
    for (int32_t k = 0; k < N; ++k) {
        gain[k] = h->covariance[N * k + TRUCK_BIAS] + bank->per_crown * h->covariance[N * k + TRUCK_CROWN];
    }
    const double spread = gain[TRUCK_BIAS] + bank->per_crown * gain[TRUCK_CROWN] + bank->variance;
    const double error = bank->value - h->mean[TRUCK_BIAS] - bank->per_crown * h->mean[TRUCK_CROWN];
    h->log_weight -= 0.5 * (error * error / spread + log(spread) + log_two_pi);
    for (int32_t k = 0; k < N; ++k) {
        h->mean[k] += gain[k] * error / spread;
        for (int32_t j = 0; j < N; ++j) {
            h->covariance[N * k + j] -= gain[k] * gain[j] / spread;
        }
    }
}

static void renew(truck_history *h, int32_t state, double mean, double variance) {
    for (int32_t k = 0; k < N; ++k) {
        h->covariance[N * state + k] = 0.0;
        h->covariance[N * k + state] = 0.0;
    }
    h->mean[state] = mean;
    h->covariance[N * state + state] = variance;
}

static bool has_new_offset(int32_t change) {
    return change != TRUCK_CHANGE_NONE && change != TRUCK_CHANGE_PLAY;
}

static bool has_new_play(int32_t change) {
    return change == TRUCK_CHANGE_PLAY || change == TRUCK_CHANGE_BOTH || change == TRUCK_CHANGE_ALL;
}

/* The state after a change before this drive, which is not the first one. */
static void apply(truck_history *h, int32_t change, const truck_drive *drive, const truck_priors *priors) {
    if (change == STATED_SIZE) {
        h->mean[TRUCK_OFFSET] += drive->stated_by;
        h->covariance[N * TRUCK_OFFSET + TRUCK_OFFSET] += drive->stated_by_sd * drive->stated_by_sd;
        return;
    }
    if (h->zero == TRUCK_ZERO_RELATIVE) {
        renew(h, TRUCK_OFFSET, 0.0, priors->relative_variance);
    } else if (has_new_offset(change)) {
        renew(h, TRUCK_OFFSET, 0.0, priors->new_variance);
    }
    if (change == TRUCK_CHANGE_ALIGNMENT || change == TRUCK_CHANGE_ALL) {
        renew(h, TRUCK_PULL, priors->mean[TRUCK_PULL], priors->variant_pull[h->variant]);
    }
    if (has_new_play(change)) {
        renew(h, TRUCK_PLAY, priors->mean[TRUCK_PLAY], priors->variance[TRUCK_PLAY]);
    }
}

static double probability_of(int32_t change, const truck_drive *drive, const truck_priors *priors) {
    return 1.0 - exp(-priors->changes_per_day[change] * drive->days);
}

/* The probability of a change of a history's truck before this drive; 0: it cannot be. */
static double prior_of(const truck_history *h, int32_t change, const truck_drive *drive, const truck_priors *priors) {
    const bool is_stated = drive->stated != TRUCK_CHANGE_NONE;
    const bool sized = drive->stated_by_sd > 0.0;
    if (is_stated && change == drive->stated) {
        return drive->stated_share * (sized ? 1.0 - as_stated : 1.0);
    }
    if (change == STATED_SIZE) {
        return is_stated && sized ? drive->stated_share * as_stated : 0.0;
    }
    if (change != TRUCK_CHANGE_NONE) {
        const bool is_hidden = h->zero != TRUCK_ZERO_FIXED && has_new_offset(change);
        return is_stated || is_hidden ? 0.0 : probability_of(change, drive, priors);
    }
    double left = is_stated ? 1.0 - drive->stated_share : 1.0;
    for (int32_t k = TRUCK_CHANGE_OFFSET; k < TRUCK_CHANGE_COUNT && !is_stated; ++k) {
        left -= probability_of(k, drive, priors);
    }
    return left > 0.0 ? left : 0.0;
}

static void age(truck_history *h, const truck_drive *drive, const truck_priors *priors) {
    const double days = drive->days < 1.0 ? drive->days : 1.0;
    for (int32_t k = 0; k < N; ++k) {
        h->covariance[N * k + k] += days * priors->at_ignition[k] + drive->days * priors->per_day[k];
    }
    h->covariance[N * TRUCK_OFFSET + TRUCK_OFFSET] += h->zero == TRUCK_ZERO_MOVES ? days * priors->moves_variance : 0.0;
}

static expected expect(const truck_history *h, const view *v, const truck_drive *drive) {
    expected e;
    for (int32_t s = 0; s < S; ++s) {
        e.mean[s] = 0.0;
        for (int32_t k = 0; k < N; ++k) {
            e.mean[s] += v->row[s][k] * h->mean[k];
            e.of_state[s][k] = 0.0;
            for (int32_t j = 0; j < N; ++j) {
                e.of_state[s][k] += v->row[s][j] * h->covariance[N * j + k];
            }
        }
    }
    for (int32_t s = 0; s < S; ++s) {
        for (int32_t r = 0; r < S; ++r) {
            e.covariance[s][r] = s == r ? drive->noise[s] : 0.0;
            for (int32_t k = 0; k < N; ++k) {
                e.covariance[s][r] += e.of_state[s][k] * v->row[r][k];
            }
        }
    }
    return e;
}

/* The same of a drive whose offset and play are wrong. */
static expected if_wrong(const expected *usual, const truck_priors *priors) {
    expected e = *usual;
    e.covariance[TRUCK_SEEN_OFFSET][TRUCK_SEEN_OFFSET] += priors->wrong_variance[TRUCK_SEEN_OFFSET];
    e.covariance[TRUCK_SEEN_PLAY][TRUCK_SEEN_PLAY] += priors->wrong_variance[TRUCK_SEEN_PLAY];
    return e;
}

/* With covariance C and the mode's information L: F = (I + L C)^-1, information F L, vector F (vector - L mean). */
static innovation innovation_of(const expected *e, const truck_mode *mode) {
    double L[3][3], A[3][3], F[3][3], apart[3], moved[3];
    for (int32_t s = 0, k = 0; s < S; ++s) {
        for (int32_t r = 0; r <= s; ++r, ++k) {
            L[s][r] = L[r][s] = mode->information[k];
        }
    }
    for (int32_t s = 0; s < S; ++s) {
        apart[s] = mode->vector[s];
        for (int32_t r = 0; r < S; ++r) {
            apart[s] -= L[s][r] * e->mean[r];
            A[s][r] = s == r ? 1.0 : 0.0;
            for (int32_t k = 0; k < S; ++k) {
                A[s][r] += L[s][k] * e->covariance[k][r];
            }
        }
    }
    for (int32_t s = 0; s < S; ++s) {
        const int32_t a = (s + 1) % 3, b = (s + 2) % 3;
        for (int32_t r = 0; r < S; ++r) {
            const int32_t c = (r + 1) % 3, d = (r + 2) % 3;
            F[r][s] = A[a][c] * A[b][d] - A[a][d] * A[b][c];
        }
    }
    const double determinant = A[0][0] * F[0][0] + A[0][1] * F[1][0] + A[0][2] * F[2][0];
    innovation found;
    for (int32_t s = 0; s < S; ++s) {
        found.vector[s] = 0.0;
        for (int32_t r = 0; r < S; ++r) {
            found.vector[s] += F[s][r] / determinant * apart[r];
            found.information[s][r] = 0.0;
            for (int32_t k = 0; k < S; ++k) {
                found.information[s][r] += F[s][k] / determinant * L[k][r];
            }
        }
    }
    double squares = 0.0;
    for (int32_t s = 0; s < S; ++s) {
        moved[s] = 0.0;
        for (int32_t r = 0; r < S; ++r) {
            moved[s] += e->covariance[s][r] * found.vector[r];
        }
        squares += 0.5 * apart[s] * moved[s] + e->mean[s] * (mode->vector[s] + apart[s]) * 0.5;
    }
    found.log_weight = mode->log_weight + squares - 0.5 * log(determinant);
    return found;
}

static void update(truck_history *h, const expected *e, const innovation *i) {
    double weighted[3][TRUCK_STATES];
    for (int32_t s = 0; s < S; ++s) {
        for (int32_t k = 0; k < N; ++k) {
            weighted[s][k] = 0.0;
            for (int32_t r = 0; r < S; ++r) {
                weighted[s][k] += i->information[s][r] * e->of_state[r][k];
            }
        }
    }
    for (int32_t k = 0; k < N; ++k) {
        for (int32_t s = 0; s < S; ++s) {
            h->mean[k] += e->of_state[s][k] * i->vector[s];
            for (int32_t j = 0; j < N; ++j) {
                h->covariance[N * k + j] -= e->of_state[s][k] * weighted[s][j];
            }
        }
    }
}

/* The offset by the pull; 0 of a pull that is configured exactly. */
static double per_pull_of(const truck_history *h) {
    const double variance = h->covariance[N * TRUCK_PULL + TRUCK_PULL];
    return variance > 0.0 ? h->covariance[N * TRUCK_OFFSET + TRUCK_PULL] / variance : 0.0;
}

/* The offset before it, as read at the usual pull: an unknown pull is in it before and after. */
static void note_change(truck_history *h, int32_t change, int32_t drive, const truck_priors *priors) {
    if (change == TRUCK_CHANGE_NONE) {
        return;
    }
    const double per_pull = per_pull_of(h);
    if (h->changes == TRUCK_CHANGES) {
        memmove(h->change, h->change + 1, sizeof h->change - sizeof h->change[0]);
        --h->changes;
    }
    h->change[h->changes++] = (truck_change){
        .drive = drive,
        .kind = change == STATED_SIZE ? TRUCK_CHANGE_OFFSET : change,
        .before = h->mean[TRUCK_OFFSET] + per_pull * (priors->mean[TRUCK_PULL] - h->mean[TRUCK_PULL]),
        .before_variance = h->covariance[N * TRUCK_OFFSET + TRUCK_OFFSET] -
                           per_pull * h->covariance[N * TRUCK_OFFSET + TRUCK_PULL],
        .play_before = h->mean[TRUCK_PLAY],
        .play_before_variance = h->covariance[N * TRUCK_PLAY + TRUCK_PLAY],
    };
    h->offset_since = has_new_offset(change) ? drive : h->offset_since;
    h->play_since = has_new_play(change) ? drive : h->play_since;
}

static int more_probable(const void *a, const void *b) {
    const double apart = ((const way *)b)->log_weight - ((const way *)a)->log_weight;
    return apart > 0.0 ? 1 : apart < 0.0 ? -1 : 0;
}

static int heavier(const void *a, const void *b) {
    const double apart = ((const truck_history *)b)->log_weight - ((const truck_history *)a)->log_weight;
    return apart > 0.0 ? 1 : apart < 0.0 ? -1 : 0;
}

static bool are_alike(const truck_history *a, const truck_history *b) {
    if (a->zero != b->zero || a->variant != b->variant || a->offset_since != b->offset_since ||
        a->play_since != b->play_since) {
        return false;
    }
    double distance = 0.0;
    for (int32_t k = 0; k <= TRUCK_BIAS; ++k) {
        const double apart = a->mean[k] - b->mean[k];
        const double one = a->covariance[N * k + k], other = b->covariance[N * k + k];
        if (fmax(one, other) > 2.0 * fmin(one, other)) {
            return false; /* a wide one of little weight would widen the other */
        }
        distance += apart * apart / (one + other);
    }
    return distance < alike;
}

/* The mean and covariance of both; the changes of the more probable one. */
static void join(truck_history *to, const truck_history *from) {
    const double total = log_sum(to->log_weight, from->log_weight);
    const double share = exp(from->log_weight - total);
    double apart[TRUCK_STATES];
    for (int32_t k = 0; k < N; ++k) {
        apart[k] = from->mean[k] - to->mean[k];
    }
    for (int32_t k = 0; k < N; ++k) {
        to->mean[k] += share * apart[k];
        for (int32_t j = 0; j < N; ++j) {
            double *covariance = &to->covariance[N * k + j];
            *covariance += share * (from->covariance[N * k + j] - *covariance);
            *covariance += share * (1.0 - share) * apart[k] * apart[j];
        }
    }
    to->log_weight = total;
}

/* Weights sum to 1; the log of their sum is added to the likelihood. */
static void normalise(truck_histories *all) {
    double total = all->history[0].log_weight;
    for (int32_t k = 1; k < all->count; ++k) {
        total = log_sum(total, all->history[k].log_weight);
    }
    all->log_likelihood += total;
    for (int32_t k = 0; k < all->count; ++k) {
        all->history[k].log_weight -= total;
    }
}

/* Keeps the most probable histories, alike ones as one. */
static void keep(truck_histories *all, truck_history *some, int32_t count) {
    qsort(some, (size_t)count, sizeof some[0], heavier);
    all->count = 0;
    for (int32_t k = 0; k < count; ++k) {
        int32_t same = 0;
        while (same < all->count && !are_alike(&all->history[same], &some[k])) {
            ++same;
        }
        if (same < all->count) {
            join(&all->history[same], &some[k]);
        } else if (all->count < TRUCK_KEPT) {
            all->history[all->count++] = some[k];
        }
    }
    qsort(all->history, (size_t)all->count, sizeof all->history[0], heavier);
    normalise(all);
}

static void begin(truck_histories *all, const truck_priors *priors) {
    memset(all, 0, sizeof *all);
    for (int32_t zero = 0; zero < TRUCK_ZERO_COUNT; ++zero) {
        for (int32_t variant = 0; variant < TRUCK_VARIANTS; ++variant) {
            double share = priors->zero_probability[zero];
            if (zero == TRUCK_ZERO_FIXED) {
                share *= priors->variant_probability[variant];
            } else if (variant > 0) { /* a zero that differs hides what a load does */
                share = 0.0;
            }
            if (!(share > 0.0)) {
                continue;
            }
            truck_history *h = &all->history[all->count++];
            h->log_weight = log(share);
            h->zero = zero;
            h->variant = variant;
            for (int32_t k = 0; k < N; ++k) {
                renew(h, k, priors->mean[k], priors->variance[k]);
            }
            renew(h, TRUCK_STEER, 0.0, priors->variant_steer[variant]);
            renew(h, TRUCK_STEER_BENT, 0.0, priors->variant_steer[variant]);
            renew(h, TRUCK_PULL, priors->mean[TRUCK_PULL], priors->variant_pull[variant]);
        }
    }
}

/* The histories before a drive's evidence: aged, and with its readings of the bank. The log of the largest weight. */
static double prepare(truck_histories *all, const truck_drive *drive, int32_t place, const truck_priors *priors) {
    double best = -INFINITY;
    for (int32_t k = 0; k < all->count; ++k) {
        truck_history *h = &all->history[k];
        if (place > 0) {
            age(h, drive, priors);
        }
        read_bank(h, &drive->driving);
        read_bank(h, &drive->standing);
        best = fmax(best, h->log_weight);
    }
    return best;
}

/* The histories with one more drive. */
static void take(truck_histories *all, const truck_drive *drive, int32_t place, const truck_priors *priors) {
    static const int32_t changes = STATED_SIZE + 1;
    const view v = view_of(drive);
    way ways[TRUCK_KEPT * WAYS] = {{0}};
    int32_t count = 0;
    const double best = prepare(all, drive, place, priors);
    for (int32_t from = 0; from < all->count; ++from) {
        const truck_history *h = &all->history[from];
        for (int32_t change = 0; change < (place > 0 ? changes : 1); ++change) {
            const double prior = place > 0 ? prior_of(h, change, drive, priors) : 1.0;
            const bool is_usual = change == TRUCK_CHANGE_NONE || drive->stated != TRUCK_CHANGE_NONE;
            if (!(prior > 0.0) || (!is_usual && h->log_weight < best - changes_from)) {
                continue;
            }
            truck_history changed;
            memcpy(changed.mean, h->mean, sizeof h->mean);
            memcpy(changed.covariance, h->covariance, sizeof h->covariance);
            changed.zero = h->zero;
            changed.variant = h->variant;
            if (place > 0) {
                apply(&changed, change, drive, priors);
            }
            const expected e = expect(&changed, &v, drive);
            const double weight = h->log_weight + log(prior);
            const expected of_wrong = if_wrong(&e, priors);
            for (int32_t mode = 0; mode < drive->modes; ++mode) {
                const double of_mode = innovation_of(&e, &drive->mode[mode]).log_weight;
                ways[count++] = (way){weight + log1p(-drive->wrong) + of_mode, from, change, mode, false};
                if (is_usual) {
                    const double by_wrong = innovation_of(&of_wrong, &drive->mode[mode]).log_weight;
                    ways[count++] = (way){weight + log(drive->wrong) + by_wrong, from, change, mode, true};
                }
            }
        }
    }
    qsort(ways, (size_t)count, sizeof ways[0], more_probable);
    truck_history chosen[CHOSEN] = {{0}};
    int32_t kept = 0;
    for (; kept < count && kept < CHOSEN && ways[kept].log_weight > ways[0].log_weight - negligible; ++kept) {
        const way *on = &ways[kept];
        truck_history *h = &chosen[kept];
        *h = all->history[on->from];
        if (place > 0) {
            note_change(h, on->change, place, priors);
            apply(h, on->change, drive, priors);
        }
        if (h->zero == TRUCK_ZERO_RELATIVE) {
            h->offset_since = place;
        }
        const expected usual = expect(h, &v, drive);
        const expected e = on->wrong ? if_wrong(&usual, priors) : usual;
        const innovation i = innovation_of(&e, &drive->mode[on->mode]);
        update(h, &e, &i);
        h->log_weight = on->log_weight;
    }
    keep(all, chosen, kept);
}

void truck_run(truck_histories *histories, const truck_drive *drives, int32_t count, const truck_priors *priors) {
    begin(histories, priors);
    for (int32_t k = 0; k < count; ++k) {
        take(histories, &drives[k], k, priors);
    }
}

double truck_quantile(const double *weights, const double *means, const double *sds, int32_t count, double share) {
    double low = means[0], high = means[0];
    for (int32_t k = 0; k < count; ++k) {
        low = fmin(low, means[k] - 8.0 * sds[k]);
        high = fmax(high, means[k] + 8.0 * sds[k]);
    }
    for (int32_t halved = 0; halved < 50; ++halved) {
        const double middle = 0.5 * (low + high);
        double below = 0.0;
        for (int32_t k = 0; k < count; ++k) {
            below += 0.5 * weights[k] * erfc((means[k] - middle) / (1.4142135623730951 * sds[k]));
        }
        if (below < share) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return 0.5 * (low + high);
}

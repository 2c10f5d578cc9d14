#ifndef TRUCK_FILTER_H
#define TRUCK_FILTER_H
/* One truck over its drives: a mixture over what may have changed between them (docs/truck_over_time.md).
 *
 * A history is an assignment of changes to the times between drives, with a normal density of the truck's state given
 * them (Adams and MacKay 2007; Fearnhead and Liu 2007). SI and rad. */

#include <stdint.h>

/* The state of a truck. */
enum {
    TRUCK_OFFSET,     /* rad, at zero lateral acceleration and mid-play, less a pull */
    TRUCK_PLAY,       /* rad, with wind-up */
    TRUCK_BIAS,       /* m/s^2, of the accelerometer */
    TRUCK_PULL,       /* m/s^2 */
    TRUCK_CROWN,      /* m/s^2, of the region's roads, beyond the usual crown */
    TRUCK_STEER,      /* rad per load: steering by ride height */
    TRUCK_STEER_BENT, /* rad per load squared */
    TRUCK_STATES
};

/* What a drive's evidence is about. */
enum { TRUCK_SEEN_OFFSET, TRUCK_SEEN_PLAY, TRUCK_SEEN_NEUTRAL, TRUCK_SEEN };

enum {
    TRUCK_MODES = 4,   /* of a drive */
    TRUCK_KEPT = 20,   /* histories of a truck */
    TRUCK_CHANGES = 12, /* of a history, the last ones */
    TRUCK_VARIANTS = 3
};

/* What may change between two drives. */
typedef enum {
    TRUCK_CHANGE_NONE,
    TRUCK_CHANGE_OFFSET,    /* calibration, a remounted sensor */
    TRUCK_CHANGE_PLAY,      /* wear, adjustment */
    TRUCK_CHANGE_BOTH,      /* a repair of the steering */
    TRUCK_CHANGE_ALIGNMENT, /* offset and pull */
    TRUCK_CHANGE_ALL,       /* offset, play and pull: a repair with an alignment */
    TRUCK_CHANGE_COUNT
} truck_change_kind;

/* How the sensor's zero behaves. */
typedef enum { TRUCK_ZERO_FIXED, TRUCK_ZERO_MOVES, TRUCK_ZERO_RELATIVE, TRUCK_ZERO_COUNT } truck_zero;

/* exp(log_weight + vector' x - x' information x / 2) of x = TRUCK_SEEN; the information is a lower triangle by rows. */
typedef struct {
    double log_weight;
    double information[6];
    double vector[3];
} truck_mode;

/* A number that depends on the accelerometer's bias and the region's crown; variance 0: none. */
typedef struct {
    double value, variance, per_crown;
} truck_bank;

typedef struct {
    int32_t modes;
    int32_t stated;        /* TRUCK_CHANGE_: a person stated it before this drive, or the core found it in the drive */
    double stated_share;   /* probability that it is so */
    double stated_by;      /* rad, its size, of the offset */
    double stated_by_sd;   /* rad, of the size; 0: unknown size */
    truck_mode mode[TRUCK_MODES];
    truck_bank driving, standing;
    double days;           /* since the drive before */
    double per_pull;       /* rad/(m/s^2), of the offset */
    double per_crown;      /* rad/(m/s^2), of the offset by the region's crown where no accelerometer measures it */
    double load;           /* of this drive, in units of the scatter of loads */
    double load_bent;      /* its square, less the mean over the drives */
    double noise[3];       /* variances of TRUCK_SEEN beyond the drive's own */
    double wrong;          /* probability that its offset and play are wrong */
} truck_drive;

typedef struct {
    double mean[7], variance[7];             /* of the state before the first drive; of the offset and the play also
                                              * after a change */
    double at_ignition[7], per_day[7];       /* variances of what may have changed a little between two drives: after a
                                              * day, less after less time, and with each day */
    double changes_per_day[6];               /* rate of each change */
    double new_variance;                     /* rad^2, of the offset about 0 after a change */
    double variant_probability[3];           /* of trucks of three kinds, which differ by the next two */
    double variant_steer[3];                 /* rad^2, of steering by ride height */
    double variant_pull[3];                  /* (m/s^2)^2, of the pull */
    double zero_probability[3];              /* TRUCK_ZERO_ */
    double moves_variance;                   /* rad^2 from a day to the next, of a zero that moves */
    double wrong_variance[2];                /* rad^2, of offset and play of a wrong drive about those of the truck */
    double relative_variance;                /* rad^2, of a zero that differs at each start */
} truck_priors;

typedef struct {
    int32_t drive;         /* the first after the change */
    int32_t kind;
    double before, before_variance; /* rad, the offset before it, with the usual pull */
    double play_before, play_before_variance; /* rad */
} truck_change;

typedef struct {
    double log_weight;     /* sums to 1 over the histories */
    double mean[7];
    double covariance[49];
    int32_t zero, variant;
    int32_t offset_since, play_since; /* the drive from which the present offset and play hold */
    int32_t changes;
    truck_change change[12];
} truck_history;

typedef struct {
    int32_t count;
    double log_likelihood; /* of all drives */
    truck_history history[20];
} truck_histories;

/* The histories of a truck after `count` drives in order of time, the most probable first. */
void truck_run(truck_histories *histories, const truck_drive *drives, int32_t count, const truck_priors *priors);

/* The value below which a mixture of normal densities has this share, 0 to 1. The weights sum to 1. */
double truck_quantile(const double *weights, const double *means, const double *sds, int32_t count, double share);

#endif

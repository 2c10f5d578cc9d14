#ifndef OC_PAST_BIAS_H
#define OC_PAST_BIAS_H
/* How far off the yaw rates are that were used so far: from each the bias was taken off as it was believed then, and
 * what the filter learns later tells of it, too. A smoother in fixed memory: the mean error of those yaw rates is one
 * more state beside the filter's, which grows with each that is used, and has a covariance with all of them. */

enum { OC_GYRO_BIAS_STATES = 8 /* bias, drift; rear: mismatch, load, scale; front: the same */ };

typedef struct {
    float used_s;    /* of driving behind the mean, no more than */
    float memory_s;  /* how far back what was learned from them reaches; 0: for ever */
    float waiting_s; /* used since the filter was last predicted */
    float bias;      /* rad/s, by which they were corrected too little */
    float variance;
    float covariance[OC_GYRO_BIAS_STATES]; /* with the filter's states, the bias first */
} oc_past_bias;

/* What waits is taken into the mean; `of_bias` is the bias's row of the filter's covariance. */
void oc_past_bias_grow(oc_past_bias *past, const double *of_bias);

/* What a reading of the filter tells of the mean: `with` and `with_states` are the reading's covariances with the mean
 * and with the filter's states, `innovation` how far it was off, `per_variance` 1 over what that was to vary by. */
void oc_past_bias_correct(oc_past_bias *past, float with, const double *with_states, float innovation,
                          float per_variance);

/* rad/s, standard deviation of the mean; `otherwise` before any yaw rate was used. */
float oc_past_bias_sd(const oc_past_bias *past, float otherwise);

#endif

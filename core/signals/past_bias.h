#ifndef OC_PAST_BIAS_H
#define OC_PAST_BIAS_H
/* Mean error of the yaw rates used so far. Each was corrected by the bias estimate of its time, which later readings
 * improve. A smoother in fixed memory: the mean error is an additional state, with a covariance with each of the
 * filter's states. */

enum { OC_GYRO_BIAS_STATES = 8 /* bias, drift; rear: mismatch, load, scale; front: the same */ };

typedef struct {
    float used_s;    /* of driving in the mean, memory_s at most */
    float memory_s;  /* of the equations that used the yaw rates; 0: unlimited */
    float waiting_s; /* used since the filter's last prediction */
    float bias;      /* rad/s, mean error of the correction */
    float variance;
    float covariance[OC_GYRO_BIAS_STATES]; /* with the filter's states, the bias first */
} oc_past_bias;

/* Adds the waiting time to the mean; `of_bias`: the bias's row of the filter's covariance. */
void oc_past_bias_grow(oc_past_bias *past, const double *of_bias);

/* Corrects the mean by a reading of the filter. `with`, `with_states`: covariances of the reading with the mean and
 * with the filter's states; `per_variance`: 1 over the innovation's variance. */
void oc_past_bias_correct(oc_past_bias *past, float with, const double *with_states, float innovation,
                          float per_variance);

/* rad/s, standard deviation of the mean; `otherwise` before the first use of a yaw rate. */
float oc_past_bias_sd(const oc_past_bias *past, float otherwise);

#endif

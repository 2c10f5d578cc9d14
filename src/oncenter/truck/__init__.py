"""Common estimate of a truck's drives: one model over their summaries. No log is read again."""

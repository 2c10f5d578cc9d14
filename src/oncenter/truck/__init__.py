"""What a truck's drives say together: one model over their summaries. No log is read again."""

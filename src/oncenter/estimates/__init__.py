"""The numbers of an answer: estimates, changes, causes of uncertainty and the correction, with their findings."""

"""The core one tick at a time, and its results as messages on the bus."""

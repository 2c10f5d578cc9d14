"""The core a tick at a time, and its result as messages on the bus."""

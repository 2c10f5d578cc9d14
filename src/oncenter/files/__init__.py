"""Files and child processes, within bounds; imports nothing heavy, so that a command line can ask at once."""

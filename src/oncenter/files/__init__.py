"""Files and child processes, within limits. Imports nothing heavy, so that the command line starts fast."""

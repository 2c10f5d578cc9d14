"""How far the angle sensor is off: a run of the core a drive, what it answered, and findings in words."""

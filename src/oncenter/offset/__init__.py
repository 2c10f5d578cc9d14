"""The offset of the angle sensor: one run of the core per drive, its answer, and findings in words."""

"""A page on this machine in place of a terminal: choose the truck, drop its logs, read the verdict and the report."""

class ExternalShutdownException(Exception):
    """A launch file or a signal ends the node."""

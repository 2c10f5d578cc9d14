"""What logs are called, and whose code reads them. Imports nothing, so that a command line can ask at once."""

OF_FRAMES = (".log", ".asc", ".blf", ".trc", ".mf4", ".mdf")
OF_TABLES = (".csv", ".csv.gz", ".parquet")
SUFFIXES = OF_FRAMES + OF_TABLES
READ_HERE = (".log", ".blf", ".asc", ".trc")  # by our own code and numpy; others by libraries, in a child process
READER = "oncenter.read.child"  # that child, as `python -m` starts it

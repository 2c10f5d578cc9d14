"""What logs are called, and whose code reads them. Imports nothing, so that a command line can ask at once."""

MDF = (".mf4", ".mdf", ".dat")  # INCA calls its MDF 3 .dat
OF_FRAMES = (".log", ".asc", ".blf", ".trc", *MDF)
OF_TABLES = (".csv", ".csv.gz", ".parquet", ".vbo")
ROS = (".bag", ".mcap", ".db3")
OF_SIGNALS = (*OF_TABLES, ".mat", *ROS)  # and no frames
SUFFIXES = OF_FRAMES + OF_SIGNALS
READ_HERE = (".log", ".blf", ".asc", ".trc")  # by our own code and numpy; others by libraries, in a child process
READER = "oncenter.read.child"  # that child, as `python -m` starts it

"""The suffixes of logs, and which code reads them. Imports nothing, so that the command line starts fast."""

MDF = (".mf4", ".mdf", ".dat")  # .dat: INCA's MDF 3
OF_FRAMES = (".log", ".asc", ".blf", ".trc", *MDF)
OF_TABLES = (".csv", ".csv.gz", ".parquet", ".vbo")
ROS = (".bag", ".mcap", ".db3")
OF_SIGNALS = (*OF_TABLES, ".mat", *ROS)  # and no frames
SUFFIXES = OF_FRAMES + OF_SIGNALS
READ_HERE = (".log", ".blf", ".asc", ".trc")  # with this package's code and numpy; others in a child process
READER = "oncenter.read.child"  # that child, as `python -m` starts it

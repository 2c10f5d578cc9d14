"""No reader runs code from a log: all formats are read while an audit hook checks for it."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import polars as pl
import signal_logs
from asammdf import MDF, Signal
from drive_frames import truth

from oncenter.files.log_formats import SUFFIXES, WRITTEN
from oncenter.read import read
from oncenter.simulate import simulate_to_log, truth_files

# The first round runs code of modules that are loaded; in the second one only the logs are new.
PROGRAM = """
import re
import sys
sys.modules["numexpr"] = None
from pathlib import Path
from oncenter.errors import OncenterError
from oncenter.read.here import read_here
from oncenter.signals import SignalName

NAMES = @NAMES@  # of topics
OF_CODE = ("compile", "exec", "import", "pickle.find_class", "os.system", "os.exec", "subprocess.Popen")
heard, listens = [], False

def listen(event, arguments):
    if not listens or event not in OF_CODE:
        return
    # numpy has ast.literal_eval take the length of a byte array apart, which compiles and runs nothing.
    if not (event == "compile" and re.fullmatch(r"b'\\(\\d+,\\)'", repr(arguments[0]))):
        heard.append(f"{event} {arguments[0]!r:.200}")

def answer(log):
    try:
        return f"{log.name}: {read_here(log, NAMES, [], {}, lambda fraction: None).table.height} ticks"
    except OncenterError as error:
        return f"{log.name}: {error.code}"

logs = [Path(name) for name in sys.argv[1:]]
first = [answer(log) for log in logs]
sys.addaudithook(listen)
listens = True
second = [answer(log) for log in logs]
of_logs, of_eval = len(heard), eval("len(heard)")
listens = False
print(*heard[:of_logs], sep="\\n", file=sys.stderr)
assert of_eval > of_logs == 0, "the hook hears eval, and it heard nothing before"
assert first == second
print(*second, sep="\\n")
"""
HOSTILE = "().__class__.__base__.__subclasses__()"


def channels(path: Path, formula: str) -> None:
    time = np.arange(400) / 100
    with MDF(version="3.30" if path.suffix == ".mdf" else "4.10") as mdf:
        for column, unit in (("steering_wheel_angle", "rad"), ("yaw_rate", "rad/s"), ("vehicle_speed", "m/s")):
            values = next(values for name, values in truth(time).items() if name.startswith(column))
            mdf.append([Signal(values, time, name=column, unit=unit, conversion={"formula": formula})])
        mdf.save(path)


def every_format(folder: Path) -> list[Path]:
    scenario = folder / "short.toml"
    scenario.write_text('base = "thesis_drive"\nabout = "short"\n[drive]\nduration_s = 30.0\n')
    for suffix in WRITTEN:
        simulate_to_log(scenario, 1, folder / f"drive{suffix}")
    for file in (scenario, *truth_files(folder / "drive.log")):
        file.unlink()
    table = read(folder / "drive.log").table
    since = pl.col("time_s") - pl.col("time_s").min()
    needed = table.select(since, *truth(np.zeros(1))).fill_nan(0.0)
    for suffix, write in signal_logs.WRITERS.items():
        write(needed, folder / f"drive{suffix}")
    signal_logs.mat_hdf5(needed, folder / "hdf5.mat")
    signal_logs.ros_folder(needed, folder / "bag")
    for name in ("drive.mdf", "channels.mf4"):
        channels(folder / name, "pow(X,1)*exp(0)")
    for name in ("hostile.mdf", "hostile.mf4"):
        channels(folder / name, HOSTILE)
    return sorted(folder.iterdir())


def test_no_format_runs_code_from_a_log_or_needs_numexpr(tmp_path: Path) -> None:
    logs = every_format(tmp_path)
    assert {suffix for suffix in SUFFIXES if any(log.name == f"drive{suffix}" for log in logs)} == set(SUFFIXES)
    path = os.pathsep.join(filter(None, (str(Path(__file__).parents[1] / "src"), os.environ.get("PYTHONPATH"))))
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM.replace("@NAMES@", repr(signal_logs.TOPICS)), *map(str, logs)],
        env=os.environ | {"PYTHONPATH": path},
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    answers = dict(line.split(": ") for line in done.stdout.splitlines())
    assert len(answers) == len(logs)
    assert {name for name, said in answers.items() if not said.endswith(" ticks")} == {"hostile.mdf", "hostile.mf4"}
    assert answers["hostile.mdf"] == answers["hostile.mf4"] == "unknown_conversion"


def test_asammdf_cannot_run_a_formula_in_the_reading_process(tmp_path: Path) -> None:
    """The second barrier, in case a conversion is left on a channel."""
    touch = f"__import__('pathlib').Path({str(tmp_path / 'CODE_RAN')!r}).touch()"
    program = f"""
from oncenter.read.mf4 import _mdf_without_eval
_mdf_without_eval()
from asammdf.blocks import v2_v3_blocks, v4_blocks
import numpy, sys
for block in (
    v4_blocks.ChannelConversion(conversion_type=3, formula={touch!r}),
    v2_v3_blocks.ChannelConversion(conversion_type=10, formula={touch!r}),
    v4_blocks.ChannelConversion(conversion_type=2, **{{f"P{{i}}": 1.0 for i in range(1, 7)}}),
):
    try:
        block.convert(numpy.arange(3.0))
    except Exception:
        continue
    sys.exit("it converts")
"""
    done = subprocess.run([sys.executable, "-W", "ignore", "-c", program], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stderr) == (0, "")
    assert not (tmp_path / "CODE_RAN").exists()

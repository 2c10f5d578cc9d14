"""A few mutants of each format; `make fuzz` tries 500."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import fuzz_logs
import independent_readers
import numpy as np
import pytest
from base_logs import write_base_logs
from mutate_logs import FORMATS, mutate
from signal_logs import names_for
from watched import watch

from oncenter.read import read

pytestmark = pytest.mark.slow

SEEDS = range(2)


@pytest.fixture(scope="module")
def base_logs(tmp_path_factory: pytest.TempPathFactory) -> fuzz_logs.BaseLogs:
    return write_base_logs(tmp_path_factory.mktemp("base"))


@pytest.mark.parametrize("log_format", FORMATS)
def test_a_damaged_log_does_no_harm_and_gives_no_wrong_valid_offset(
    base_logs: fuzz_logs.BaseLogs, log_format: str
) -> None:
    tried = fuzz_logs.trials(base_logs, [(log_format, seed) for seed in SEEDS], jobs=2)
    assert [one.line for one in tried if one.wrong] == []


@pytest.mark.parametrize("log_format", FORMATS)
def test_two_readers_that_share_no_code_read_a_good_log_alike(base_logs: fuzz_logs.BaseLogs, log_format: str) -> None:
    for log in base_logs[log_format]:
        ours, theirs = read(log, names=names_for(log.suffix)).table, independent_readers.read(log)
        ours_s, theirs_s = (time - time[0] for time in (ours["time_s"].to_numpy(), theirs["time_s"]))
        assert len(theirs) == len(set(ours.columns) - {"latitude_deg", "longitude_deg", "course_deg"})
        for name in ("steering_wheel_angle_rad", "yaw_rate_rad_s", "lateral_acceleration_m_s2"):
            at = np.interp(ours_s, theirs_s, theirs[name])
            assert np.nanmax(np.abs(at - ours[name].to_numpy())[10:-10]) < 0.02, (log.name, name)


def test_the_offset_of_the_good_drive_is_valid(base_logs: fuzz_logs.BaseLogs) -> None:
    """Otherwise no mutant's offset would be valid, and nothing would be compared."""
    (log,) = base_logs["parquet"]
    ended = watch(fuzz_logs.answer_command(log))
    assert json.loads(ended.out)["offset"]["status"] == "valid"


@pytest.mark.parametrize("log_format", FORMATS)
def test_a_mutant_depends_only_on_its_seed(base_logs: fuzz_logs.BaseLogs, log_format: str) -> None:
    base = base_logs[log_format][0].read_bytes()
    mutants = [mutate(log_format, seed, base) for seed in (1, 1, 2)]
    assert mutants[0] == mutants[1] != mutants[2]


def test_a_valid_offset_that_is_not_the_independent_readers_is_a_failure(
    base_logs: fuzz_logs.BaseLogs, tmp_path: Path
) -> None:
    log = tmp_path / "drive.parquet"
    log.write_bytes(base_logs["parquet"][0].read_bytes())
    difference, wrong = fuzz_logs.difference_of(2.6, log)
    assert difference == pytest.approx(0.57, abs=0.1)
    assert "2.600 deg, valid; 2.0" in wrong


ENDLESS_CHILD = "import subprocess, sys; subprocess.run([sys.executable, '-c', 'while True: pass'])"


@pytest.mark.parametrize(
    ("program", "harm"),
    [
        ("import time; time.sleep(60)", "killed after 0.5 s"),
        (ENDLESS_CHILD, "killed after 0.5 s"),
        ("import os; os.abort()", "signal SIGABRT"),
        ("import sys; sys.exit(70)", "exit 70"),
        ("1 / 0", "traceback, exit 1"),
        ("print(1)", ""),
    ],
)
def test_harm_is_detected_and_named(program: str, harm: str) -> None:
    assert watch([sys.executable, "-c", program], kill_s=0.5).harm.startswith(harm)


def test_the_memory_of_all_processes_is_measured() -> None:
    hold = "import time; held = bytearray(150 << 20); time.sleep(60)"
    program = f"import subprocess, sys; one = subprocess.Popen([sys.executable, '-c', {hold!r}]); {hold}"
    ended = watch([sys.executable, "-c", program], kill_s=20.0, kill_mib=250.0)
    assert ended.code is None
    assert 250.0 < ended.peak_mib < 500.0

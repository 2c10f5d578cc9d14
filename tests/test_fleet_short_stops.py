"""In a fleet, too, logs with short stops between are one drive, whatever the night and the order in which they come."""

from __future__ import annotations

from pathlib import Path

import polars as pl
import pytest
from test_several_logs import vehicle
from test_short_stops import logs, with_another_zero_at_each_start

import oncenter as oc
from oncenter.cli import run as command
from oncenter.files.child import ChildDied
from oncenter.fleet import page, run
from oncenter.fleet.files import LogFile
from oncenter.fleet.watched import Watched
from oncenter.signals import DEGREE, Signals

pytestmark = pytest.mark.usefixtures("answered_here")

VEHICLE = """
wheelbase_m = 3.7
steering_ratio = 19.3
track_width_front_m = 2.0
track_width_rear_m = 1.8
traffic_side = "right"
"""


class Truck:
    """A fleet of one truck."""

    def __init__(self, folder: Path) -> None:
        self.logs, self.vehicles, self.output = folder / "logs" / "truck", folder / "vehicles", folder / "out"
        self.logs.mkdir(parents=True)
        self.vehicles.mkdir()
        (self.vehicles / "truck.toml").write_text(VEHICLE)

    def gets(self, log: Signals) -> Path:
        path = self.logs / log.log
        log.table.with_columns(pl.col("time_s") + log.start_s).write_parquet(path)
        return path

    def night(self) -> dict[str, float]:
        run([str(self.logs)], self.vehicles, self.output)
        return pl.read_parquet(self.output / "trucks.parquet").row(0, named=True)

    def drives(self) -> pl.DataFrame:
        return pl.read_parquet(self.output / "drives.parquet")

    def in_folder(self) -> oc.Answer:
        """As `oncenter offset FOLDER`."""
        return oc.offset(list(map(oc.read, sorted(self.logs.iterdir()))), vehicle())


@pytest.fixture
def truck(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Truck:
    monkeypatch.setattr(page, "_page", lambda contents: "")  # drawing takes long
    return Truck(tmp_path)


def agrees(row: dict[str, float], answer: oc.Answer) -> bool:
    """To more than the printed digits."""
    assert answer.offset.value is not None and answer.offset_half_width_rad is not None
    given = (answer.offset.value / DEGREE, answer.offset_half_width_rad / 1.96 / DEGREE)
    return (row["offset_deg"], row["offset_spread_sd_deg"]) == pytest.approx(given, abs=1e-3)


def test_a_night_s_logs_with_short_stops_are_one_drive_as_in_a_folder(truck: Truck) -> None:
    for log in logs(600.0, 1200.0):
        truck.gets(log)
    row = truck.night()
    assert agrees(row, truck.in_folder())
    assert row["drives"] == 3 and truck.drives()["error_code"].null_count() == 3


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 0, 1)])
def test_a_log_of_a_later_night_goes_on_with_the_drive(truck: Truck, order: tuple[int, ...]) -> None:
    given = logs(600.0, 600.0)
    for k in order:
        truck.gets(given[k])
        row = truck.night()
    assert agrees(row, truck.in_folder())


def test_a_second_night_answers_no_drive_again(truck: Truck, monkeypatch: pytest.MonkeyPatch) -> None:
    for log in logs(600.0, 600.0):
        truck.gets(log)
    before = truck.night()
    monkeypatch.setattr("oncenter.fleet.night.Watched.__call__", lambda *_: pytest.fail("a log was answered again"))
    assert truck.night() == before


def test_a_log_that_is_gone_or_removed_leaves_the_drive(truck: Truck) -> None:
    given = logs(600.0, 600.0)
    paths = [truck.gets(log) for log in given]
    truck.night()
    paths[2].unlink()
    assert agrees(truck.night(), oc.offset(given[:2], vehicle()))
    assert command(["fleet", "remove", "--output", str(truck.output), str(paths[1])]) == 0
    assert agrees(truck.night(), oc.offset(given[0], vehicle()))


def test_a_calibration_in_the_stop_ends_the_drive(truck: Truck) -> None:
    for log in logs(1200.0):
        truck.gets(log)
    one = truck.night()
    event = ["truck", "calibrated", "--date", "2026-03-02T07:15"]
    assert command(["fleet", "event", "--output", str(truck.output), *event]) == 0
    assert truck.night()["offset_sd_deg"] > 1.1 * one["offset_sd_deg"]


def test_a_signal_fault_leaves_its_log_out_and_the_others_count(truck: Truck) -> None:
    given = logs(600.0, 600.0)
    truck.gets(given[0])
    truck.gets(given[2])
    stuck = given[1].table.with_columns(pl.lit(0.0).alias("yaw_rate_rad_s"))
    stuck.with_columns(pl.col("time_s") + given[1].start_s).write_parquet(truck.logs / given[1].log)
    row = truck.night()
    assert agrees(row, truck.in_folder())


def test_a_drive_that_could_not_be_read_is_answered_in_a_later_night(
    truck: Truck, monkeypatch: pytest.MonkeyPatch
) -> None:
    for log in logs(600.0, 600.0):
        truck.gets(log)
    answered = Watched._answered

    def stopped(watched: Watched, log: LogFile) -> dict[str, object]:
        if log.former:
            raise ChildDied("stopped", "was ended from outside")
        return answered(watched, log)

    with monkeypatch.context() as patch:
        patch.setattr(Watched, "_answered", stopped)
        assert not agrees(truck.night(), truck.in_folder())
    assert agrees(truck.night(), truck.in_folder())


def test_a_log_that_comes_without_the_others_leaves_their_drive_as_it_was(truck: Truck, tmp_path: Path) -> None:
    given = logs(600.0, 600.0)
    for log in given[:2]:
        truck.gets(log)
    truck.night()
    later = tmp_path / "later" / "truck"
    later.mkdir(parents=True)
    given[2].table.with_columns(pl.col("time_s") + given[2].start_s).write_parquet(later / given[2].log)
    run([str(later)], truck.vehicles, truck.output)
    assert pl.read_parquet(truck.output / "trucks.parquet")["told"].to_list() == [2]


@pytest.mark.slow
def test_a_sensor_with_another_zero_at_each_start_is_named_after_short_stops(truck: Truck) -> None:
    for log in with_another_zero_at_each_start():
        truck.gets(log)
    assert truck.night()["state"] == "no_correction"

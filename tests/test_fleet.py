"""Many trucks every night: each log counts once, none is lost, nothing depends on who came first."""

from __future__ import annotations

import contextlib
import json
import os
import re
import shutil
import socket
import sqlite3
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from drive_frames import Frame, candump, drive, identifier
from test_estimate import steady_drive

import oncenter as oc
from oncenter.cli import run as command
from oncenter.errors import OncenterError
from oncenter.fleet import engines, query, run
from oncenter.fleet.drive import Work, when
from oncenter.fleet.engines import on_ray
from oncenter.fleet.files import LogFile
from oncenter.fleet.pictures import ranking
from oncenter.fleet.tables import CHANGES, DRIVES, TRUCKS
from oncenter.fleet.truck_data import script_name
from oncenter.fleet.trucks import Truck, Trucks
from oncenter.read.identity import start_of, vin_of

ROOT = Path(__file__).parents[1]
VIN = "YS2R4X20001234567"
DAY_S = 86400.0
MONDAY_S = 1_772_434_800.0  # 2026-03-02, 7:00 UTC
TABLES = ("drives", "trucks", "changes")
OFFSETS_DEG = {VIN: (0.3, 0.3, 0.3, 4.3, 4.3, 4.3), "depot-7": (-0.4,) * 6}


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two trucks, six drives each: a VIN that a model's file describes, remounted by 4 deg, and a folder's name."""
    root = tmp_path_factory.mktemp("fleet")
    (root / "vehicles").mkdir()
    for stem in ("YS2R4X2", "depot-7"):
        text = "wheelbase_m = 3.7\nsteering_ratio = 19.3\ntrack_width_rear_m = 1.83\n"
        (root / "vehicles" / f"{stem}.toml").write_text(text)
    for truck, offsets in OFFSETS_DEG.items():
        (root / "logs" / truck).mkdir(parents=True)
        for day, offset in enumerate(offsets):
            table = steady_drive(offset_deg=offset, start_s=MONDAY_S + day * DAY_S).table
            noise = np.random.default_rng(day).normal(0.0, 0.003, table.height)
            table = table.with_columns(pl.col("steering_wheel_angle_rad") + noise)
            table.write_parquet(root / "logs" / truck / f"day{5 - day}.parquet")  # names are not in order of time
    return root


@pytest.fixture(scope="module")
def undisturbed(fleet: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    output = tmp_path_factory.mktemp("undisturbed")
    run([str(fleet / "logs")], fleet / "vehicles", output)
    return output


def tables(output: Path) -> dict[str, bytes]:
    """All that must not depend on how a run went."""
    names = [f"{name}.parquet" for name in TABLES] + sorted(f"trucks/{p.name}" for p in (output / "trucks").iterdir())
    return {name: (output / name).read_bytes() for name in names}


def test_a_remounted_sensor_is_found_dated_and_ranked_first(undisturbed: Path) -> None:
    trucks = pl.read_parquet(undisturbed / "trucks.parquet")
    changes = pl.read_parquet(undisturbed / "changes.parquet").filter(quantity="offset")
    assert trucks["truck"].to_list() == [VIN, "depot-7"]
    assert changes["truck"].to_list() == [VIN]
    change = changes.row(0, named=True)
    assert change["after_drive"].timestamp() == MONDAY_S + 2 * DAY_S
    assert change["by_drive"].timestamp() == MONDAY_S + 3 * DAY_S
    assert change["drives_to_find"] <= 3
    assert abs(change["size"] - 4.0) < 1.96 * change["sd"] < 2.0  # drives of four minutes
    assert trucks["since"][0].timestamp() == MONDAY_S + 3 * DAY_S


def test_a_drive_is_a_row_with_what_offset_says_of_it(fleet: Path, undisturbed: Path) -> None:
    log = fleet / "logs" / "depot-7" / "day2.parquet"
    given = oc.offset(oc.read(log), oc.vehicle(fleet / "vehicles" / "depot-7.toml")).to_dict()["offset"]
    row = pl.read_parquet(undisturbed / "drives.parquet").filter(log=str(log)).row(0, named=True)
    low, high = given["ci95"]
    assert row["offset_deg"] == given["value"]
    assert row["offset_sd_deg"] == pytest.approx((high - low) / 3.92)
    assert (row["truck"], row["offset_status"]) == ("depot-7", given["status"])


def test_a_second_night_answers_nothing_again_and_changes_no_byte(fleet: Path, undisturbed: Path) -> None:
    before = tables(undisturbed)
    summary = run([str(fleet / "logs")], fleet / "vehicles", undisturbed)
    assert (summary.logs_found, summary.logs_answered, summary.drives) == (12, 0, 12)
    assert tables(undisturbed) == before


def test_logs_that_come_late_and_in_any_order_end_as_all_at_once(
    fleet: Path, undisturbed: Path, tmp_path: Path
) -> None:
    logs = sorted((fleet / "logs").rglob("*.parquet"))
    for batch in (logs[5::-2], logs[7:], logs[:7]):
        run([str(log) for log in batch], fleet / "vehicles", tmp_path)
    assert tables(tmp_path) == tables(undisturbed)


def test_a_copy_of_a_log_counts_once_whichever_is_seen_first(fleet: Path, tmp_path: Path) -> None:
    folder = tmp_path / "logs" / "depot-7"
    folder.mkdir(parents=True)
    first, copy = folder / "a.parquet", folder / "b.parquet"
    shutil.copy(fleet / "logs" / "depot-7" / "day0.parquet", copy)
    run([str(copy)], fleet / "vehicles", tmp_path / "out")
    shutil.copy(copy, first)
    run([str(folder)], fleet / "vehicles", tmp_path / "out")
    assert pl.read_parquet(tmp_path / "out" / "drives.parquet")["log"].to_list() == [str(first)]


def test_a_bad_log_is_a_row_with_its_error_and_the_others_are_answered(fleet: Path, tmp_path: Path) -> None:
    folder = tmp_path / "logs" / "depot-7"
    folder.mkdir(parents=True)
    shutil.copy(fleet / "logs" / "depot-7" / "day0.parquet", folder)
    (folder / "broken.parquet").write_bytes(b"PAR1 and then nothing")
    (folder / "empty.csv").write_bytes(b"")
    (tmp_path / "logs" / "nobody.csv").write_text("time_s,yaw_rate_rad_s\n0,0\n0.01,0\n")
    summary = run([str(tmp_path / "logs")], fleet / "vehicles", tmp_path / "out")
    assert (summary.logs_answered, summary.logs_refused) == (1, 3)
    assert summary.refused == {"empty_log": 1, "unknown_truck": 1, "unreadable_log": 1}
    rows = pl.read_parquet(tmp_path / "out" / "drives.parquet").filter(pl.col("error").is_not_null())
    assert all(Path(row["log"]).name in row["error"] and row["offset_deg"] is None for row in rows.to_dicts())


def test_a_log_whose_name_is_no_text_is_named_before_any_is_answered(fleet: Path, tmp_path: Path) -> None:
    name = os.fsdecode(b"bad\xff.csv")
    (tmp_path / name).write_text("nothing\n")
    for place in (tmp_path, tmp_path / name):
        with pytest.raises(OncenterError, match=r"bad\\udcff.csv holds bytes") as refusal:
            run([str(place)], fleet / "vehicles", tmp_path / "out")
        assert refusal.value.exit_code == 2


def test_a_log_that_lacks_a_signal_still_says_when_it_was_driven(fleet: Path, tmp_path: Path) -> None:
    whole = pl.read_parquet(fleet / "logs" / "depot-7" / "day0.parquet")
    whole.drop("yaw_rate_rad_s").write_parquet(tmp_path / "depot-7.parquet")
    run([str(tmp_path / "depot-7.parquet")], fleet / "vehicles", tmp_path / "out")
    row = pl.read_parquet(tmp_path / "out" / "drives.parquet").row(0, named=True)
    assert (row["error_code"], row["start"].timestamp()) == ("missing_signal", MONDAY_S + 5 * DAY_S)


def test_a_log_is_answered_anew_when_its_vehicle_file_comes_or_changes(fleet: Path, tmp_path: Path) -> None:
    vehicles = shutil.copytree(fleet / "vehicles", tmp_path / "vehicles")
    (tmp_path / "logs" / "new-truck").mkdir(parents=True)
    shutil.copy(fleet / "logs" / "depot-7" / "day0.parquet", tmp_path / "logs" / "new-truck")

    def night() -> dict[str, object]:
        run([str(tmp_path / "logs")], vehicles, tmp_path / "out")
        return pl.read_parquet(tmp_path / "out" / "drives.parquet").row(0, named=True)

    assert night()["error_code"] == "unknown_truck"
    file = vehicles / "new-truck.toml"
    file.write_text("wheelbase_m = 3.7\nsteering_ratio = 19.3\n")
    first = night()
    assert (first["truck"], first["error_code"]) == ("new-truck", None)
    file.write_text("wheelbase_m = 3.7\nsteering_ratio = 22.0\n")
    assert night()["offset_deg"] != first["offset_deg"]


def test_a_log_that_grew_replaces_what_it_was(fleet: Path, tmp_path: Path) -> None:
    log = tmp_path / "depot-7.parquet"
    whole = pl.read_parquet(fleet / "logs" / "depot-7" / "day0.parquet")
    for rows in (whole.height // 2, whole.height):
        whole.head(rows).write_parquet(log)
        run([str(log)], fleet / "vehicles", tmp_path / "out")
    drives = pl.read_parquet(tmp_path / "out" / "drives.parquet")
    assert drives["duration_s"].to_list() == [pytest.approx(240.0, abs=0.1)]


KILLED = """
import os, signal, sys
from oncenter.fleet import night
from oncenter.fleet.engines import threads
logs, vehicles, output, moment = sys.argv[1:]

def die(*given):
    os.kill(os.getpid(), signal.SIGKILL)

def engine(work, waiting):
    for count, done in enumerate(threads(work, waiting)):
        if str(count) == moment:
            die()
        yield done

if moment == "ranking":
    night.rank = die
night.run([logs], vehicles, output, engine=engine)
"""


def test_a_run_that_is_killed_at_any_moment_ends_as_one_undisturbed(
    fleet: Path, undisturbed: Path, tmp_path: Path
) -> None:
    given = [str(fleet / "logs"), str(fleet / "vehicles"), str(tmp_path / "out")]
    for moment in ("0", "5", "ranking"):
        killed = subprocess.run([sys.executable, "-c", KILLED, *given, moment], capture_output=True, text=True)
        assert killed.returncode == -9, killed.stderr
    assert not (tmp_path / "out" / "trucks.parquet").exists()
    summary = run([given[0]], given[1], given[2])
    assert summary.logs_answered < 12
    assert tables(tmp_path / "out") == tables(undisturbed)
    assert not list((tmp_path / "out").rglob("*.new"))


def test_two_runs_do_not_write_one_folder_at_once(fleet: Path, tmp_path: Path) -> None:
    def engine(work: object, logs: object) -> Iterator[object]:
        with pytest.raises(OncenterError, match="no other run"):
            run([str(fleet / "logs")], fleet / "vehicles", tmp_path)
        return iter(())

    run([str(fleet / "logs")], fleet / "vehicles", tmp_path, engine=engine)  # type: ignore[arg-type]


def test_ray_gives_the_bytes_that_threads_give(
    fleet: Path, undisturbed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("ray", reason="Ray is not installed: pip install 'oncenter[fleet]'")
    if "libasan" in os.environ.get("LD_PRELOAD", ""):
        pytest.skip("Ray's own processes do not always begin under the sanitizers; what they call is tested in threads")
    monkeypatch.setattr(engines, "_LOGS_WHILE_RAY_BEGINS", 3)  # the others are Ray's
    here = []
    answer = Work.__call__

    def noted(self: Work, log: LogFile) -> dict[str, Any]:
        here.append(log)
        return answer(self, log)

    monkeypatch.setattr(Work, "__call__", noted)
    summary = run([str(fleet / "logs")], fleet / "vehicles", tmp_path, engine=on_ray(None, workers=2))
    assert 0 < len(here) <= 3 < summary.logs_found
    assert tables(tmp_path) == tables(undisturbed)


def test_what_was_answered_is_kept_where_ray_does_not_begin(monkeypatch: pytest.MonkeyPatch) -> None:
    ray = pytest.importorskip("ray", reason="Ray is not installed: pip install 'oncenter[fleet]'")
    logs = [LogFile(f"{k}.csv", "", 0, 0.0) for k in range(20)]
    done = threading.Event()

    def work(log: LogFile) -> dict[str, Any]:
        if log == logs[-1]:
            done.set()
        return {"answered": log.uri}

    def init(*_: object, **__: object) -> None:
        done.wait(10.0)
        raise Exception("The current node timed out")  # of Ray, word for word

    monkeypatch.setattr(ray, "init", init)
    rows = {}
    with pytest.raises(OncenterError, match="Ray did not begin on this machine: The current node timed out"):
        for log, row in on_ray(None)(work, logs):
            rows[log] = row
    assert rows == {log: {"answered": log.uri} for log in logs}


def test_ray_ends_also_with_a_run_that_fails_before_its_first_task(monkeypatch: pytest.MonkeyPatch) -> None:
    ray = pytest.importorskip("ray", reason="Ray is not installed: pip install 'oncenter[fleet]'")
    answered, ended = threading.Event(), threading.Event()

    def work(_: LogFile) -> dict[str, Any]:
        answered.set()
        return {}

    monkeypatch.setattr(ray, "init", lambda **_: answered.wait(10.0))
    monkeypatch.setattr(ray, "is_initialized", lambda: not ended.is_set())
    monkeypatch.setattr(ray, "shutdown", ended.set)
    rows = on_ray(None)(work, [LogFile("0.csv", "", 0, 0.0)])
    next(iter(rows))
    del rows  # as a full disk does it
    assert ended.wait(10.0)


def test_a_ray_cluster_that_does_not_answer_is_named_at_once() -> None:
    pytest.importorskip("ray", reason="Ray is not installed: pip install 'oncenter[fleet]'")
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    for address in (f"127.0.0.1:{port}", f"ray://127.0.0.1:{port}"):
        with pytest.raises(OncenterError, match=f"no Ray cluster at {address}: .*refused"):
            list(on_ray(address)(lambda _: {}, [LogFile("a night's only log", "", 0, 0.0)]))


@contextlib.contextmanager
def s3_server() -> Iterator[str]:
    """Its address; a process of its own, since pyarrow waits for it without letting others run."""
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        port = found.getsockname()[1]
    server = subprocess.Popen(
        [sys.executable, "-m", "moto.server", "-H", "127.0.0.1", "-p", str(port)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        for _ in range(200):
            with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port), 0.1):
                break
            time.sleep(0.05)
        yield f"127.0.0.1:{port}"
    finally:
        server.terminate()
        server.wait()


def test_logs_in_an_s3_bucket_give_the_answers_that_they_give_on_disk(
    fleet: Path, undisturbed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("moto", reason="moto is not installed: pip install 'oncenter[dev]'")
    from pyarrow.fs import LocalFileSystem, S3FileSystem, copy_files

    monkeypatch.setenv("AWS_ACCESS_KEY_ID", "any")
    monkeypatch.setenv("AWS_SECRET_ACCESS_KEY", "any")
    monkeypatch.setenv("AWS_DEFAULT_REGION", "us-east-1")
    with s3_server() as address:
        store = S3FileSystem(endpoint_override=address, scheme="http", allow_bucket_creation=True)
        store.create_dir("nightly")
        copy_files(str(fleet / "logs"), "nightly/logs", LocalFileSystem(), store)
        place = f"s3://nightly/logs?scheme=http&endpoint_override={address}"
        summary = run([place], fleet / "vehicles", tmp_path)
        again = run([place], fleet / "vehicles", tmp_path)
        with pytest.raises(OncenterError, match="no such bucket") as refusal:
            run([place.replace("nightly", "weekly")], fleet / "vehicles", tmp_path)
    assert refusal.value.exit_code == 2
    assert (summary.logs_answered, summary.logs_refused, again.logs_answered) == (12, 0, 0)
    ours, theirs = (pl.read_parquet(folder / "drives.parquet").drop("log") for folder in (tmp_path, undisturbed))
    assert ours.equals(theirs)
    assert "s3://nightly/logs/depot-7/day0.parquet" in pl.read_parquet(tmp_path / "drives.parquet")["log"].to_list()


# -- which truck, and when


def test_a_truck_is_named_by_the_nearest_part_of_the_path_that_a_vehicle_file_describes(fleet: Path) -> None:
    trucks = Trucks(fleet / "vehicles")
    model = "YS2R4X2"
    for path, truck in {
        f"/logs/depot-7/{VIN}/day.mf4": Truck(VIN, model),
        f"s3://bucket/{VIN}_2026-03-02.log": Truck(VIN, model),
        "/logs/depot-7_monday.blf": Truck("depot-7", "depot-7"),
        "/logs/depot-7.mf4.parquet": Truck("depot-7", "depot-7"),
        "/logs/depot-70/day.mf4": None,
        "/logs/YS2R4X2000123456/day.mf4": None,  # a digit too few
    }.items():
        assert trucks.by_path(path) == truck, path


def test_a_vin_is_read_from_packets_among_other_senders_packets(tmp_path: Path) -> None:
    def packets(text: bytes, address: int, pgn: int) -> list[Frame]:
        count = -(-len(text) // 7)
        announcement = bytes([0x20, *len(text).to_bytes(2, "little"), count, 0xFF, *pgn.to_bytes(3, "little")])
        parts = [bytes([k + 1]) + text[7 * k : 7 * k + 7].ljust(7, b"\xff") for k in range(count)]
        begin = [Frame(1.7e9, identifier(0xECFF, address), announcement)]
        return begin + [Frame(1.7e9, identifier(0xEBFF, address), part) for part in parts]

    vin = packets(f"{VIN}*".encode(), 0x00, 65260)
    other = packets(b"SOFTWARE 1.0*PART 7*", 0x0B, 65242)
    mixed = [frame for pair in zip(vin, other, strict=True) for frame in pair]
    log = tmp_path / "drive.log"
    log.write_text(candump(drive(0.1) + mixed))
    assert vin_of(log) == VIN
    log.write_text(candump(drive(0.1) + [frame for frame in mixed if frame is not vin[2]]))
    assert vin_of(log) is None


def test_a_table_tells_its_vin_and_its_begin_in_metadata_or_a_column(tmp_path: Path) -> None:
    table = pl.DataFrame({"time_s": [0.0, 0.01]})
    by_metadata, by_column, silent = (tmp_path / f"{name}.parquet" for name in ("metadata", "column", "silent"))
    table.write_parquet(by_metadata, metadata={"vin": VIN, "start_time": "2026-03-02T08:00:00+01:00"})
    table.with_columns(vin=pl.lit(VIN), start_time=pl.lit("2026-03-02 07:00:00")).write_parquet(by_column)
    table.write_parquet(silent)
    table.with_columns(vin=pl.lit(VIN), start_time=MONDAY_S).write_csv(tmp_path / "column.csv")
    for log in (by_metadata, by_column, tmp_path / "column.csv"):
        assert (vin_of(log), start_of(log)) == (VIN, MONDAY_S), log
    assert (vin_of(silent), start_of(silent)) == (None, None)


def test_a_drive_begins_when_its_stamps_its_metadata_its_name_or_its_file_say(tmp_path: Path) -> None:
    path = tmp_path / "drive.parquet"
    since_start, dated = steady_drive(minutes=1.0), steady_drive(minutes=1.0, start_s=MONDAY_S)
    since_start.table.write_parquet(path)
    named = LogFile("s3://fleet/2026-03-02T07-00-00/drive.parquet", "", 1, 5.0e8)
    unnamed = LogFile("/logs/drive.parquet", "", 1, 5.0e8)
    assert when(unnamed, path, dated) == {"start": MONDAY_S, "start_source": "log"}
    assert when(named, path, since_start) == {"start": MONDAY_S, "start_source": "name"}
    assert when(unnamed, path, since_start)["start"] == pytest.approx(5.0e8 - 60.0, abs=0.1)
    since_start.table.write_parquet(path, metadata={"start_time": "2026-03-01T07:00:00Z"})
    assert when(named, path, since_start) == {"start": MONDAY_S - DAY_S, "start_source": "metadata"}


# -- over time


def test_the_page_fetches_nothing_from_outside_and_no_name_can_break_out(fleet: Path, tmp_path: Path) -> None:
    strange = "x<script>alert(1)</script>'\""
    vehicles = tmp_path / "vehicles"
    vehicles.mkdir()
    (vehicles / f"{strange.replace('/', '_')}.toml").write_text("wheelbase_m = 3.7\nsteering_ratio = 19.3\n")
    truck = strange.replace("/", "_")
    (tmp_path / "logs" / truck).mkdir(parents=True)
    shutil.copy(fleet / "logs" / "depot-7" / "day0.parquet", tmp_path / "logs" / truck)
    run([str(tmp_path / "logs")], vehicles, tmp_path / "out", reports=True)
    page = (tmp_path / "out" / "index.html").read_text(encoding="utf-8")
    data = (tmp_path / "out" / "trucks" / script_name(truck)).read_text(encoding="utf-8")
    assert "default-src 'none'" in page
    assert not re.search(r"<(script|link|img|iframe)[^>]*(src|href)=", re.sub(r"(?s)<script.*?</script>", "", page))
    assert not re.search(r"<script[^>]+src", page)
    assert "<script>alert" not in page + data
    given = json.loads(data.removeprefix("show(").removesuffix(");\n"))
    assert given["truck"] == truck
    assert (tmp_path / "out" / given["drives"][0]["report"]).stat().st_size > 100_000


def test_sql_answers_on_the_three_tables(undisturbed: Path) -> None:
    sql = "SELECT d.truck, count(*) AS n, max(t.changes) AS c FROM drives d JOIN trucks t ON d.truck = t.truck"
    result = query(f"{sql} GROUP BY d.truck ORDER BY d.truck", undisturbed)
    assert result.rows() == [(VIN, 6, 1), ("depot-7", 6, 0)]


@pytest.mark.parametrize(
    "sql",
    ["-- all of them\n(SELECT truck FROM trucks)", "/* ; */ with t AS (SELECT * FROM trucks) SELECT truck FROM t"],
)
def test_a_query_may_begin_in_several_ways(undisturbed: Path, sql: str) -> None:
    assert query(sql, undisturbed).height == 2


@pytest.mark.parametrize(
    "sql",
    [
        *("SELECT", "SELECT nothing FROM drives", "SELECT * FROM lorries", ""),
        *("DROP TABLE trucks", "-- x\n delete FROM trucks", "TRUNCATE TABLE trucks", "CREATE TABLE t AS SELECT 1"),
    ],
)
def test_a_query_that_cannot_be_answered_is_one_line(
    undisturbed: Path, sql: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert command(["fleet", "query", sql, "--output", str(undisturbed)]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_what_cannot_be_run_is_refused_by_name(fleet: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    logs, vehicles, output = str(fleet / "logs"), str(fleet / "vehicles"), str(tmp_path / "out")
    for arguments, named in (
        ([logs, "--vehicles", str(tmp_path / "none"), "--output", output], "none"),
        ([logs + "x", "--vehicles", vehicles, "--output", output], "logsx"),
        ([logs, "--vehicles", vehicles, "--output", str(fleet / "vehicles" / "depot-7.toml")], "depot-7.toml"),
        ([logs, "--vehicles", vehicles, "--output", output, "--limit", "0"], "limit"),
        ([logs, "--vehicles", vehicles, "--output", output, "--address", "auto"], "--address"),
    ):
        assert command(["fleet", "run", *arguments]) == 2
        assert named in capsys.readouterr().err
    assert command(["fleet", "query", "SELECT 1", "--output", str(tmp_path)]) == 2


@pytest.mark.parametrize("name", ["index.html", "trucks.parquet", "metrics.json", "ledger.sqlite"])
def test_a_folder_with_files_of_somebody_s_own_is_left_as_it_is(
    name: str, fleet: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mine = tmp_path / name
    if name == "ledger.sqlite":
        with contextlib.closing(sqlite3.connect(mine)) as file:
            file.execute("CREATE TABLE accounts (name TEXT)")
    else:
        mine.write_text("mine")
    before = mine.read_bytes()
    arguments = [str(fleet / "logs"), "--vehicles", str(fleet / "vehicles"), "--output", str(tmp_path), "--json"]
    assert command(["fleet", "run", *arguments]) == 2
    out, err = capsys.readouterr()
    assert name in err and err.count("\n") == 1 and json.loads(out)["code"] == "output"
    assert [path.name for path in tmp_path.iterdir()] == [name] and mine.read_bytes() == before


def test_what_was_answered_is_kept_when_the_tables_cannot_be_written(
    fleet: Path, undisturbed: Path, tmp_path: Path
) -> None:
    in_the_way = tmp_path / "drives.parquet.new"
    in_the_way.mkdir()
    with pytest.raises(OncenterError, match="goes on from there"):
        run([str(fleet / "logs")], fleet / "vehicles", tmp_path)
    in_the_way.rmdir()
    assert run([str(fleet / "logs")], fleet / "vehicles", tmp_path).logs_answered == 0
    assert tables(tmp_path) == tables(undisturbed)


def test_a_run_says_in_words_and_in_json_what_it_did(
    fleet: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["fleet", "run", str(fleet / "logs"), "--vehicles", str(fleet / "vehicles"), "--output", str(tmp_path)]
    assert command(arguments) == 0
    words = capsys.readouterr().out
    assert "12 logs: 12 answered now" in words
    assert VIN in words
    assert max(map(len, words.splitlines()[:-1])) <= 100
    assert command([*arguments, "--json"]) == 0
    given = json.loads(capsys.readouterr().out)
    assert (given["logs_found"], given["logs_answered"], given["trucks"]) == (12, 0, 2)
    assert given == json.loads((tmp_path / "metrics.json").read_text())


def test_the_page_counts_the_drives_that_the_words_count_and_a_lone_truck_has_one_rank(
    fleet: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A log of no known truck is a drive as well."""
    (tmp_path / "nobody.csv").write_text("nothing\n")
    logs = [str(fleet / "logs" / "depot-7"), str(tmp_path / "nobody.csv")]
    output = tmp_path / "out"
    assert command(["fleet", "run", *logs, "--vehicles", str(fleet / "vehicles"), "--output", str(output)]) == 0
    assert "7 drives" in capsys.readouterr().out
    page = (output / "index.html").read_text(encoding="utf-8")
    assert "· 7 drives" in page
    [truck] = query("SELECT * FROM trucks", output).to_dicts()
    picture = ranking([truck], 2.0)
    assert picture is not None and picture.yaxis[0].ticker.min_interval == 1


def test_every_column_is_documented() -> None:
    page = (ROOT / "docs" / "fleet.md").read_text(encoding="utf-8")
    for title, columns in (("drives", DRIVES), ("trucks", TRUCKS), ("changes", CHANGES)):
        section = page.split(f"### {title}.parquet")[1].split("\n#")[0]
        assert re.findall(r"^\| `(\w+)` \|", section, re.MULTILINE) == list(columns)

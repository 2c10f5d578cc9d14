"""Priors that a fleet's trucks teach: the spread of pulls without that of their errors, the file, and who reads it."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fleet_rows import OUTLIER_M_S2, Driving, fleet_of

import oncenter
from oncenter import _core
from oncenter.cli import run
from oncenter.errors import OncenterError
from oncenter.estimates.cause import causes_of
from oncenter.fleet import priors as fleet_priors
from oncenter.fleet.files import LogFile
from oncenter.fleet.ledger import LEDGER, Ledger
from oncenter.fleet.summaries import columns_of
from oncenter.learned_priors import KEYS, error_key
from oncenter.offset.inputs import params_of
from oncenter.signals import DEGREE
from oncenter.truck.now import truck_now
from oncenter.truck.population import Drives, Learned, Population, population_of
from oncenter.truck.priors import priors_of
from oncenter.truck.pull_spread import Outlier
from oncenter.truck.row import Row

FOUND = Population(
    pull_sd=Learned(0.03, 0.004, 25),
    play_mean=Learned(5.0 * DEGREE, 0.3 * DEGREE, 25),
    play_sd=Learned(1.5 * DEGREE, 0.2 * DEGREE, 25),
    gradient_mean=Learned(0.45 * DEGREE, 0.01 * DEGREE, 25),
    gradient_sd=Learned(0.1 * DEGREE, 0.01 * DEGREE, 25),
    set_up=Learned(0.08, 0.05, 25),
    outliers=(Outlier(1, -0.41, 0.05),),
)
TRUCK = 'wheelbase_m = 3.7\nsteering_ratio = 19.3\ntraffic_side = "right"\n'


TWO_LOADS = Driving((0.75, 1.35))


@pytest.mark.parametrize("outliers", [0, 3])
@pytest.mark.parametrize("pull_sd", [0.02, 0.05, 0.1])
def test_the_spread_of_pulls_is_found_without_that_of_their_errors_and_without_outliers(
    pull_sd: float, outliers: int
) -> None:
    found = population_of(fleet_of(pull_sd, 60, outliers=outliers), priors_of(), 0.05)
    assert abs(found.pull_sd.value - pull_sd) < 2.0 * found.pull_sd.error < pull_sd + 0.01
    assert [one.at for one in found.outliers[:outliers]] == list(range(outliers))
    assert all(abs(abs(one.pull) - OUTLIER_M_S2) < 3.0 * one.pull_sd for one in found.outliers[:outliers])
    assert len(found.outliers) <= outliers + 1  # of 60 trucks the one with the largest pull may be named, too
    assert found.play_mean.value == pytest.approx(5.0 * DEGREE, abs=3.0 * found.play_mean.error)
    assert found.play_sd.value == pytest.approx(1.5 * DEGREE, abs=3.0 * found.play_sd.error)
    assert found.gradient_mean.value == pytest.approx(0.434 * DEGREE, rel=0.02)
    assert found.set_up is not None and found.set_up.value < 0.06


@pytest.mark.parametrize(("scatter_deg", "pull_sd"), [(0.08, 0.05), (0.4, 0.02)])
def test_a_scatter_of_drives_that_the_model_does_not_expect_neither_hides_pulls_nor_invents_them(
    scatter_deg: float, pull_sd: float
) -> None:
    found = population_of(fleet_of(pull_sd, 200, Driving(scatter_deg=scatter_deg), seed=4), priors_of(), 0.05)
    assert found.pull_sd.value == pytest.approx(pull_sd, abs=2.0 * found.pull_sd.error)


def test_worn_steerings_do_not_widen_the_spread_of_plays() -> None:
    fleet = fleet_of(0.05, 60)
    fleet[:3] = [[with_more_play(row, 10.0 * DEGREE) for row in drives] for drives in fleet[:3]]
    found = population_of(fleet, priors_of(), 0.05)
    assert found.play_mean.value == pytest.approx(5.0 * DEGREE, abs=2.0 * found.play_mean.error)
    assert found.play_sd.value == pytest.approx(1.5 * DEGREE, abs=2.0 * found.play_sd.error)


def with_more_play(row: Row, more: float) -> Row:
    ((level, *lower, offset, play, neutral),) = row.modes
    return replace(row, modes=np.array([[level, *lower, offset + lower[1] * more, play + lower[2] * more, neutral]]))


def test_drives_at_several_loads_find_an_outlier_s_pull_where_its_fleet_has_taught_a_narrow_one() -> None:
    (drives,) = fleet_of(0.0, 1, outliers=1)
    truck = truck_now(drives, (), priors_of({"pull_sd_m_s2": 0.022}))
    assert abs(truck.pull - OUTLIER_M_S2) < 2.0 * truck.pull_sd


def drive_in(truck: int, row: Row) -> dict[str, Any]:
    """A row of the ledger, of a drive in one log."""
    name = f"T{truck:03}"
    log = f"{name}/{row.start_s:.0f}.mf4"
    where = {"key": log, "log": log, "truck": name, "vehicle_file": "rigid", "settings": "", "error_code": None}
    when = {"start": row.start_s, "start_source": "log", "span_s": row.length_s}
    return where | when | of_drive(row)


def of_drive(row: Row) -> dict[str, Any]:
    times = {"start": row.start_s, "duration_s": row.length_s, "used_s": row.used_s}
    loads = {"side_force_left_s": row.left_s, "side_force_right_s": row.right_s}
    return columns_of(row, _core.default_params()) | times | loads | {"offset_status": row.status}


def ledger(folder: Path, drives: Iterable[dict[str, Any]]) -> Path:
    """A fleet's folder with these drives."""
    with closing(Ledger(folder / LEDGER)) as kept:
        for drive in drives:
            kept.add(LogFile(drive["log"], "", 1, 0.0), drive)
    return folder


def drives_of(fleet: Sequence[Drives]) -> list[dict[str, Any]]:
    return [drive_in(truck, row) for truck, drives in enumerate(fleet) for row in drives]


def test_trucks_of_one_load_teach_no_priors_and_the_line_says_why(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, file = ledger(tmp_path, drives_of(fleet_of(0.05, 12, Driving((1.0,))))), tmp_path / "priors.toml"
    assert run(["fleet", "priors", str(folder), "--output", str(file)]) == 1
    assert not file.exists()
    said = capsys.readouterr().err
    assert "0 of 12 trucks" in said and "one load cannot separate a pull from an accelerometer bias" in said


def test_an_outlier_is_named_by_its_truck_in_the_line_and_in_the_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, file = ledger(tmp_path, drives_of(fleet_of(0.02, 20, outliers=1))), tmp_path / "priors.toml"
    assert run(["fleet", "priors", str(folder), "--output", str(file)]) == 0
    _, named = capsys.readouterr().out.splitlines()
    assert named.startswith("T000: pull +0.") and "outside the spread of the others" in named
    outliers = tomllib.loads(file.read_text())["outliers"]
    assert outliers.keys() == {"T000"}
    assert abs(outliers["T000"]["pull_m_s2"] - OUTLIER_M_S2) < 3.0 * outliers["T000"]["pull_error_m_s2"]


def in_two_logs(truck: int, row: Row) -> list[dict[str, Any]]:
    """A drive with a stop of 400 s in the middle, as answered as a whole."""
    third = row.length_s / 3.0
    parts = [replace(row, start_s=row.start_s + k * third, length_s=third) for k in (0, 2)]
    first, last = (drive_in(truck, part) for part in parts)
    return [first, last | {"drive": {"keys": [first["key"], last["key"]], "rows": [of_drive(row)]}}]


def test_logs_with_short_stops_teach_as_one_drive(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fleet = fleet_of(0.05, 12, TWO_LOADS)
    logs = [log for truck, drives in enumerate(fleet) for row in drives for log in in_two_logs(truck, row)]
    taught: list[Sequence[Drives]] = []

    def noted(trucks: Sequence[Drives], *_: Any) -> Population:
        taught.append(trucks)
        return FOUND

    monkeypatch.setattr(fleet_priors, "population_of", noted)
    fleet_priors.write_priors(ledger(tmp_path, logs), tmp_path / "priors.toml")
    lengths = [[row.length_s for row in drives] for drives in taught[0]]
    assert lengths == [[row.length_s for row in drives] for drives in fleet]


@pytest.fixture
def written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(fleet_priors, "population_of", lambda *_: FOUND)
    file = tmp_path / "fleet_priors.toml"
    fleet_priors.write_priors(ledger(tmp_path, drives_of(fleet_of(0.05, 12, TWO_LOADS))), file)
    return file


def test_a_vehicle_file_reads_what_a_fleet_has_taught(written: Path, tmp_path: Path) -> None:
    values = tomllib.loads(written.read_text())
    assert values["priors"]["trucks"] == 25 and values["priors"]["pull_sd_m_s2"] == 0.03
    assert {*KEYS, *map(error_key, KEYS), "trucks"} == set(values["types"]["rigid"])
    (tmp_path / "rigid.toml").write_text(TRUCK + '[priors]\nfrom = "fleet_priors.toml"\n')
    truck = oncenter.vehicle(tmp_path / "rigid.toml")
    used = params_of(truck, {})
    assert used["pull_sd_m_s2"] == pytest.approx(np.hypot(0.03, 0.004))
    assert used["set_up_probability_1"] == pytest.approx(0.08 + 0.05)
    assert used["known_play_rad"] == pytest.approx(5.0 * DEGREE) and used["known_play_sd_rad"] > 1.5 * DEGREE
    assert used["known_understeer_gradient_rad_m_s2"] == pytest.approx(0.45 * DEGREE)
    parts: _core.OcOffsetParts = {
        "drive_sd": 0.0,
        "pull_sd": 0.01,
        "wind_sd": 0.0,
        "set_up_sd": 0.0,
        "per_acceleration": 0.1,
    }
    sources = [cause.prior.source for cause in causes_of(parts, used, 1.0, truck.learned)]
    assert "learned by 25 trucks of fleet_priors.toml" in sources[0] and "the default" in sources[1]


def test_the_truck_s_own_values_replace_the_fleet_s(written: Path, tmp_path: Path) -> None:
    own = "play_deg = 2.0\nplay_sd_deg = 0.5\nset_up_for_crown = false\n"
    params = "[params]\npull_sd_m_s2 = 0.07\n"
    (tmp_path / "other.toml").write_text(TRUCK + own + '[priors]\nfrom = "fleet_priors.toml"\n' + params)
    used = params_of(oncenter.vehicle(tmp_path / "other.toml"), {})
    assert used["pull_sd_m_s2"] == 0.07 and used["set_up_probability_1"] == 0.0
    assert used["known_play_rad"] == pytest.approx(2.0 * DEGREE)


def test_own_params_replace_the_fleet_s_in_either_unit(written: Path, tmp_path: Path) -> None:
    own = "[params]\nknown_play_rad = 0.05\nknown_play_sd_rad = 0.01\n"
    (tmp_path / "rigid.toml").write_text(TRUCK + '[priors]\nfrom = "fleet_priors.toml"\n' + own)
    assert params_of(oncenter.vehicle(tmp_path / "rigid.toml"), {})["known_play_rad"] == 0.05


def test_the_fleet_s_spread_of_pulls_is_also_that_of_an_axle_set_up_for_the_crown(
    written: Path, tmp_path: Path
) -> None:
    own = "set_up_for_crown = true\n"
    (tmp_path / "rigid.toml").write_text(TRUCK + own + '[priors]\nfrom = "fleet_priors.toml"\n')
    assert params_of(oncenter.vehicle(tmp_path / "rigid.toml"), {})["known_pull_sd_m_s2"] == pytest.approx(
        np.hypot(0.03, 0.004)
    )


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ("[priors]\nfrom = 3\n", "'priors.from' must be text in quotes, got 3"),
        ("[priors]\nfrm = 'x'\n", "'priors.frm' is not a key of a vehicle file; did you mean from"),
    ],
)
def test_a_wrong_table_of_priors_is_refused_by_its_name(table: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "rigid.toml").write_text(TRUCK + table)
    with pytest.raises(OncenterError, match=re.escape(said)):
        oncenter.vehicle(tmp_path / "rigid.toml")


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("oncenter/priors-1", "oncenter/priors-2", "schema must be 'oncenter/priors-1', got 'oncenter/priors-2'"),
        ("[types.rigid]", "[types]\nrigid = 3\n[x]", "has no table [types.rigid]"),
        ("pull_sd_m_s2 = 0.03", "pull_sd_m_s2 = -1.0", "rigid.pull_sd_m_s2 must be a number from 0 to 1, got -1.0"),
        ("pull_sd_error_m_s2 = 0.004\n", "", "rigid.pull_sd_error_m_s2 must be a number from 0 to 1, got nothing"),
        ("play_sd_deg = 1.5", "", "types.rigid.play_sd_deg must be a number from 0 to 15, got nothing"),
        ("pull_sd_m_s2 =", "pul_sd_m_s2 =", "rigid.pul_sd_m_s2 is not a key of such a file; did you mean pull_sd"),
        ("trucks = 25", "trucks = nan", "types.rigid.trucks must be a number"),
        ("[priors]", "[priors", "is not TOML"),
    ],
)
def test_a_wrong_file_of_priors_is_refused_by_file_and_key(
    old: str, new: str, said: str, written: Path, tmp_path: Path
) -> None:
    written.write_text(written.read_text().replace(old, new))
    (tmp_path / "rigid.toml").write_text(TRUCK + '[priors]\nfrom = "fleet_priors.toml"\n')
    with pytest.raises(OncenterError) as error:
        oncenter.vehicle(tmp_path / "rigid.toml")
    assert said in str(error.value) and "fleet_priors.toml" in str(error.value) and "\n" not in str(error.value)


def test_a_truck_of_another_type_says_that_the_fleet_has_none_of_its_type(written: Path, tmp_path: Path) -> None:
    (tmp_path / "tractor.toml").write_text(TRUCK + '[priors]\nfrom = "fleet_priors.toml"\n')
    learned = oncenter.vehicle(tmp_path / "tractor.toml").learned
    assert learned is not None and learned.source == "by 25 trucks of fleet_priors.toml, which has no type tractor"


def test_most_axles_of_a_fleet_may_be_set_up_for_the_crown(written: Path, tmp_path: Path) -> None:
    written.write_text(written.read_text().replace("set_up_probability_1 = 0.08", "set_up_probability_1 = 0.9"))
    (tmp_path / "rigid.toml").write_text(TRUCK + '[priors]\nfrom = "fleet_priors.toml"\n')
    assert params_of(oncenter.vehicle(tmp_path / "rigid.toml"), {})["set_up_probability_1"] == 0.5


def test_pulls_that_do_not_spread_keep_a_prior(written: Path, tmp_path: Path) -> None:
    written.write_text(written.read_text().replace("pull_sd_m_s2 = 0.03", "pull_sd_m_s2 = 0.0"))
    (tmp_path / "rigid.toml").write_text(TRUCK + '[priors]\nfrom = "fleet_priors.toml"\n')
    assert params_of(oncenter.vehicle(tmp_path / "rigid.toml"), {})["pull_sd_m_s2"] == 0.02


def test_a_missing_file_of_priors_is_named(tmp_path: Path) -> None:
    (tmp_path / "rigid.toml").write_text(TRUCK + '[priors]\nfrom = "fleet_priors.toml"\n')
    with pytest.raises(OncenterError, match=r"fleet_priors.toml cannot be read"):
        oncenter.vehicle(tmp_path / "rigid.toml")


def test_an_outlier_does_not_take_the_spread_of_the_others(written: Path, tmp_path: Path) -> None:
    (tmp_path / "T001.toml").write_text(TRUCK + '[priors]\nfrom = "fleet_priors.toml"\n')
    used = params_of(oncenter.vehicle(tmp_path / "T001.toml"), {})
    assert used["pull_sd_m_s2"] == _core.default_params()["pull_sd_m_s2"] and used["known_play_sd_rad"] > 0.0


def test_drives_answered_by_learned_priors_do_not_teach_them_again(tmp_path: Path) -> None:
    drives = drives_of(fleet_of(0.05, 12, TWO_LOADS))
    folder = ledger(tmp_path, [drive | {"summary_params": "known_play_sd_rad=0.026"} for drive in drives])
    with pytest.raises(OncenterError, match="0 of 0 trucks"):
        fleet_priors.write_priors(folder, tmp_path / "priors.toml")

"""Priors that a fleet's trucks teach: the spread of pulls without that of their errors, the file, and who reads it."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from truck_rows import drive_row

import oncenter
from oncenter import _core
from oncenter.cli import run
from oncenter.errors import OncenterError
from oncenter.estimates.cause import causes_of
from oncenter.fleet import priors as fleet_priors
from oncenter.fleet.summaries import columns_of
from oncenter.learned_priors import KEYS, error_key
from oncenter.offset.inputs import params_of
from oncenter.signals import DEGREE
from oncenter.truck import population
from oncenter.truck.population import Drives, Learned, Population, population_of
from oncenter.truck.priors import priors_of

RATIO, DRIVES = 19.3, 6
FOUND = Population(
    pull_sd=Learned(0.03, 0.004, 25),
    play_mean=Learned(5.0 * DEGREE, 0.3 * DEGREE, 25),
    play_sd=Learned(1.5 * DEGREE, 0.2 * DEGREE, 25),
    gradient_mean=Learned(0.45 * DEGREE, 0.01 * DEGREE, 25),
    gradient_sd=Learned(0.1 * DEGREE, 0.01 * DEGREE, 25),
    set_up=Learned(0.08, 0.05, 25),
)
TRUCK = 'wheelbase_m = 3.7\nsteering_ratio = 19.3\ntraffic_side = "right"\n'


def trucks(pull_sd: float, count: int, loads: tuple[float, ...], seed: int = 1) -> list[Drives]:
    """Drives by the equations of oncenter.truck.now, written out."""
    random = np.random.default_rng(seed)
    return [_truck(random, pull_sd, loads) for _ in range(count)]


def _truck(random: np.random.Generator, pull_sd: float, loads: tuple[float, ...]) -> Drives:
    pull, bias, region = random.normal(0.0, (pull_sd, 0.1, 0.07))
    offset, play = random.normal(0.0, 0.5), random.normal(5.0, 1.5)
    gradients = 0.42 * np.array([loads[d % len(loads)] for d in range(DRIVES)])  # deg/(m/s^2)
    mean, rows = gradients.mean(), []
    for day, gradient in enumerate(gradients):
        pulled = RATIO * (mean + 0.65 * (gradient - mean))
        wind, error = random.normal(0.0, 0.02, 2)
        rows.append(
            drive_row(
                day,
                offset + pulled * (pull + error) + random.normal(0.0, 0.12),
                play_deg=play + random.normal(0.0, 0.4),
                neutral=bias + pull + wind + error,
                sds=(np.hypot(0.08, pulled * 0.02), 0.3, 0.02),
                with_neutral_deg_m_s2=pulled * 0.02**2,
                gradient=(gradient + random.normal(0.0, 0.02)) * DEGREE,
                bank=bias + 0.2 + region + random.normal(0.0, 0.07),
                ratio=RATIO,
            )
        )
    return rows


@pytest.mark.parametrize("pull_sd", [0.05, 0.1])
def test_the_spread_of_pulls_is_found_without_that_of_their_errors(
    pull_sd: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(population, "_PULL_SDS_M_S2", np.array([0.01, 0.03, 0.05, 0.07, 0.1, 0.14, 0.2]))
    monkeypatch.setattr(population, "_REGION_SDS_M_S2", (0.07,))
    monkeypatch.setattr(population, "_STEER_SDS_RAD", (0.001 * DEGREE,))
    found = population_of(trucks(pull_sd, 120, (0.75, 1.0, 1.35)), priors_of(), 0.05)
    assert found.pull_sd.value == pytest.approx(pull_sd, rel=0.2) and found.pull_sd.trucks == 120
    assert found.play_mean.value == pytest.approx(5.0 * DEGREE, abs=3.0 * found.play_mean.error)
    assert found.play_sd.value == pytest.approx(1.5 * DEGREE, abs=3.0 * found.play_sd.error)
    assert found.gradient_mean.value == pytest.approx(0.434 * DEGREE, rel=0.02)
    assert found.set_up is not None and found.set_up.value < 0.06


def tables(folder: Path, fleet: list[Drives]) -> Path:
    """A fleet's folder with these drives, all of one vehicle file."""
    rows = [
        {"truck": f"T{truck:03}", "start": row.start_s, "copy_of": None, "vehicle_file": "rigid"}
        | {"offset_status": "valid", "duration_s": row.length_s, "used_s": row.used_s}
        | {"side_force_left_s": row.left_s, "side_force_right_s": row.right_s}
        | columns_of(row, _core.default_params())
        for truck, drives in enumerate(fleet)
        for row in drives
    ]
    pl.DataFrame(rows, schema_overrides={"copy_of": pl.String, "summary_params": pl.String}).write_parquet(
        folder / "drives.parquet"
    )
    empty = pl.DataFrame({"truck": ["T000"], "verdict": ["within"], "watch": [False]})
    for name in ("trucks", "changes"):
        empty.write_parquet(folder / f"{name}.parquet")
    return folder


def test_trucks_of_one_load_teach_no_priors_and_the_line_says_why(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, file = tables(tmp_path, trucks(0.05, 12, (1.0,))), tmp_path / "priors.toml"
    assert run(["fleet", "priors", str(folder), "--output", str(file)]) == 1
    assert not file.exists()
    said = capsys.readouterr().err
    assert "0 of 12 trucks" in said and "one load cannot separate a pull from an accelerometer bias" in said


@pytest.fixture
def written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(fleet_priors, "population_of", lambda *_: FOUND)
    file = tmp_path / "fleet_priors.toml"
    fleet_priors.write_priors(tables(tmp_path, trucks(0.05, 12, (0.75, 1.35))), file)
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


def test_drives_answered_by_learned_priors_do_not_teach_them_again(tmp_path: Path) -> None:
    folder = tables(tmp_path, trucks(0.05, 12, (0.75, 1.35)))
    drives = pl.read_parquet(folder / "drives.parquet").with_columns(summary_params=pl.lit("known_play_sd_rad=0.026"))
    drives.write_parquet(folder / "drives.parquet")
    with pytest.raises(OncenterError, match="0 of 0 trucks"):
        fleet_priors.write_priors(folder, tmp_path / "priors.toml")

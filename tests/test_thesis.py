"""The thesis's figures and tables: their common rules, independent checks, and the page."""

from __future__ import annotations

import importlib
import math
import re
import subprocess
import sys
from collections import Counter
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.figure import Figure as Canvas

from oncenter import _core
from oncenter.cli import run as command
from oncenter.errors import OncenterError
from oncenter.signals import DEGREE
from oncenter.thesis import GROUPS, write
from oncenter.thesis.drawing import drawn, inline
from oncenter.thesis.figure import INK, Claim, Exhibit, Figure, Misprint
from oncenter.thesis.flowchart import steps
from oncenter.thesis.geometry import left_turn
from oncenter.thesis.identifiability import Model, rank
from oncenter.thesis.page import escape, in_order, number, page
from oncenter.thesis.steady import LAYOUTS, SATURATING, steady_truck

ROOT = Path(__file__).parents[1]
QUICK = ("schematics", "geometry", "single_track", "handling", "identifiability", "flowchart", "tables")


@pytest.fixture(scope="module")
def exhibits() -> list[Exhibit]:
    """The exhibits of the quick groups, computed once."""
    return [e for name in QUICK for e in importlib.import_module(f"oncenter.thesis.{name}").run(lambda fraction: None)]


def claims(exhibits: list[Exhibit]) -> dict[str, Claim]:
    return {claim.text: claim for exhibit in exhibits for claim in exhibit.claims}


# Rules of every group


def test_every_module_with_a_run_is_a_group_and_the_other_way_round() -> None:
    modules = {
        file.stem for file in (ROOT / "src/oncenter/thesis").glob("*.py") if "\ndef run(" in file.read_text("utf-8")
    }
    assert modules == set(GROUPS)


def test_no_two_exhibits_share_a_number(exhibits: list[Exhibit]) -> None:
    kinds = Counter((isinstance(exhibit, Figure), exhibit.number) for exhibit in exhibits)
    assert max(kinds.values()) == 1


def test_every_claim_has_a_finite_number_of_this_code(exhibits: list[Exhibit]) -> None:
    found = [claim for exhibit in exhibits for claim in exhibit.claims]
    assert len(found) > 30
    assert [claim for claim in found if claim.ours is None or not math.isfinite(claim.ours)] == []


def test_every_misprint_is_confirmed_by_its_check(exhibits: list[Exhibit]) -> None:
    found: list[Misprint] = [misprint for exhibit in exhibits for misprint in exhibit.misprints]
    assert len(found) >= 10
    assert [misprint.check for misprint in found if not misprint.shown] == []


def test_every_axis_names_its_quantity_and_unit(exhibits: list[Exhibit]) -> None:
    for figure in exhibits:
        if not isinstance(figure, Figure):
            continue
        canvas = Canvas(figsize=figure.size_in)
        figure.draw(canvas)
        shown = [axes for axes in canvas.axes if axes.axison]
        assert shown or any(axes.texts for axes in canvas.axes)
        for axes in shown:
            labels = [axes.get_ylabel(), axes.get_xlabel() or axes.figure.axes[-1].get_xlabel()]
            assert all(re.search(r"\(.+\)", text) for text in labels), f"figure {figure.number}: {labels}"


def test_tables_have_a_cell_under_every_head(exhibits: list[Exhibit]) -> None:
    tables = [exhibit for exhibit in exhibits if not isinstance(exhibit, Figure)]
    assert {table.number for table in tables} >= {"1", "2", "3", "4", "(7)-(12)", "(25)-(31)"}
    assert all(len(row) == len(table.columns) for table in tables for row in table.rows)


# Numbers checked in another way


def test_the_simulated_accelerometer_reads_the_thesiss_values_on_a_banked_road(exhibits: list[Exhibit]) -> None:
    for text, claim in claims(exhibits).items():
        if "cross slope" in text:
            assert claim.ours == pytest.approx(claim.thesis, rel=0.05), text


def test_the_offset_is_the_midpoint_of_both_directions_over_one_straight() -> None:
    _, figure = importlib.import_module("oncenter.thesis.validation_drives").run(lambda fraction: None)
    found = claims([figure])
    one, other, middle = (found[text] for text in found if text.startswith(("mean steering", "their midpoint")))
    assert one.ours is not None and other.ours is not None
    assert one.ours - other.ours > 2.0  # play and crown separate them
    assert middle.ours == pytest.approx(0.5 * (one.ours + other.ours))
    assert middle.ours == pytest.approx(2.04, abs=0.15)  # the offset of the simulated sensor


def test_the_thresholds_are_those_of_the_thesis(exhibits: list[Exhibit]) -> None:
    (table,) = (e for e in exhibits if not isinstance(e, Figure) and e.number == "4")
    assert len(table.claims) == 8
    others = [claim.text for claim in table.claims if claim.ours != pytest.approx(claim.thesis)]
    assert others == [], "core/params.toml has other defaults than src/oncenter/thesis/tables.py has of the thesis"


@pytest.mark.parametrize("layout", LAYOUTS)
def test_a_steady_turn_solved_axle_by_axle_is_equation_10_with_winklers_wheelbase(layout: str) -> None:
    """Two derivations: balance of the axles here, superposition in the simulator."""
    truck = steady_truck(layout)
    for curvature, a_y in ((1 / 50.0, 0.5), (-1 / 120.0, -1.5), (1 / 400.0, 2.5)):
        whole = truck.equivalent_wheelbase_m * curvature + truck.understeer_gradient * a_y
        assert truck.front_wheel_angle(curvature, a_y) == pytest.approx(whole, rel=1e-6)


def test_saturating_tyres_bend_the_handling_curve_only_at_high_lateral_acceleration() -> None:
    linear, bent = steady_truck("4x2"), steady_truck("4x2", tyres=SATURATING["tyres"] | {"friction": 0.4})
    needed = [[truck.front_wheel_angle(1 / 300.0, a_y) for a_y in (0.3, 3.7)] for truck in (linear, bent)]
    assert needed[1][0] == pytest.approx(needed[0][0], rel=1e-3)
    assert needed[1][1] > 1.2 * needed[0][1]
    assert math.isnan(bent.front_wheel_angle(1 / 300.0, 4.5))  # beyond the friction limit


def test_winklers_wheelbase_removes_most_of_the_effect_of_the_radius(exhibits: list[Exhibit]) -> None:
    left = [claim.ours for text, claim in claims(exhibits).items() if "left with the equivalent wheelbase" in text]
    assert len(left) == 3
    assert all(share is not None and share < 15.0 for share in left)


def test_wheel_speeds_by_ackermann_give_the_front_wheel_angle() -> None:
    angles = np.linspace(0.5, 40.0, 80) * DEGREE
    left, right = left_turn(3.7, 2.05, angles)
    assert (left < right).all()
    assert _core.front_wheel_angles(3.7, 2.05, left, right, exact=True) == pytest.approx(angles, abs=1e-10)
    assert _core.front_wheel_angles(3.7, 2.05, left, right, exact=False) == pytest.approx(angles, rel=0.06)


def test_the_steady_states_of_one_angle_or_of_two_have_rank_two() -> None:
    model = Model(2.0e5, 1.2e5, 1.2, 2.5, 9000.0, 3.0e4)
    one = np.array([(0.03, *model.steady(v, 0.03)) for v in np.linspace(3.0, 25.0, 30)])
    many = np.array(
        [(a, *model.steady(v, a)) for v, a in zip(np.linspace(3.0, 25.0, 30), np.linspace(0.01, 0.05, 30), strict=True)]
    )
    assert rank(one) == rank(many) == 2


def test_the_linear_model_stays_at_its_steady_state() -> None:
    model = Model(2.0e5, 1.2e5, 1.2, 2.5, 9000.0, 3.0e4)
    x_1, x_2, x_3, x_4 = (x[-1] for x in model.states(15.0, np.full(6000, 0.02)))
    assert (x_1, x_2, x_3) == pytest.approx(model.steady(15.0, 0.02), rel=1e-6)
    assert x_4 == pytest.approx(0.0, abs=1e-9)


def test_the_flowchart_follows_the_monitors_source() -> None:
    monitor, motion = (
        (ROOT / "core" / name).read_text(encoding="utf-8") for name in ("monitor/monitor.c", "signals/motion.c")
    )
    found = steps(monitor, motion)
    sections = [match[0] for step in found if (match := re.match(r"5\.1\.\d", step.text))]
    assert sections == ["5.1.1", "5.1.2", "5.1.3"]
    assert [step.leaves_with for step in found if "oc_gate" in step.calls] == [
        ("speed", "curvature", "longitudinal acceleration", "bank")
    ]
    changed = monitor.replace(
        "        /* 5.1.3: offset", "        /* a new step */\n        oc_new(state);\n\n        /* 5.1.3: offset"
    )
    (new,) = (step for step in steps(changed, motion) if step.text == "a new step")
    assert new.calls == ("oc_new",)


# The page


def test_the_page_is_one_file_that_loads_nothing_and_has_no_dead_link(tmp_path: Path) -> None:
    done: list[float] = []
    html = write(tmp_path / "new" / "folder", done.append, {"geometry": 1.0, "tables": 1.0}).read_text(encoding="utf-8")
    assert done == sorted(done)
    assert done[-1] == 1.0
    addresses = set(re.findall(r"https?://[^\"'\s<)]+", html))
    assert {address for address in addresses if not address.startswith("http://www.w3.org/")} == set()
    assert not re.search(r"<script|<link|<img|@import", html)
    ids = re.findall(r'\bid="([^"]+)"', html)
    assert [name for name, times in Counter(ids).items() if times > 1] == []
    assert set(re.findall(r'href="#([^"]+)"', html)) <= set(ids)
    files = set(re.findall(r'href="([\w.+-]+\.(?:svg|png))"', html))
    assert files == {f"{stem}.{kind}" for stem in ("figure-2", "figure-2-more") for kind in ("svg", "png")}
    assert all((tmp_path / "new" / "folder" / name).is_file() for name in files)


def test_each_figure_is_an_svg_and_a_png_of_its_own(tmp_path: Path) -> None:
    write(tmp_path, groups={"single_track": 1.0})
    for stem in ("figure-4", "figure-6"):
        assert (tmp_path / f"{stem}.png").read_bytes().startswith(b"\x89PNG")
        assert ElementTree.parse(tmp_path / f"{stem}.svg").getroot().tag.endswith("svg")


def test_the_same_figure_is_the_same_bytes_and_uses_the_pages_text_colour(exhibits: list[Exhibit]) -> None:
    figure = next(exhibit for exhibit in exhibits if isinstance(exhibit, Figure) and exhibit.number == "7")
    svg, png = drawn(figure)
    assert (svg, png) == drawn(figure)
    assert INK in svg
    element = inline(svg, figure.number)
    assert INK not in element
    assert "var(--text)" in element


def test_the_page_has_both_numbers_of_a_claim_and_a_dash_for_a_missing_one(exhibits: list[Exhibit]) -> None:
    figure = Figure(
        "99",
        "a <b>",
        lambda canvas: None,
        "K_us",
        (Claim("9.9", "c", 1.25, -0.5, "deg"), Claim("1", "d", None, 2.0, "")),
    )
    text = page([figure], {"99": "<svg ></svg>"}, "0")
    assert "a &lt;b&gt;" in text
    rows = re.findall(r'<td class="where">.*?</tr>', text, re.DOTALL)
    assert [("−0.5" in row, "—" in row) for row in rows] == [(False, True), (True, False)]  # by section


def test_numbers_have_three_significant_digits() -> None:
    assert [number(v) for v in (None, 0.0, -2e-14, 1234.5, 0.000125, -0.05)] == [
        "—",
        "0",
        "0",
        "1234",
        "0.000125",
        "−0.05",
    ]


def test_letters_get_their_subscripts_and_names_keep_their_underscores() -> None:
    assert escape("K_us/g, δ̂_o, a_y,max") == "K<sub>us</sub>/g, δ̂<sub>o</sub>, a<sub>y,max</sub>"
    assert escape("clean_time_s, m/s^2") == "clean_time_s, m/s²"


def test_figures_come_before_tables_and_both_by_number(exhibits: list[Exhibit]) -> None:
    numbers = [exhibit.number for exhibit in in_order(exhibits)]
    assert numbers.index("2") < numbers.index("2+") < numbers.index("15") < numbers.index("(7)-(12)")


# The verb


def test_without_matplotlib_one_line_names_the_extra(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert command(["thesis", "--output", str(tmp_path / "page")]) == 1
    assert "pip install 'oncenter[thesis]'" in capsys.readouterr().err
    assert not (tmp_path / "page").exists()


def test_a_folder_that_cannot_be_created_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(OncenterError, match=r"file.* cannot be written") as error:
        write(tmp_path / "file", groups={})
    assert (error.value.code, error.value.exit_code) == ("output", 2)


def test_the_command_line_loads_no_matplotlib_for_its_help() -> None:
    code = "import sys; from oncenter.cli import run; run(['thesis', '--help']); sys.exit('matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False, capture_output=True).returncode == 0

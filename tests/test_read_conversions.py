"""Conversions of MDF files: the right values, nothing run as code, and an error for an unsupported one."""

from __future__ import annotations

import copy
import math
import struct
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import can
import numpy as np
import pytest
from asammdf import MDF, Signal
from asammdf.blocks import v2_v3_blocks, v4_blocks
from asammdf.blocks.conversion_utils import conversion_transfer, from_dict
from can.io.mf4 import MF4Writer
from drive_frames import drive
from hypothesis import given
from hypothesis import strategies as st

from oncenter.errors import OncenterError
from oncenter.read import read
from oncenter.read.conversions import MAX_NESTED, NoNumbers, UnknownConversion, physical
from oncenter.read.formula import MAX_DEPTH, MAX_LENGTH, FormulaError, parse

# numexpr's check of a formula ignores text in quotation marks; then Python evaluates all of it.
ATTACK = '"\'" and (lambda: __import__("pathlib").Path("CODE_RAN").touch())() and "\'" or X'
TIME = np.arange(400) / 100
VERSIONS = {"old.mdf": "3.30", "new.mf4": "4.10"}
EVALUATORS = [
    (module, name, getattr(module, name))
    for module in (v2_v3_blocks, v4_blocks)
    for name in ("evaluate", "lambdify", "symbols")
]


@pytest.fixture(autouse=True)
def asammdf_as_it_comes(monkeypatch: pytest.MonkeyPatch) -> None:
    """The reader disables asammdf's evaluators in its process; another test may read in this one."""
    for evaluator in EVALUATORS:
        monkeypatch.setattr(*evaluator)


def written(
    path: Path, conversions: dict[str, Any], raw: np.ndarray | None = None, change: Callable[[MDF], None] | None = None
) -> Path:
    """A drive of three signals and a lamp, of which some have conversions."""
    signals = {
        "steering_wheel_angle": (0.4 * np.sin(TIME) if raw is None else raw, "rad"),
        "yaw_rate": (0.05 * np.sin(TIME), "rad/s"),
        "vehicle_speed": (np.full(400, 15.0), "m/s"),
        "lamp": (np.zeros(400), ""),
    }
    with MDF(version=VERSIONS[path.name]) as mdf:
        for name, (values, unit) in signals.items():
            conversion = conversions.get(name)
            mdf.append([Signal(values, TIME, name=name, unit=unit, conversion=conversion)])
        if change:
            change(mdf)
        mdf.save(path)
    return path


def answered(path: Path) -> subprocess.CompletedProcess[str]:
    """`oncenter signals` in the folder of the log."""
    command = [sys.executable, "-m", "oncenter", "signals", path.name]
    return subprocess.run(command, cwd=path.parent, capture_output=True, text=True, timeout=60)


def refusal(path: Path) -> str:
    with pytest.raises(OncenterError) as refused:
        read(path)
    assert refused.value.code == "unknown_conversion"
    assert refused.value.exit_code == 1
    assert "\n" not in str(refused.value)
    return str(refused.value)


@pytest.mark.parametrize("name", VERSIONS)
def test_a_formula_with_code_is_refused_and_not_run(name: str, tmp_path: Path) -> None:
    done = answered(written(tmp_path / name, {"yaw_rate": {"formula": ATTACK}}))
    assert not (tmp_path / "CODE_RAN").exists()
    assert done.returncode == 1
    assert "channel 'yaw_rate'" in done.stderr
    assert "__import__" in done.stderr
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize("name", VERSIONS)
def test_a_formula_of_the_time_channel_is_not_run_as_code(name: str, tmp_path: Path) -> None:
    def change(mdf: MDF) -> None:
        block = from_dict({"formula": ATTACK})
        for group in mdf.groups:
            group.channels[0].conversion = conversion_transfer(block, version=3 if name == "old.mdf" else 4)

    done = answered(written(tmp_path / name, {}, change=change))
    assert not (tmp_path / "CODE_RAN").exists()
    assert done.returncode == 1
    assert "channel 't" in done.stderr


def bus_log(path: Path, converted: dict[str, Any]) -> Path:
    """Frames in bus logging layout; asammdf reads the fields while it opens a file."""
    frames = path.with_suffix(".raw.mf4")
    with MF4Writer(frames) as writer:
        for frame in drive():
            writer.on_message_received(
                can.Message(frame.time, frame.identifier, frame.extended, data=frame.data, channel=1)
            )
    with MDF(frames) as mdf:
        for group in mdf.groups:
            for channel in group.channels:
                conversion = converted.get(channel.name.rsplit(".", 1)[-1])
                if conversion is not None:
                    channel.conversion = from_dict(conversion)
        mdf.save(path)
    return path


@pytest.mark.parametrize("field", ["time", "ID", "BusChannel"])
def test_opening_a_bus_log_runs_no_code(field: str, tmp_path: Path) -> None:
    done = answered(bus_log(tmp_path / "bus.mf4", {field: {"formula": ATTACK}}))
    assert not (tmp_path / "CODE_RAN").exists()
    assert (done.returncode, done.stderr.count("\n")) == (1, 1)
    assert field in done.stderr


def test_fields_of_a_frame_may_come_from_a_conversion_alone(tmp_path: Path) -> None:
    plain = read(bus_log(tmp_path / "plain.mf4", {})).table
    constant = {"a": 0.0, "b": 7.0}  # the bus's number for all frames, as CSS's loggers have it
    texts = {"val_0": 1, "text_0": "J1939-1", "val_1": 2, "text_1": "J1939-2"}
    for name, conversion in (("constant", constant), ("texts", texts)):
        assert read(bus_log(tmp_path / f"{name}.mf4", {"BusChannel": conversion})).table.equals(plain)
    assert "integers" in refusal(bus_log(tmp_path / "half.mf4", {"ID": {"a": 0.5, "b": 0.0}}))


@pytest.mark.parametrize("name", VERSIONS)
@pytest.mark.parametrize(
    "formula", ["pow(X,1)+0.1", "X1^1+0.1", "fabs(X)", "X**2", "exp(x)/10", "ln(x + 1.5)", "0.5*(X-32)/1.8", "-X^2"]
)
def test_a_formula_gives_the_right_values(formula: str, name: str, tmp_path: Path) -> None:
    text = formula if name == "new.mf4" else formula.replace("X1", "X")  # of which asammdf makes X1 in MDF 3
    table = read(written(tmp_path / name, {"steering_wheel_angle": {"formula": text}})).table
    x = 0.4 * np.sin(TIME)
    right = {
        "pow(X,1)+0.1": x + 0.1,
        "X1^1+0.1": x + 0.1,
        "fabs(X)": abs(x),
        "X**2": x * x,
        "exp(x)/10": np.exp(x) / 10,
        "ln(x + 1.5)": np.log(x + 1.5),
        "0.5*(X-32)/1.8": 0.5 * (x - 32) / 1.8,
        "-X^2": -x * x,
    }[formula]
    np.testing.assert_allclose(table["steering_wheel_angle_rad"].to_numpy()[:300], right[:300], atol=1e-9)


@pytest.mark.parametrize("name", VERSIONS)
@pytest.mark.parametrize("formula", ["X>0?X:0", "X2+1", "X; import os", "", "sysc(k)*X", "\x1b[2J\n" + "X " * 90])
def test_an_unsupported_formula_is_an_error_of_one_printable_line(formula: str, name: str, tmp_path: Path) -> None:
    said = refusal(written(tmp_path / name, {"steering_wheel_angle": {"formula": formula}}))
    assert said.startswith(f"{name}: the conversion of channel 'steering_wheel_angle' is not supported: formula '")
    assert said.isprintable()
    assert len(said) < 400


@pytest.mark.parametrize("name", VERSIONS)
def test_an_unsupported_formula_of_an_unused_channel_is_no_error(name: str, tmp_path: Path) -> None:
    path = written(tmp_path / name, {"lamp": {"formula": "X>0?X:0"}})
    assert read(path).table.equals(read(written(tmp_path / name, {})).table)


# Numbers, Python's own and those of a formula.


def formulas(depth: int = 3) -> st.SearchStrategy[str]:
    numbers = st.floats(0, 1e6, allow_nan=False).map(repr) | st.integers(0, 999).map(str) | st.sampled_from(["X", "X1"])
    if depth == 0:
        return numbers
    inner = formulas(depth - 1)
    pairs = st.tuples(inner, st.sampled_from(["+", "-", "*", "/", " + ", " / "]), inner).map("".join)
    powers = st.tuples(inner, st.sampled_from(["**", "^"]), st.sampled_from(["2", "-1", "0.5", "-X"]))
    calls = st.tuples(st.sampled_from(["sin", "cos", "atan", "exp", "sqrt", "abs", "tanh"]), inner)
    return (
        numbers
        | pairs
        | powers.map(lambda p: f"({p[0]}){p[1]}{p[2]}")
        | inner.map(lambda text: f"-{text}")
        | inner.map(lambda text: f"({text})")
        | calls.map(lambda call: f"{call[0]}({call[1]})")
    )


@given(formulas(), st.floats(-1e3, 1e3))
def test_a_formula_has_the_value_that_it_has_in_python(text: str, x: float) -> None:
    known = {name: getattr(np, name) for name in ("sin", "cos", "exp", "sqrt", "abs", "tanh")}
    scope = {**known, "atan": np.arctan, "X": np.float64(x), "X1": np.float64(x), "__builtins__": {}}
    with np.errstate(all="ignore"):
        try:
            right = eval(text.replace("^", "**"), scope)
        except (ZeroDivisionError, OverflowError):  # between two numbers of the formula; numpy has inf or NaN
            return
    if isinstance(right, complex):
        right = math.nan
    np.testing.assert_allclose(parse(text)(np.array([x]))[0], float(right), rtol=1e-12)


@given(st.text(alphabet="xX1.e+-*/^(), sincolgpwab\"'_\n:?[]{}", max_size=60) | st.text(max_size=40))
def test_any_text_is_a_formula_or_an_error_of_one_line(text: str) -> None:
    try:
        values = parse(text)(np.array([0.0, -1.0, np.nan]))
    except FormulaError as error:
        assert str(error).isprintable() and len(str(error)) < 120
    else:
        assert values.shape == (3,)


def test_long_and_deep_formulas_are_refused_and_do_not_exhaust_the_stack() -> None:
    deepest = "(" * (MAX_DEPTH - 1) + "X" + ")" * (MAX_DEPTH - 1)
    assert parse(deepest)(np.array([2.0]))[0] == 2.0
    assert parse("+".join("X" * (MAX_LENGTH // 2)))(np.array([1.0]))[0] == MAX_LENGTH // 2
    for text in (f"({deepest})", "-" * 200 + "X", "X" + "^X" * 200, "abs(" * 200 + "X", "X+" * MAX_LENGTH + "X"):
        with pytest.raises(FormulaError, match=r"deeper|longer"):
            parse(text)


# asammdf's own conversion is the oracle where it is correct.

WHOLE = np.concatenate([np.arange(-40, 300), [-1000, 5000]]).astype(np.int16)
REAL = np.concatenate([np.linspace(-12, 40, 301), [-1e4, 1e4, 0.0]])
POINTS = {"raw_0": -10, "phys_0": 1, "raw_1": 0, "phys_1": -2.5, "raw_2": 20, "phys_2": 9}
LINEAR = {"a": 0.5, "b": -4.0}
SCALES: dict[str, dict[str, Any]] = {
    "one to one": {},
    "linear": {"a": 0.0009765625, "b": -31.374},
    "constant": {"a": 0.0, "b": 4.0},
    "rational": {"P1": 0.01, "P2": 2.0, "P3": -3.0, "P4": 0.002, "P5": 0.0, "P6": 7.0},
    "rational, linear": {"P1": 0.0, "P2": 2.0, "P3": 0.0, "P4": 0.0, "P5": 0.0, "P6": 8.0},
    "formula": {"formula": "2*X/3 + sin(X) - 4"},
    "interpolated": {**POINTS, "interpolation": True},
    "nearest": POINTS,
}
TWICE = {"a": 2.0, "b": 0.0}
PARTS: dict[str, dict[str, Any]] = {
    "values to text or linear": {"val_0": 254, "text_0": "error", "val_1": 255, "text_1": "n/a"},
    "values to formula or linear": {"val_0": 3, "text_0": {"formula": "X*X"}, "val_1": 7, "text_1": "n/a"},
    "ranges to linear or linear": {"lower_0": 0, "upper_0": 9, "text_0": TWICE},
    "ranges to text": {"lower_0": 0, "upper_0": 9, "text_0": "a", "lower_1": 20, "upper_1": 39, "text_1": "b"},
}
RAWS = [WHOLE, WHOLE.astype(np.uint8), WHOLE.astype(np.float64), REAL]


def of_mdf_4(kind: str) -> Any:
    fields = copy.deepcopy(SCALES[kind] if kind in SCALES else PARTS[kind] | {"default_addr": LINEAR})
    return from_dict(fields) or v4_blocks.ChannelConversion(conversion_type=0)


@pytest.mark.parametrize("raw", RAWS, ids=lambda raw: str(raw.dtype))
@pytest.mark.parametrize("kind", [*SCALES, *PARTS])
def test_a_conversion_of_mdf_4_is_asammdfs(kind: str, raw: np.ndarray) -> None:
    block = of_mdf_4(kind)
    mixed = np.random.default_rng(1).permutation(raw)
    # From 100 values on, asammdf looks up ranges in another way, with an exclusive upper end also for integers.
    right = np.concatenate([block.convert(mixed[i : i + 90]).astype(float) for i in range(0, len(mixed), 90)])
    np.testing.assert_allclose(physical(block, mixed), right, rtol=1e-12, atol=1e-12)


def old(kind: int, **fields: Any) -> Any:
    return v2_v3_blocks.ChannelConversion(conversion_type=kind, **fields)


OLD = {
    "none": old(65535),
    "linear": old(0, a=0.5, b=-3.0),
    "interpolated": old(1, ref_param_nr=3, raw_0=-9.0, phys_0=1.0, raw_1=0.0, phys_1=5.0, raw_2=9.0, phys_2=-1.0),
    "nearest": old(2, ref_param_nr=3, raw_0=-9.0, phys_0=1.0, raw_1=0.0, phys_1=5.0, raw_2=9.0, phys_2=-1.0),
    "polynomial": old(6, P1=2.0, P2=1.0, P3=0.01, P4=3.0, P5=0.5, P6=0.25),
    "polynomial, linear": old(6, P1=2.0, P2=0.0, P3=0.0, P4=3.0, P5=0.0, P6=0.0),
    "rational": old(9, P1=0.01, P2=2.0, P3=-3.0, P4=0.002, P5=0.0, P6=7.0),
    "formula": old(10, formula="2*X1/3 + sin(X1) - 4"),
    "ranges to text or linear": old(
        12, ref_param_nr=2, lower_0=0.0, upper_0=9.5, text_0=b"n/a", default_addr=b'"0.5*{X}+1"'
    ),
}


@pytest.mark.parametrize("raw", [WHOLE, WHOLE.astype(np.uint8), REAL], ids=lambda a: str(a.dtype))
@pytest.mark.parametrize("kind", OLD)
def test_a_conversion_of_mdf_3_is_asammdfs(kind: str, raw: np.ndarray) -> None:
    right = OLD[kind].convert(raw).astype(float)
    np.testing.assert_allclose(physical(OLD[kind], raw), right, rtol=1e-12, atol=1e-12)


def test_exponential_and_logarithmic_conversions_apply_the_inverse_of_their_name() -> None:
    """Their parameters are of the way from physical to raw, raw = (P3 + P1 exp(P2 phys)) / P6 + P7 for kind 7."""
    speed, p = np.linspace(0.1, 3.0, 50), {"P1": 2.0, "P2": 0.7, "P3": 0.4, "P5": 0.0, "P6": 1.5, "P7": -2.0}
    raw = (p["P3"] + p["P1"] * np.exp(p["P2"] * speed)) / p["P6"] + p["P7"]
    np.testing.assert_allclose(physical(old(7, P4=0.0, **p), raw), speed)
    raw = (p["P3"] + p["P1"] * np.log(p["P2"] * speed)) / p["P6"] + p["P7"]
    np.testing.assert_allclose(physical(old(8, P4=0.0, **p), raw), speed)
    q = {"P1": 0.0, "P2": 0.0, "P3": 5.0, "P4": 2.0, "P5": 0.7, "P6": 0.4, "P7": -2.0}
    raw = q["P3"] / (q["P4"] * np.exp(q["P5"] * speed) + q["P6"]) + q["P7"]
    np.testing.assert_allclose(physical(old(7, **q), raw), speed)
    assert np.isnan(physical(old(7, P4=1.0, **p), raw)).all()


RANGES = {"lower_0": 0, "upper_0": 9, "phys_0": 1.0, "lower_1": 10, "upper_1": 19, "phys_1": 2.0, "default": -1.0}


def test_a_range_of_integers_includes_its_upper_end_and_one_of_floats_does_not() -> None:
    block = from_dict({**RANGES})
    assert physical(block, np.array([-1, 0, 5, 9, 10, 19, 20])).tolist() == [-1, 1, 1, 1, 2, 2, -1]
    values = physical(block, np.array([-0.5, 0.0, 8.9, 9.0, 9.5, 10.0, 18.9, 19.0, np.nan]))
    assert values.tolist() == [-1, 1, 1, -1, -1, 2, 2, -1, -1]


def test_a_table_need_not_be_in_order_to_have_ranges() -> None:
    turned = {f"{k[:-1]}{1 - int(k[-1])}" if k[-1].isdigit() else k: v for k, v in RANGES.items()}
    values = np.arange(-3, 30)
    assert physical(from_dict(turned), values).tolist() == physical(from_dict({**RANGES}), values).tolist()


@pytest.mark.parametrize("kind", [9, 10, 11])
def test_conversions_to_text_give_no_numbers(kind: int) -> None:
    block = from_dict({"a": 1.0, "b": 0.0})
    block.conversion_type = kind
    with pytest.raises(NoNumbers):
        physical(block, WHOLE)
    for texts in ({"val_0": 1, "text_0": "on"}, {"lower_0": 1, "upper_0": 2, "text_0": "on"}):
        with pytest.raises(NoNumbers):
            physical(from_dict(texts), WHOLE)


@pytest.mark.parametrize("raw", [np.zeros(3, "S4"), np.zeros((3, 8), np.uint8), np.zeros(3, [("a", "u1")])], ids=str)
def test_channels_that_are_not_numeric_give_no_numbers(raw: np.ndarray) -> None:
    for block in (None, from_dict({"a": 1.0, "b": 0.0})):
        with pytest.raises(NoNumbers):
            physical(block, raw)


@pytest.mark.filterwarnings("error")
def test_division_by_zero_or_invalid_parameters_give_no_number() -> None:
    nan = math.nan
    for conversion in (
        {"a": nan, "b": 0.0},
        {"a": 1.0, "b": math.inf},
        dict.fromkeys((f"P{i}" for i in range(1, 7)), 0.0),
        {"formula": "1/0"},
        {"formula": "log(-1) + 0*X"},
        {"formula": "1e999*X - 1e999*X"},
        {"raw_0": 0.0, "phys_0": nan},
        {"lower_0": -1e9, "upper_0": 1e9, "phys_0": nan, "default": nan},
        {"val_0": 1, "text_0": {"a": nan, "b": 0.0}, "default_addr": {"formula": "X/0"}},
    ):
        assert np.isnan(physical(from_dict({**conversion}), WHOLE)).all(), conversion
    assert np.isnan(physical(old(6, **dict.fromkeys((f"P{i}" for i in range(1, 7)), 0.0)), WHOLE)).all()


def test_invalid_tables_are_unsupported() -> None:
    unordered = {"raw_0": 5.0, "phys_0": 0.0, "raw_1": 1.0, "phys_1": 2.0}
    for conversion in (
        unordered,
        {**unordered, "interpolation": True},
        {"raw_0": math.nan, "phys_0": 0.0},
        {**RANGES, "upper_0": 12},
        {**RANGES, "lower_0": math.nan},
    ):
        with pytest.raises(UnknownConversion, match="table"):
            physical(from_dict({**conversion}), WHOLE)
    lying = from_dict({"raw_0": 0.0, "phys_0": 1.0})
    lying.val_param_nr = 4
    with pytest.raises(UnknownConversion, match="shorter than its declared length"):
        physical(lying, WHOLE)
    strange = from_dict({"a": 1.0, "b": 0.0})
    strange.conversion_type = 77
    with pytest.raises(UnknownConversion, match="kind 77"):
        physical(strange, WHOLE)


def test_nested_conversions_are_limited() -> None:
    inner: dict[str, Any] = {"a": 3.0, "b": 0.0}
    for _ in range(MAX_NESTED):
        inner = {"val_0": 1000, "text_0": "n/a", "default_addr": inner}
    assert (physical(from_dict(inner), WHOLE) == 3.0 * WHOLE).all()
    looped: Any = from_dict({"val_0": 1000, "text_0": "n/a", "default_addr": {"a": 1.0, "b": 0.0}})
    looped.referenced_blocks["default_addr"] = looped
    with pytest.raises(UnknownConversion, match="nested"):
        physical(looped, WHOLE)


@pytest.mark.parametrize("name", VERSIONS)
@pytest.mark.parametrize("kind", SCALES)
def test_channels_of_a_file_have_the_numbers_that_asammdf_gives(kind: str, name: str, tmp_path: Path) -> None:
    raw = (100 * np.sin(TIME)).astype(np.int16)
    path = written(tmp_path / name, {"steering_wheel_angle": {**SCALES[kind]}}, raw)
    with MDF(path) as mdf:
        right = mdf.get("steering_wheel_angle").samples
    values = read(path).table["steering_wheel_angle_rad"].to_numpy()
    np.testing.assert_allclose(values, right.astype(float), rtol=1e-12, atol=1e-12)


def test_values_that_a_table_marks_as_not_available_are_missing(tmp_path: Path) -> None:
    raw = np.full(400, 20, np.uint8)
    raw[100:300] = 255
    table = {"val_0": 255, "text_0": "not available", "default_addr": {"a": 0.01, "b": 0.0}}
    values = read(written(tmp_path / "new.mf4", {"steering_wheel_angle": table}, raw)).table
    assert np.isnan(values["steering_wheel_angle_rad"].to_numpy()[110:290]).all()
    assert values["steering_wheel_angle_rad"][50] == 0.2


def test_the_time_of_a_channel_is_converted_as_well(tmp_path: Path) -> None:
    def change(mdf: MDF) -> None:
        for group in mdf.groups:
            group.channels[0].conversion = from_dict({"formula": "X/2"})

    time = read(written(tmp_path / "new.mf4", {}, change=change)).table["time_s"]
    assert time[-1] - time[0] == pytest.approx(TIME[-1] / 2, abs=0.02)


@pytest.mark.parametrize("name", VERSIONS)
def test_a_damaged_conversion_block_is_an_error(name: str, tmp_path: Path) -> None:
    """asammdf ignores such a block, and the stored values would be used."""
    table = {"raw_0": 0.0, "phys_0": 4711.125, "raw_1": 1.0, "phys_1": 4711.125}
    path = written(tmp_path / name, {"steering_wheel_angle": table})
    content = bytearray(path.read_bytes())
    value = struct.pack("<d", 4711.125)
    assert content.count(value) >= 2
    at = content.find(value) - 8
    # The number of parameters is in MDF 4 before two limits, in MDF 3 right before the table.
    place, count = (at - 2, 2) if name == "old.mdf" else (at - 18, 4)
    assert struct.unpack_from("<H", content, place)[0] == count
    struct.pack_into("<H", content, place, 60_000)
    path.write_bytes(content)
    assert "damaged" in refusal(path)


def test_a_unit_may_be_given_only_at_the_conversion(tmp_path: Path) -> None:
    def change(mdf: MDF) -> None:
        channel = mdf.groups[0].channels[1]
        channel.conversion = from_dict({"a": 1.0, "b": 0.0, "unit": "deg"})
        channel.unit = ""

    table = read(written(tmp_path / "new.mf4", {}, np.full(400, 90.0), change)).table
    assert table["steering_wheel_angle_rad"][100] == pytest.approx(math.pi / 2)


def test_samples_marked_invalid_are_not_available(tmp_path: Path) -> None:
    invalid = (TIME > 1) & (TIME < 3)
    path = tmp_path / "new.mf4"
    with MDF(version="4.10") as mdf:
        for name, bits in (("steering_wheel_angle", invalid), ("yaw_rate", None)):
            mdf.append([Signal(np.full(400, 7, np.int16), TIME, name=name, unit="deg" if bits is not None else "deg/s",
                               conversion={"a": 0.5, "b": 0.0}, invalidation_bits=bits)])  # fmt: skip
        mdf.save(path)
    angle = read(path).table["steering_wheel_angle_rad"].to_numpy()
    assert np.isnan(angle[110:290]).all()
    assert angle[50] == pytest.approx(math.radians(3.5))

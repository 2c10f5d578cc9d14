"""Before and after: what a calibration or a repair changed, how sure, and what to do next."""

import json
import re
from pathlib import Path
from typing import Any

import polars as pl
import pytest
from test_estimate import steady_drive

import oncenter as oc
from oncenter.cli import run
from oncenter.offset.compare import compared, offset_of, read_answer

TRUCK = "scania_r730_4x2"


def answer_json(value: float | None, *, log: str, half_width: float = 0.1, **other: Any) -> dict[str, Any]:
    """What `oncenter offset --json` writes, as far as a comparison reads it; deg."""
    interval = None if value is None else [value - half_width, value + half_width]
    return {
        "schema": "oncenter/offset-2",
        "log": log,
        "vehicle": other.pop("vehicle", "truck"),
        "method": other.pop("method", "joint"),
        "offset": {
            "value": value,
            "ci95": interval,
            "ci95_drive": interval,
            "status": "valid",
            "not_identifiable": [
                {"cause": "pull", "sd_m_s2": 0.05, "sd_deg": 0.4},
                {"cause": "mean_wind", "sd_m_s2": 0.02, "sd_deg": 0.1},
            ],
            **other,
        },
    }


def between(before: float | None, after: float | None, limit_deg: float = 2.0, **of_after: Any) -> Any:
    offsets = (answer_json(before, log="before.log"), answer_json(after, log="after.log", **of_after))
    return compared(*(offset_of(offset, offset["log"]) for offset in offsets), limit_deg)


@pytest.mark.parametrize(
    ("before", "after", "state", "headline"),
    [
        (3.0, 0.1, "successful", "Calibration successful: the offset changed by -2.9"),
        (3.0, 3.1, "unchanged", "Calibration not successful: the offset did not change"),
        (3.0, 6.0, "wrong_direction", "Calibration not successful: the offset changed by +3.0"),
        (6.0, 3.5, "not_successful", "Calibration not complete: the offset changed by -2.5"),
        (0.3, -0.2, "within_limit", "Within the limit before and after"),
        (3.0, None, "undecided", "Undecided: the drive after has no offset"),
    ],
)
def test_a_comparison_says_whether_the_calibration_was_successful(
    before: float, after: float | None, state: str, headline: str
) -> None:
    found = between(before, after)
    assert found.state == state
    assert found.headline.startswith(headline)


def test_a_correction_with_the_reversed_sign_is_named_with_the_correction_that_mends_it() -> None:
    assert (
        between(3.0, 6.0).action
        == "The sign of the correction was reversed. Add -6.0 deg (left is positive), then compare again."
    )


def test_an_offset_that_has_not_converged_decides_nothing() -> None:
    assert between(3.0, 0.1, status="converging").state == "undecided"


def test_the_whole_interval_after_decides_and_the_printed_numbers_agree() -> None:
    assert between(5.0, 2.11).state == "not_successful"
    assert between(5.0, 1.89).state == "successful"
    both_sides = between(5.0, 1.97)
    assert both_sides.state == "undecided" and "limit 2 deg inside the interval after" in both_sides.headline
    assert "Log another drive" in both_sides.action
    narrow = between(5.0, 1.89, half_width=0.104)
    assert "from +5.0 to +1.89 deg" in narrow.headline and "+1.89 deg ± 0.10" in str(narrow)


def test_each_offset_of_a_comparison_has_the_code_and_the_word_of_the_verdict() -> None:
    found = between(3.0, 0.1)
    given = found.to_dict()
    assert (given["before"]["verdict"], given["after"]["verdict"]) == ("recalibrate", "within")
    assert "Recalibrate" in str(found) and "Within the limit" in str(found)


def test_whole_turns_are_no_correction_after_a_repair_either() -> None:
    assert (
        between(3.0, 362.0).action.startswith("Set the zero of the sensor") and "Add" not in between(3.0, 362.0).action
    )


def test_a_pull_cancels_in_the_change_and_the_wind_of_both_drives_does_not() -> None:
    found = between(3.0, 0.1)
    assert found.half_width_deg == pytest.approx((2 * 0.1**2 + 2 * (1.96 * 0.1) ** 2) ** 0.5)
    assert found.shared_half_width_deg == pytest.approx(1.96 * 0.4)


def test_a_pull_that_another_load_makes_larger_stays_in_the_change_by_the_difference() -> None:
    heavier = [{"cause": "pull", "sd_m_s2": 0.05, "sd_deg": 0.7}]
    found = between(3.0, 0.1, not_identifiable=heavier)
    assert found.half_width_deg == pytest.approx((2 * 0.1**2 + (1.96 * 0.3) ** 2) ** 0.5)


@pytest.mark.parametrize(
    ("other", "code"),
    [({"vehicle": "another"}, "different_trucks"), ({"method": "thesis"}, "usage")],
)
def test_two_trucks_or_two_methods_are_refused(other: dict[str, Any], code: str) -> None:
    before = answer_json(3.0, log="before.log")
    after = answer_json(0.1, **{"log": "after.log", **other})
    with pytest.raises(oc.OncenterError) as refused:
        compared(offset_of(before, "b.json"), offset_of(after, "a.json"), 2.0)
    assert refused.value.code == code


def test_a_drive_is_recognised_by_its_signals_not_by_its_date_length_or_name(tmp_path: Path) -> None:
    """A logger without a clock gives its drives one date, and two folders may have a log of the same name each."""
    truck = oc.vehicle(TRUCK)

    def of(name: str, drive: oc.Signals) -> dict[str, Any]:
        of_log = {"log": name, "start_time": "2026-03-02T07:00:00Z"}
        return oc.offset(drive, truck).to_dict() | of_log

    (tmp_path / "drive.toml").write_text('base = "thesis_drive"\ndrive.duration_s = 600\n')
    first, second = (oc.simulate(tmp_path / "drive.toml", seed)[0] for seed in (1, 2))
    assert first.duration_s == second.duration_s
    before, other = of("drive.log", first), of("drive.log", second)
    compared(offset_of(before, "b.json"), offset_of(other, "a.json"), 2.0)
    first.table.head(first.ticks // 2).write_csv(tmp_path / "part.csv")
    for again in (of("copy.log", first), of("part.csv", oc.read(tmp_path / "part.csv")), before):
        again |= {"start_time": "2026-03-09T07:00:00Z"} if again is not before else {}
        with pytest.raises(oc.OncenterError, match=r"before \(drive\.log\) and after .* are of one drive") as refused:
            compared(offset_of(before, "b.json"), offset_of(again, "a.json"), 2.0)
        assert refused.value.code == "usage" and again["log"] in str(refused.value)


@pytest.mark.parametrize(
    ("content", "why"),
    [
        (b"{", "not JSON"),
        (b'{"schema": "oncenter/offset-9"}', "offset-9"),
        (b'{"schema": "oncenter/offset-2"}', "wrong or missing: 'offset'"),
        (b'{"schema": "oncenter/error-1", "message": "no such log"}', "it holds an error: no such log"),
        (b'{"schema": "oncenter/offset-2", "offset": {"value": NaN}}', "NaN"),
        (b"[1]", "it has no schema"),
        (b'{"schema": [' + b"[" * 400 + b"]" * 400 + b"]}", "it has no schema"),
        (b'{"schema": "' + b"x" * 100_000 + b'"}', "its schema is 'xxx"),
        (b'{"schema": "oncenter/error-1", "message": {}}', "it holds an error"),
        (None, "No such file"),
    ],
)
def test_a_file_that_is_no_answer_is_refused_in_one_line(
    content: bytes | None, why: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "before.json"
    if content is not None:
        file.write_bytes(content)
    assert run(["compare", str(file), str(file)]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert str(file) in said
    assert why in said


@pytest.mark.parametrize(
    "number", ["1" + "0" * 400, "-1" + "0" * 400, "1e400", "-1e400", "1e300", "NaN", "-Infinity", '"3"']
)
@pytest.mark.parametrize("place", ["value", "ci95", "ci95_drive", "limit_deg", "sd_deg", "sd_m_s2"])
def test_a_number_that_no_answer_has_is_refused_wherever_it_stands(place: str, number: str, tmp_path: Path) -> None:
    text = json.dumps(answer_json(3.0, log="a.log") | {"limit_deg": 2.0})
    changed = re.sub(rf'("{place}": \[?)[-+.\de]+', rf"\g<1>{number}", text)
    assert changed != text
    (tmp_path / "answer.json").write_text(changed)
    with pytest.raises(oc.OncenterError) as refused:
        offset_of(read_answer(tmp_path / "answer.json"), "answer.json")
    assert (refused.value.code, refused.value.exit_code) == ("not_an_answer", 2)
    assert len(str(refused.value)) < 400


def test_two_logs_and_their_two_answers_give_the_same_comparison(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name, offset_deg in (("before", 3.0), ("after", 0.2)):
        scenario, log = tmp_path / f"{name}.toml", tmp_path / f"{name}.log"
        scenario.write_text(
            f'base = "thesis_drive"\ndrive.duration_s = 900\nsensors.steering_wheel_angle.offset_deg = {offset_deg}\n',
            encoding="utf-8",
        )
        assert run(["simulate", str(scenario), "--seed", str(9 - int(offset_deg)), "--output", str(log)]) == 0
        capsys.readouterr()
        assert run(["offset", str(log), "--vehicle", TRUCK, "--json"]) == 0
        # As PowerShell's > writes it.
        (tmp_path / f"{name}.json").write_text(capsys.readouterr().out, encoding="utf-16")
    said = []
    for ending in ("log", "json"):
        assert (
            run(
                [
                    "compare",
                    *(str(tmp_path / f"{n}.{ending}") for n in ("before", "after")),
                    "--vehicle",
                    TRUCK,
                    "--json",
                    "--in-given-order",
                ]
            )
            == 0
        )
        said.append(json.loads(capsys.readouterr().out))
    assert said[0] == said[1]
    assert said[0]["state"] == "successful"
    low, high = said[0]["change"]["ci95"]
    assert low < 0.2 - 3.0 < high


def test_a_log_without_a_vehicle_file_is_refused_with_what_would_do(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["compare", "before.log", "after.log"]) == 2
    assert "before.log is a log, which needs --vehicle FILE" in capsys.readouterr().err


def dated(folder: Path, name: str, offset_deg: float, start: str | None) -> Path:
    """A log with this offset; its stamps begin at zero, and its metadata may have the start."""
    table = steady_drive(offset_deg=offset_deg).table
    table = table.head(-100) if name == "b" else table  # another drive
    path = folder / f"{name}.parquet"
    table.write_parquet(path, metadata={} if start is None else {"start_time": start})
    return path


def test_the_earlier_drive_is_before_in_whichever_order_the_two_are_given(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    first = dated(tmp_path, "first", 4.0, "2026-03-02T07:00:00Z")
    second = dated(tmp_path, "second", 0.5, "2026-03-09T07:00:00Z")
    answers = []
    for log in (first, second):
        assert run(["offset", str(log), "--vehicle", TRUCK, "--json"]) == 0
        answers.append(log.with_suffix(".json"))
        answers[-1].write_text(capsys.readouterr().out)
    for one, other in ((first, second), (second, first), answers, answers[::-1]):
        assert run(["compare", str(one), str(other), "--vehicle", TRUCK, "--json"]) == 0
        given = json.loads(capsys.readouterr().out)
        assert (Path(given["before"]["log"]).stem, Path(given["after"]["log"]).stem) == ("first", "second")


@pytest.mark.parametrize(
    ("starts", "why"),
    [
        ((None, None), "no start time in"),
        (("2026-03-02T07:00:00Z", None), "no start time in"),
        (("2026-03-02T07:00:00Z", "2026-03-02T07:00:00Z"), "both drives have the same start time"),
    ],
)
def test_without_two_start_times_the_user_gives_the_order(
    starts: tuple[str | None, str | None], why: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    logs = [str(dated(tmp_path, name, 1.0, start)) for name, start in zip("ab", starts, strict=True)]
    assert run(["compare", *logs, "--vehicle", TRUCK]) == 2
    error = capsys.readouterr().err
    assert why in error
    assert "--in-given-order" in error
    assert run(["compare", *logs, "--vehicle", TRUCK, "--in-given-order", "--json"]) == 0
    assert Path(json.loads(capsys.readouterr().out)["before"]["log"]).name == "a.parquet"


def test_a_drive_that_is_named_as_before_and_was_driven_after_is_refused_by_name(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    logs = [str(dated(tmp_path, name, 1.0, f"{year}-03-02T07:00:00Z")) for name, year in (("a", 2017), ("b", 2016))]
    assert run(["compare", *logs, "--vehicle", TRUCK, "--in-given-order"]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and "exchange them" in error
    assert all(said in error for said in ("a.parquet", "2017-03-02", "b.parquet", "2016-03-02"))


@pytest.mark.parametrize(
    ("starts", "why"),
    [
        ((None, None), "no start time in a.parquet and b.parquet"),
        (("2026-03-02T07:00:00Z", None), "no start time in b.parquet"),
        (("2026-03-02T07:00:00Z",) * 2, "both drives have the same start time"),
    ],
)
def test_without_two_dates_the_comparison_and_the_certificate_say_that_the_order_is_the_user_s(
    starts: tuple[str | None, str | None], why: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page = tmp_path / "page.html"
    logs = [str(dated(tmp_path, name, 1.0, start)) for name, start in zip("ab", starts, strict=True)]
    assert run(["compare", *logs, "--vehicle", TRUCK, "--in-given-order", "--report", str(page)]) == 0
    said = f"{capsys.readouterr().out} {page.read_text(encoding='utf-8')}"
    assert said.count("The user gave the order of the drives: ") == 2
    assert said.replace(f"{tmp_path}/", "").count(f"order of the drives: {why}.") == 2
    later = [str(dated(tmp_path, name, 1.0, f"2026-03-0{day}T07:00:00Z")) for day, name in enumerate("ab", 2)]
    assert run(["compare", *later, "--vehicle", TRUCK, "--report", str(page)]) == 0
    assert "order of the drives" not in f"{capsys.readouterr().out} {page.read_text(encoding='utf-8')}"


def test_python_refuses_an_answer_before_that_was_driven_after(tmp_path: Path) -> None:
    truck = oc.vehicle(TRUCK)
    first = oc.offset(oc.read(dated(tmp_path, "first", 4.0, "2026-03-02T07:00:00Z")), truck)
    second = oc.offset(oc.read(dated(tmp_path, "second", 0.5, "2026-03-09T07:00:00Z")), truck)
    oc.compare(first, second)
    with pytest.raises(oc.OncenterError, match="exchange them") as refused:
        oc.compare(second, first)
    assert refused.value.code == "drive_order"


def test_answers_of_two_trucks_are_not_compared(tmp_path: Path) -> None:
    truck = oc.vehicle(TRUCK)
    table = steady_drive().table
    answers = []
    for vin in ("YS2R4X20001234567", "YS2R4X20007654321"):
        table.with_columns(pl.lit(vin).alias("vin")).write_parquet(tmp_path / f"{vin}.parquet")
        answers.append(oc.offset(oc.read(tmp_path / f"{vin}.parquet"), truck))
    with pytest.raises(oc.OncenterError, match="VIN") as refused:
        oc.compare(*answers)
    assert refused.value.code == "different_trucks"


def test_the_certificate_says_what_the_comparison_says_and_has_lines_to_fill_in(tmp_path: Path) -> None:
    for name, value in (("before", 3.0), ("after", 0.1)):
        (tmp_path / f"{name}.json").write_text(json.dumps(answer_json(value, log=f"{name} <b>.log")))
    page = tmp_path / "certificate.html"
    places = [*(str(tmp_path / f"{name}.json") for name in ("before", "after")), "--in-given-order"]
    assert run(["compare", *places, "--report", str(page)]) == 0
    text = page.read_text(encoding="utf-8").replace("\N{NO-BREAK SPACE}", " ")
    assert "Calibration successful" in text and "The offset changed by −2.9" in text
    assert "between +0.0 and +0.2 deg" in text
    assert "before &lt;b&gt;.log" in text and "<b>.log" not in text
    for blank in ("VIN", "Plate", "Mileage", "Correction that was entered", "Name, signature"):
        assert blank in text
    assert run(["compare", *places, "--report", places[0]]) == 2  # the page would replace the answer

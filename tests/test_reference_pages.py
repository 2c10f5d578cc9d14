"""docs/reference: the pages are up to date and complete, and every JSON object is as its published schema says."""

import json
import runpy
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jsonschema
import polars as pl
import pytest
from referencing import Registry, Resource
from test_estimate import steady_drive

import oncenter as oc
from oncenter.cli import run
from oncenter.vehicle import Sensors, Vehicle
from oncenter.vehicle_keys import SIGNAL_ENTRY

ROOT = Path(__file__).parents[1]
FOLDER = ROOT / "docs" / "reference"
TRUCK = "scania_r730_4x2"


@pytest.fixture(scope="module")
def make() -> dict[str, Any]:
    return runpy.run_path(str(ROOT / "docs" / "make_reference.py"))


def test_no_schema_is_left_that_the_command_no_longer_writes(make: dict[str, Any]) -> None:
    assert set((FOLDER / "schema").iterdir()) <= set(make["made"]())


def test_every_command_and_option_is_on_the_page_with_an_example(make: dict[str, Any]) -> None:
    page = (FOLDER / "commands.md").read_text(encoding="utf-8")
    sections = dict(section.split("\n", 1) for section in page.split("\n## "))
    for path, command in make["commands"]():
        missing = [name for each in command.params for name in each.opts if f"`{name}`" not in sections[path]]
        assert [name for name in missing if name.startswith("--") and name != "--help"] == [], path
        assert hasattr(command, "commands") or f"Example:\n\n```sh\n{path}" in sections[path], path
        assert all(about.strip() for about in make["helps_of"](command).values()), path


def test_the_help_of_every_command_is_whole_sentences(make: dict[str, Any]) -> None:
    for path, command in make["commands"]():
        paragraphs = [part.strip() for part in command.help.split("\n\n")]
        assert [text for text in paragraphs if not (text[0].isupper() and text[-1] == ".")] == [], path


def test_every_key_of_a_vehicle_file_is_on_the_page() -> None:
    page = (FOLDER / "vehicle_file.md").read_text(encoding="utf-8")
    keys = {*Vehicle.model_fields, *Sensors.model_fields, *SIGNAL_ENTRY}
    assert [key for key in keys if f"`{key}`" not in page and f"## [{key}]" not in page] == []


def test_every_command_that_prints_json_has_a_schema(make: dict[str, Any]) -> None:
    with_json = {path for path, command in make["commands"]() if "json" in {each.name for each in command.params}}
    page = (FOLDER / "json.md").read_text(encoding="utf-8")
    described = {path for path in with_json if f"`{path} " in page and "--json" in page}
    assert with_json - described == {"oncenter live"}  # which prints the object of `oncenter offset`


def schema_of(name: str) -> jsonschema.protocols.Validator:
    schemas = {path.name: json.loads(path.read_text(encoding="utf-8")) for path in (FOLDER / "schema").iterdir()}
    registry = Registry().with_resources((file, Resource.from_contents(schema)) for file, schema in schemas.items())
    return jsonschema.Draft202012Validator(schemas[f"{name}.schema.json"], registry=registry)


def fields(schema: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """The schema of each field, at any depth."""
    yield schema
    inside = [*schema.get("properties", {}).values(), schema.get("items"), schema.get("additionalProperties")]
    for each in inside:
        if isinstance(each, dict):
            yield from fields(each)


@pytest.mark.parametrize("path", sorted((FOLDER / "schema").iterdir()), ids=lambda path: path.name)
def test_each_schema_is_one_and_describes_each_field(path: Path) -> None:
    schema = json.loads(path.read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator.check_schema(schema)
    named = [field for each in fields(schema) for field in each.get("properties", {}).values()]
    assert named and all(field["description"] for field in named)
    assert all("properties" not in each or each["additionalProperties"] is False for each in fields(schema))


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Drives with different answers, by name."""
    folder = tmp_path_factory.mktemp("logs")
    steady = steady_drive().table
    tables = {
        "steady": steady,
        "short": steady[:3000],
        "first": steady[:6000],
        "second": steady[6000:],
        "standing": steady.with_columns(vehicle_speed_m_s=pl.lit(0.0)),
        "stuck": steady.with_columns(
            steering_wheel_angle_rad=pl.when(pl.col("time_s") > 300.0)
            .then(pl.lit(float("nan")))
            .otherwise(pl.col("steering_wheel_angle_rad"))
        ),
    }
    for name, table in tables.items():
        table.write_csv(folder / f"{name}.csv")
    (folder / "bad.csv").write_text("nothing\nhere\n")
    return {path.stem: str(path) for path in folder.iterdir()}


def printed(arguments: list[str], capfd: pytest.CaptureFixture[str]) -> dict[str, Any]:
    run(arguments)
    return json.loads(capfd.readouterr().out)


@pytest.mark.parametrize("schema", ["offset-2", "offset-1"])
@pytest.mark.parametrize("words", ["steady", "steady --method thesis", "short", "standing", "stuck", "first second"])
def test_an_answer_is_as_its_schema_says(
    words: str, schema: str, logs: dict[str, str], capfd: pytest.CaptureFixture[str]
) -> None:
    arguments = [logs.get(word, word) for word in words.split()]
    given = printed(["offset", *arguments, "--vehicle", TRUCK, "--json", "--schema", schema], capfd)
    schema_of(schema).validate(given)


def test_a_comparison_is_as_its_schema_says(
    logs: dict[str, str], tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    for name in ("steady", "short"):
        given = printed(["offset", logs[name], "--vehicle", TRUCK, "--json"], capfd)
        (tmp_path / f"{name}.json").write_text(json.dumps(given), encoding="utf-8")
    compared = printed(
        ["compare", str(tmp_path / "steady.json"), str(tmp_path / "short.json"), "--json", "--in-given-order"], capfd
    )
    schema_of("compare-1").validate(compared)


def test_a_field_that_no_schema_has_is_noticed(logs: dict[str, str], capfd: pytest.CaptureFixture[str]) -> None:
    given = printed(["offset", logs["steady"], "--vehicle", TRUCK, "--json"], capfd)
    for place in (given, given["offset"], given["time"], given["findings"][0], given["correction"]):
        place["new"] = 1
        with pytest.raises(jsonschema.ValidationError, match="'new' was unexpected"):
            schema_of("offset-2").validate(given)
        del place["new"]
    schema_of("offset-2").validate(given)


@pytest.mark.parametrize("scenario", ["heavy_play", "remounted_sensor", "sensor_failure"])
def test_answers_with_play_with_a_change_and_with_a_fault_are_as_the_schema_says(scenario: str) -> None:
    drive, _ = oc.simulate(scenario, seed=1)
    answer = oc.offset(drive, oc.vehicle(TRUCK))
    schema_of("offset-2").validate(answer.to_dict())
    expected = {"remounted_sensor": bool(answer.changes), "sensor_failure": answer.offset.status == "invalid"}
    assert expected.get(scenario, True)


def test_answers_of_each_log_and_errors_are_as_their_schemas_say(
    logs: dict[str, str], capfd: pytest.CaptureFixture[str]
) -> None:
    each = printed(["offset", logs["steady"], logs["bad"], "--vehicle", TRUCK, "--each", "--json"], capfd)
    schema_of("offsets-1").validate(each)
    assert [one["schema"] for one in each["answers"]] == ["oncenter/offset-2", "oncenter/error-1"]
    for arguments in (["offset", logs["bad"], "--vehicle", TRUCK], ["offset"], ["signals", "none.csv"]):
        schema_of("error-1").validate(printed([*arguments, "--json"], capfd))


def test_other_commands_print_as_their_schemas_say(logs: dict[str, str], capfd: pytest.CaptureFixture[str]) -> None:
    for log in ("steady", "standing"):
        schema_of("signals-1").validate(printed(["signals", logs[log], "--vehicle", TRUCK, "--json"], capfd))
    schema_of("budget-1").validate(printed(["budget", "--vehicle", TRUCK, "--json"], capfd))
    drive, _ = oc.simulate("both_ways", seed=1)
    schema_of("reference-1").validate(oc.reference(drive).to_dict())


def test_a_fleet_and_a_query_print_as_their_schemas_say(
    logs: dict[str, str], tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    folder = str(tmp_path / "fleet")
    arguments = ["fleet", "run", logs["steady"], logs["bad"], "--vehicles", str(ROOT / "vehicles"), "--output", folder]
    schema_of("fleet-run").validate(printed([*arguments, "--json"], capfd))
    query = ["fleet", "query", "select * from drives", "--output", folder, "--json"]
    schema_of("query-1").validate(printed(query, capfd))

"""Files of the project for GitHub and pre-commit: the issue forms are valid, the advice for sharing a log removes the
truck's identity, the hooks have the versions of the lock, and the workflow runs the tests of the Makefile."""

import re
from pathlib import Path

import polars as pl
import pytest
import yaml
from locked import pinned
from test_estimate import steady_drive

import oncenter as oc

ROOT = Path(__file__).parents[1]
FORMS = ROOT / ".github" / "ISSUE_TEMPLATE"
TRUCK = "scania_r730_4x2"


@pytest.mark.parametrize("name", ["bug_report", "wrong_truck", "feature_request"])
def test_a_form_has_what_github_requires(name: str) -> None:
    form = yaml.safe_load((FORMS / f"{name}.yml").read_text(encoding="utf-8"))
    assert {"name", "description", "body"} <= set(form)
    fields = [field for field in form["body"] if field["type"] != "markdown"]
    assert len({field["id"] for field in fields}) == len(fields)
    assert all(field["attributes"]["label"] for field in fields)


def test_the_advice_for_sharing_a_log_keeps_the_answer_and_removes_position_and_date(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    form = yaml.safe_load((FORMS / "bug_report.yml").read_text(encoding="utf-8"))
    advice = next(field for field in form["body"] if field.get("id") == "log")["attributes"]["description"]
    (block,) = re.findall(r"```python\n(.*?)```", advice, re.DOTALL)
    drive = steady_drive().table
    position = {name: pl.lit(60.0) for name in ("latitude_deg", "longitude_deg", "heading_deg", "course_deg")}
    drive.with_columns(pl.col("time_s") + 1.7e9, **position).write_csv(tmp_path / "drive.csv")
    monkeypatch.chdir(tmp_path)
    exec(block.replace("drive.log", "drive.csv").replace("truck.toml", TRUCK), {})

    shared = pl.read_parquet("shared.parquet")
    assert not [name for name in shared.columns if name.startswith(("latitude", "longitude", "heading", "course"))]
    assert shared["time_s"][0] == 0.0
    truck = oc.vehicle(TRUCK)
    answers = [oc.offset(oc.read(name), truck).offset.value for name in ("drive.csv", "shared.parquet")]
    assert answers[0] == pytest.approx(answers[1], abs=1e-6)


def test_the_hooks_before_a_commit_have_the_versions_of_the_lock() -> None:
    hooks = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text(encoding="utf-8"))
    locked = pinned("requirements.lock")
    revisions = {repo["repo"].rpartition("/")[2].removesuffix("-pre-commit"): repo["rev"] for repo in hooks["repos"]}
    assert revisions == {name: f"v{locked[name]}" for name in ("ruff", "typos")}


def test_the_workflow_runs_the_files_of_tests_of_the_system_on_wheels_that_exist() -> None:
    workflow = (ROOT / ".github" / "workflows" / "check.yml").read_text(encoding="utf-8")
    marker = "mark." + "system"  # make portable takes each file that has it
    of_the_system = [path.name for path in sorted(ROOT.glob("tests/test_*.py")) if marker in path.read_text("utf-8")]
    assert [f"test_{name}" for name in re.findall(r"tests/test_(\S+)", workflow)] == of_the_system
    platforms = re.findall(r'Platform\("(\w+)"', (ROOT / "wheels" / "platforms.py").read_text(encoding="utf-8"))
    tried = {
        machine["platform"] for machine in yaml.safe_load(workflow)["jobs"]["portable"]["strategy"]["matrix"]["include"]
    }
    assert tried and tried <= set(platforms)

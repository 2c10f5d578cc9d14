"""The page says of 40 drives what the command says: a good log, and 39 kinds of suspect files (`faulty_logs`)."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest
from faulty_logs import FAULTS, Given
from healthy_drive import TRUCK, healthy_drive, written
from test_app import Page, page

from oncenter.cli import run

__all__ = ["page"]  # the fixture
KINDS = ("none", *list(FAULTS)[-39:])
_SEED, _MINUTES = 1, 3.0

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("app_same_verdicts")]  # one drive for all


@pytest.fixture(scope="module")
def given(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Given]:
    root = tmp_path_factory.mktemp("drives")
    drive = healthy_drive(_SEED, root, minutes=_MINUTES)
    whole = written(drive.columns, root / "drive.parquet")
    made = {"none": Given((str(whole), "--vehicle", TRUCK), (drive.offset_deg,))}
    for kind in KINDS[1:]:
        folder = root / kind
        folder.mkdir()
        made[kind] = FAULTS[kind].given(drive, folder)
    return made


@pytest.mark.parametrize("kind", KINDS)
def test_the_page_has_word_and_code_of_the_command(
    kind: str, given: dict[str, Given], page: Page, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    *logs, _, truck = given[kind].arguments
    names = [Path(log).name for log in logs]
    monkeypatch.chdir(Path(logs[0]).parent)
    exit_code = run(["offset", *names, "--vehicle", truck, "--json"])
    said = json.loads(capsys.readouterr().out)
    choice = {"group": "shipped", "name": truck}
    if truck != TRUCK:
        choice = {"group": "yours", "name": kept_truck(Path(truck), kind, page.trucks)}
    keys = [page.drop(Path(log)) for log in logs]
    answer = page.answer(*keys, **choice)
    for key in keys:
        page.said("DELETE", f"/logs/{key}")
    assert answer["state"] == ("done" if exit_code == 0 else "failed")
    for part in ("verdicts", "offset", "status", "findings", "code", "message"):
        assert answer["said"].get(part) == said.get(part), part


def kept_truck(file: Path, kind: str, trucks: Path) -> str:
    """A truck's file with its database, as if it had been kept on the page."""
    trucks.mkdir(exist_ok=True)
    text = file.read_text(encoding="utf-8").replace("network.dbc", f"{kind}/network.dbc")
    (trucks / f"{kind}.toml").write_text(text, encoding="utf-8")
    (trucks / kind).mkdir()
    shutil.copy(file.with_name("network.dbc"), trucks / kind)  # its name stands in the verdict
    return kind

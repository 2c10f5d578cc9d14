"""An estimator of your own beside oncenter's, by docs/howto/compare_estimator.md alone."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "bench"))

import accuracy
from rivals import MINUTE_TICKS, NAMES, Known, RivalError, rival

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "howto" / "compare_estimator.md").read_text(encoding="utf-8")
MISSING = ("numba", "scipy", "matplotlib", "pandas")  # oncenter alone does not install them
KNOWN = Known(3.7, 19.3, 8100.0, 24000.0, 1.0, 384000.0, 235000.0)


def test_a_rival_added_by_the_page_alone_is_compared_also_without_numba(tmp_path: Path) -> None:
    shutil.copytree(ROOT / "bench", tmp_path / "bench", ignore=shutil.ignore_patterns("__pycache__"))
    (source,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    (command,) = re.findall(r"```sh\npython (.*?)\n```", PAGE)
    (tmp_path / "mine.py").write_text(source, encoding="utf-8")
    blocked = f"import sys\nsys.modules |= dict.fromkeys({MISSING})\n"
    (tmp_path / "sitecustomize.py").write_text(blocked, encoding="utf-8")
    few = command.replace("ordinary,motorway", "ordinary").replace("--drives 2", "--drives 1").split()
    environment = {"PYTHONPATH": str(tmp_path), "PATH": "/usr/bin:/bin"}
    done = subprocess.run(
        [sys.executable, *few], cwd=tmp_path, capture_output=True, text=True, check=False, env=environment
    )
    assert done.returncode == 0, done.stderr
    lines = [line.split() for line in done.stdout.splitlines()]
    assert [line[:3] for line in lines[1:]] == [["ordinary", "joint", "1"], ["ordinary", "mine:median", "1"]]
    assert float(lines[2][6]) > 1.0 > float(lines[1][6])  # median errors, deg: the median leaves out all but the play


def test_without_numba_the_rivals_of_the_bench_are_left_out_and_named(
    own: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(accuracy, "find_spec", lambda name: None)
    assert accuracy.methods_of("", [own]) == [*accuracy.METHODS, own]
    assert capsys.readouterr().err.count("\n") == 1
    with pytest.raises(RivalError, match=r"^rls, mode need numba, which is not installed: pip install numba$"):
        accuracy.methods_of("joint,rls,mode", [])


def test_every_rival_of_the_bench_is_found_by_its_name() -> None:
    assert accuracy.methods_of("", []) == [*accuracy.METHODS, *NAMES]
    assert [rival(name).__name__ for name in NAMES] == list(NAMES)


@pytest.fixture
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    functions = "def values(columns, known): return [known.wheelbase_m, float('nan')]\n"
    functions += "def pair(columns, known): return [1.0, 2.0], [0.1, 0.2]\n"
    functions += "def short(columns, known): return [1.0]\n"
    (tmp_path / "its_own.py").write_text(functions, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    return "its_own:values"


def test_a_rival_gives_values_or_a_pair_of_values_and_standard_deviations(own: str) -> None:
    columns = {"time_s": np.arange(2 * MINUTE_TICKS) / 100.0}
    values = rival(own)(columns, KNOWN)
    assert values.valid.tolist() == [True, False] and values.value_rad[0] == 3.7 and np.isnan(values.sd_rad).all()
    pair = rival("its_own:pair")(columns, KNOWN)
    assert (pair.value_rad.tolist(), pair.sd_rad.tolist()) == ([1.0, 2.0], [0.1, 0.2])
    with pytest.raises(RivalError, match="must give one value for each of 2 minutes"):
        rival("its_own:short")(columns, KNOWN)


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("nowhere:f", "no module nowhere: run `python -m bench.accuracy` in the folder with nowhere.py"),
        ("its_own:f", "its_own has no function f"),
        ("its_own:", "its_own has no function"),
        ("its_own", "--rival takes module:function, got its_own"),
    ],
)
def test_a_rival_that_does_not_exist_is_refused_before_the_first_drive(own: str, name: str, why: str) -> None:
    with pytest.raises(RivalError, match=re.escape(why)):
        accuracy.methods_of("joint", [name])

"""A new user's mistakes and questions: a message names the next command, -h works everywhere, shells complete names."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from test_estimate import steady_drive
from typer.main import get_command

from oncenter.cli import run
from oncenter.cli.completion import explained_codes, scenarios, signal_names, vehicle_files
from oncenter.cli.demo import _as_typed
from oncenter.cli.program import program_of

TRUCK = "wheelbase_m = 3.7\nsteering_ratio = 19.3\n"
NEW = "oncenter vehicle new new_truck.toml --wheelbase-m 3.7 --steering-ratio 19.3"
DBC = 'VERSION ""\nBU_: X\nBO_ 512 ESP: 8 X\n SG_ Gyro : 0|16@1- (0.01,0) [0|0] "deg/s" X\n'


@pytest.fixture
def desk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of a new user."""
    monkeypatch.chdir(tmp_path)
    table = steady_drive(minutes=0.5).table
    table.write_csv("drive.csv")
    table.rename({"yaw_rate_rad_s": "gyro"}).write_csv("other.csv")
    table.rename({"yaw_rate_rad_s": "yaw_rate"}).write_csv("no_unit.csv")
    files = {
        "truck.toml": TRUCK,
        "comma.toml": TRUCK.replace("3.7", "3,7"),
        "mm.toml": TRUCK.replace("3.7", "3700"),
        "lost.toml": f'{TRUCK}dbc = "lost.dbc"\n',
        "unit.toml": f'{TRUCK}[signals]\nyaw_rate = {{ name = "gyro", unit = "deg" }}\n',
        "bus.dbc": DBC,
        "table.txt": "time_s\n0\n",
        "frames.log": "".join(f"({k / 100:.2f}) can0 200#0A00{k % 50:02X}0000000000\n" for k in range(300)),
    }
    for name, text in files.items():
        Path(name).write_text(text)
    return tmp_path


@pytest.mark.parametrize(
    ("words", "advice"),
    [
        ("offset", "LOG… is missing: give a log"),
        ("ofset", "there is no command 'ofset'; did you mean offset"),
        ("xxxxxx", "oncenter -h lists all commands"),
        ("vehicle nwe truck.toml", "did you mean new?"),
        ("angle drive.csv", "--vehicle is missing: oncenter vehicle new truck.toml writes"),
        ("offset drive.csv --vehcle truck.toml", "has no option --vehcle; did you mean --vehicle?"),
        ("offset drive.csv --qqqqq truck.toml", "oncenter offset -h lists them"),
        ("offset drvie.csv --vehicle truck.toml", "did you mean drive.csv?"),
        ("offset drive.csv --vehicle scania_r730", "did you mean scania_r730_4x2?"),
        ("offset drive.csv --vehicle trcuk.toml", "did you mean truck.toml?"),
        ("offset drive.csv --vehicle volvo.toml", "oncenter vehicle new volvo.toml writes one, oncenter vehicle list"),
        ("offset bus.dbc --vehicle truck.toml", "a database follows --dbc: oncenter offset LOG --vehicle FILE"),
        ("offset drive.csv --vehicle bus.dbc", "a database follows --dbc"),
        ("offset truck.toml --vehicle drive.csv", "a log comes first: oncenter offset drive.csv --vehicle FILE"),
        ("offset truck.toml --vehicle truck.toml", "a vehicle file follows --vehicle"),
        ("offset table.txt --vehicle truck.toml", "rename a text file with columns to .csv"),
        ("offset no_unit.csv --vehicle truck.toml", f"{NEW} --log no_unit.csv"),
        ("offset other.csv --vehicle truck.toml", f"{NEW} --log other.csv"),
        ("offset other.csv --vehicle unit.toml", '"rad_s" or "deg_s"'),
        ("offset frames.log --vehicle truck.toml", f"{NEW} --dbc FILE --log frames.log"),
        ("offset drive.csv --vehicle comma.toml", "numbers need a decimal point"),
        ("offset drive.csv --vehicle mm.toml", "in mm? 3700 mm are 3.7 m"),
        ("offset drive.csv --vehicle lost.toml", "its dbc lost.dbc does not exist"),
        ("offset drive.csv --vehicle truck.toml --method jont", "got jont; did you mean joint?"),
        ("simulate heavyplay --output x.log", "did you mean heavy_play?"),
        ("vehicle check", "FILE is missing: give a vehicle file"),
        (
            "reference drive.csv",
            "oncenter signals drive.csv lists the signals of the log",
        ),
    ],
)
def test_a_mistake_is_one_line_with_the_next_command(
    words: str, advice: str, desk: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert run(words.split()) in (1, 2)
    err = capfd.readouterr().err
    assert err.count("\n") == 1 and advice in err


def test_a_log_of_frames_without_a_signal_is_to_be_listed(desk: Path, capfd: pytest.CaptureFixture[str]) -> None:
    frame = "18F0093E#FFFF7F8F7D877E7D"  # VDC2 without an angle
    Path("bus.log").write_text("".join(f"({k / 100:.2f}) can0 {frame}\n" for k in range(300)))
    assert run(["offset", "bus.log", "--vehicle", "truck.toml"]) == 1
    assert "oncenter signals bus.log --vehicle truck.toml lists the signals of the log" in capfd.readouterr().err
    assert run(["signals", "other.csv"]) == 0


def every_command(command: object, path: tuple[str, ...] = ()) -> list[tuple[str, ...]]:
    below = getattr(command, "commands", {})
    return [path, *(found for name, each in below.items() for found in every_command(each, (*path, name)))]


@pytest.mark.parametrize("path", every_command(get_command(program_of())), ids=" ".join)
def test_h_is_help_of_every_command(path: tuple[str, ...], capsys: pytest.CaptureFixture[str]) -> None:
    assert run([*path, "-h"]) == 0
    short = capsys.readouterr().out
    assert run([*path, "--help"]) == 0
    assert capsys.readouterr().out == short and "Usage: oncenter" in short
    assert hasattr(get_command(program_of()), "commands") and ("Example: oncenter" in short or "Commands:" in short)


def in_bash(words: str) -> list[str]:
    """The names that bash offers for the last word."""
    environment = {
        **os.environ,
        "_ONCENTER_COMPLETE": "complete_bash",
        "COMP_WORDS": f"oncenter {words}",
        "COMP_CWORD": str(len(words.split(" "))),
    }
    done = subprocess.run([sys.executable, "-m", "oncenter"], capture_output=True, text=True, env=environment)
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout.split()


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        ("of", {"offset"}),
        ("offset drive.csv --veh", {"--vehicle"}),
        ("offset drive.csv --vehicle s", {"scania_r730_4x2"}),
        ("offset drive.csv --vehicle tr", {"truck.toml"}),
        ("vehicle check rig", {"rigid_6x2", "rigid_6x4", "rigid_8x4"}),
        ("simulate heavy", {"heavy_play"}),
        ("signals drive.csv --source yaw", {"yaw_rate="}),
        ("offset drive.csv --method wh", {"wheel-speed"}),
    ],
)
def test_a_shell_completes_commands_options_and_names(words: str, offered: set[str], desk: Path) -> None:
    assert set(in_bash(words)) == offered


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish", "pwsh"])
def test_each_shell_has_its_script(shell: str) -> None:
    """Typer finds the shell among the parents of the process; here it is named."""
    from typer.completion import get_completion_script

    script = get_completion_script(prog_name="oncenter", complete_var="_ONCENTER_COMPLETE", shell=shell)
    assert "_ONCENTER_COMPLETE" in script and "oncenter" in script


def test_vehicle_files_are_completed_through_folders(desk: Path) -> None:
    (desk / "trucks" / "north").mkdir(parents=True)
    (desk / "trucks" / "north" / "a.toml").write_text(TRUCK)
    assert vehicle_files("truc") == ["truck.toml", f"trucks{os.sep}"]
    assert vehicle_files("trucks") == [os.path.join("trucks", "north", "a.toml")]
    assert vehicle_files("nowhere/x") == []


def test_completions_begin_with_what_is_written() -> None:
    assert "thesis_drive" in scenarios("th") and not scenarios("zz")
    assert signal_names("steering_wheel_t") == ["steering_wheel_torque="]


def test_codes_to_explain_are_the_headings_of_their_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "page.md").write_text("# Findings\n\n## yaw_rate_bias\n\nText\n\n# Errors\n\n## usage\n")
    monkeypatch.setattr("oncenter.cli.completion.shipped", lambda name: tmp_path / "page.md")
    assert explained_codes("") == ["usage", "yaw_rate_bias"] and explained_codes("ya") == ["yaw_rate_bias"]
    monkeypatch.setattr("oncenter.cli.completion.shipped", lambda name: tmp_path / "none.md")
    assert explained_codes("") == []


@pytest.mark.parametrize(
    ("typed", "on_path", "again"),
    [
        ("ours/oncenter", "ours", "oncenter"),
        ("ours/oncenter", "other", "ours/oncenter"),  # as `make demo` calls it, with an older one installed
        ("ours/oncenter", "", "ours/oncenter"),
        ("my files/oncenter", "", "'my files/oncenter'"),
        ("oncenter/__main__.py", "ours", f"{sys.executable} -m oncenter"),
    ],
)
def test_the_demo_names_the_program_so_that_the_shell_finds_it(
    typed: str, on_path: str, again: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for folder in ("ours", "other", "my files"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "oncenter").write_text("#!/bin/sh\n")
        (tmp_path / folder / "oncenter").chmod(0o755)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [typed, "demo"])
    monkeypatch.setenv("PATH", str(tmp_path / on_path) if on_path else "")
    assert _as_typed() == again

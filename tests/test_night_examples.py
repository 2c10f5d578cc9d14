"""The timers of `examples/night` start a night as they say, as far as this machine can show."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
import yaml

from oncenter.errors import STATUS_TO_FAIL_ON, WRONG_USAGE

EXAMPLES = Path(__file__).parents[1] / "examples" / "night"
PROGRAM = "/opt/oncenter/bin/oncenter"
SERVICE = (EXAMPLES / "oncenter.service").read_text(encoding="utf-8")


def cron_line() -> str:
    return (EXAMPLES / "crontab").read_text(encoding="utf-8").splitlines()[-1]


def cron_job() -> dict[str, Any]:
    job: dict[str, Any] = yaml.safe_load((EXAMPLES / "cronjob.yaml").read_text(encoding="utf-8"))
    return job


def pod() -> dict[str, Any]:
    spec: dict[str, Any] = cron_job()["spec"]["jobTemplate"]["spec"]["template"]["spec"]
    return spec


def commands() -> dict[str, list[str]]:
    service = re.search(r"^ExecStart=((?:.*\\\n)*.*)$", SERVICE, re.MULTILINE)
    assert service is not None
    return {
        "systemd": shlex.split(service[1].replace("\\\n", "")),
        "cron": shlex.split(cron_line().split(maxsplit=5)[5].partition(" >")[0]),
        "Kubernetes": pod()["containers"][0]["args"],
    }


def as_here(command: Sequence[str], fleet: Path, folder: Path) -> list[str]:
    """The command with places of this test."""
    places = {
        r"/srv/logs|/logs": f"{fleet}/logs",
        r"(--vehicles=)?(/srv)?/vehicles": rf"\1{fleet}/vehicles",
        r"(--output=)?(/srv/fleet|/fleet/result)": rf"\1{folder}/out",
        r"/var/lib/node_exporter": str(folder),
        rf"{PROGRAM}|oncenter": str(Path(sys.executable).with_name("oncenter")),
    }
    for place, here in places.items():
        command = [re.sub(rf"^(?:{place})(?=/oncenter\.prom|$)", here, part) for part in command]
    return list(command)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["systemd", "cron", "Kubernetes"])
def test_the_command_of_a_timer_runs_a_night(name: str, fleet: Path, tmp_path: Path) -> None:
    command = as_here(commands()[name], fleet, tmp_path)
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "out" / "index.html").is_file()
    assert (tmp_path / "oncenter.prom").is_file() == (name == "systemd")


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="systemd-analyze is not installed")
def test_systemd_accepts_the_service_and_the_timer(tmp_path: Path) -> None:
    for name in ("oncenter.service", "oncenter.timer"):
        text = (EXAMPLES / name).read_text(encoding="utf-8")
        (tmp_path / name).write_text(text.replace(PROGRAM, "/bin/true"))
    units = [str(tmp_path / name) for name in ("oncenter.service", "oncenter.timer")]
    done = subprocess.run(
        ["systemd-analyze", "verify", *units], capture_output=True, text=True, timeout=60, check=False
    )
    assert (done.returncode, done.stdout + done.stderr) == (0, "")


def test_the_service_may_write_where_its_command_writes() -> None:
    (writable,) = re.findall(r"^ReadWritePaths=(.+)$", SERVICE, re.MULTILINE)
    command = commands()["systemd"]
    for option in ("--output", "--metrics"):
        written = Path(command[command.index(option) + 1])
        assert any(written.is_relative_to(folder) for folder in writable.split())


def test_cron_gets_a_line_that_mails_a_night_only_if_it_fails(tmp_path: Path) -> None:
    *times, command = cron_line().split(maxsplit=5)
    assert len(times) == 5 and all(re.fullmatch(r"\*|\d+", each) for each in times)
    assert "%" not in command  # cron takes it for the end of a line
    subprocess.run(["sh", "-n", "-c", command], check=True, timeout=60)
    program = tmp_path / "oncenter"
    program.write_text("#!/bin/sh\necho a night; exit ${CODE}\n")
    program.chmod(0o755)
    here = command.replace(PROGRAM, str(program)).replace("/srv/fleet/night.txt", str(tmp_path / "night.txt"))
    for code, mailed in ((0, ""), (STATUS_TO_FAIL_ON, "a night\n")):
        done = subprocess.run(
            ["sh", "-c", here], env={"CODE": str(code), "PATH": "/usr/bin:/bin"}, capture_output=True, text=True
        )
        assert (done.stdout, done.stderr) == (mailed, "")


def test_kubernetes_runs_one_night_at_a_time_and_no_failed_one_again_that_would_fail_again() -> None:
    spec = cron_job()["spec"]
    job = spec["jobTemplate"]["spec"]
    assert spec["concurrencyPolicy"] == "Forbid" and pod()["restartPolicy"] == "Never"
    fails = job["podFailurePolicy"]["rules"][0]
    assert (fails["action"], fails["onExitCodes"]["values"]) == ("FailJob", [WRONG_USAGE, STATUS_TO_FAIL_ON])
    (container,) = pod()["containers"]
    assert fails["onExitCodes"]["containerName"] == container["name"]
    mounts = {mount["name"]: mount for mount in container["volumeMounts"]}
    assert set(mounts) == {volume["name"] for volume in pod()["volumes"]}
    assert [name for name, mount in mounts.items() if not mount.get("readOnly")] == ["fleet", "tmp"]


@pytest.mark.skipif(shutil.which("kubectl") is None, reason="kubectl is not installed")
def test_kubernetes_keeps_each_key_of_the_job() -> None:
    """It drops others than its own."""
    command = ["kubectl", "annotate", "--local", "-f", str(EXAMPLES / "cronjob.yaml"), "a=b", "-o", "yaml"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    given = yaml.safe_load(done.stdout)
    assert given["metadata"].pop("annotations") == {"a": "b"}
    assert given == cron_job()

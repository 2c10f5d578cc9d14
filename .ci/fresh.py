"""Types the README's two commands on bare Debian systems, and writes into docs/platforms.md how they went.

    fresh.py [bookworm|trixie] [root|user]        # as root, on Debian; all four systems unless named

A system has make, git, ca-certificates and this machine's network configuration, and no Python. It gets a clone of the
last commit. Where a user types, root first runs the line that the last command prints, and nothing else.
"""

from __future__ import annotations

import contextlib
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import date
from pathlib import Path

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "platforms.md"
BEGIN, END = "<!-- fresh -->\n", "<!-- /fresh -->\n"
DEBIANS = ("bookworm", "trixie")
ACCOUNTS = {"root": "root", "user": "driver"}
NETWORK = re.compile(r"(?i)(https?|no|all)_proxy|ssl_cert_(file|dir)|pip_(cert|(extra_)?index_url|default_timeout)")
PATH = "PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"
# What is mounted then exists for this process alone and ends with it: removing the folder cannot reach through a mount.
ALONE = ("unshare", "--mount", "--pid", "--fork", "--kill-child")
ENTER = """set -eu
cd "$1"; shift
mount -t proc proc proc
mount -t sysfs -o ro sysfs sys
mount -t devpts -o newinstance,ptmxmode=0666 devpts dev/pts
mount -t tmpfs tmpfs dev/shm
chroot . "$@"
exit # no exec: as process 1 this shell reaps the children of processes that were killed
"""


@dataclass(frozen=True)
class System:
    folder: Path

    def type(self, account: str, command: str) -> tuple[int, str]:
        """Runs the command in the home folder of the account; prints its output and returns it with the exit code."""
        network = [f"{name}={value}" for name, value in os.environ.items() if NETWORK.fullmatch(name)]
        typed = ["env", "-i", PATH, *network, "su", account, "-c", f"cd && {command}"]
        enter = ["sh", "-c", ENTER, "sh", self.folder]
        output = ""
        with subprocess.Popen(
            [*ALONE, *enter, *typed],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        ) as running:
            assert running.stdout
            try:
                for line in running.stdout:
                    print(line, end="", flush=True)
                    output += line
            finally:
                running.kill()
        return running.returncode, output


def main() -> None:
    for ended in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(ended, lambda *_: sys.exit("stopped"))
    given = [word for word in sys.argv[1:] if word]
    debians = [name for name in DEBIANS if name in given] or DEBIANS
    users = [name for name in ACCOUNTS if name in given] or ACCOUNTS
    if unknown := sorted(set(given) - {*DEBIANS, *ACCOUNTS}):
        sys.exit(f"{unknown[0]} is none of {', '.join((*DEBIANS, *ACCOUNTS))}")
    has_failed = False
    for debian in debians:
        for user in users:
            commit = subprocess.check_output(["git", "-C", ROOT, "rev-parse", "--short", "HEAD"], text=True).strip()
            results = tried(debian, user)
            write_row(f"| {debian} | {user} |", [f"{date.today()}, {commit}", *results])
            has_failed |= any("exit code" in result for result in results)
    sys.exit(has_failed)


def tried(debian: str, user: str) -> list[str]:
    """The result of each command."""
    account = ACCOUNTS[user]
    with bare_system(debian) as system:
        if account != "root":
            system.type("root", f"useradd --create-home {account}")
        system.type(account, "git -c advice.detachedHead=false clone --quiet /oncenter.bundle oncenter")
        if account != "root":
            install_as_printed(system, account)
        return [timed(system, account, command) for command in commands()]


def commands() -> list[str]:
    """Those of the README's first block."""
    block = re.findall(r"^```sh\n(.*?)^```", (ROOT / "README.md").read_text(encoding="utf-8"), re.M | re.S)[0]
    return [line.split("#")[0].strip() for line in block.splitlines()]


def install_as_printed(system: System, account: str) -> None:
    _, output = system.type(account, f"cd oncenter && {commands()[-1]}")
    line = re.search(r"sudo apt-get update && .*", output)
    if line is None:
        sys.exit("the line that installs the missing packages is not in the output")
    system.type("root", f'sudo() {{ "$@"; }}; {line[0]}')  # a bare Debian has no sudo


def timed(system: System, account: str, command: str) -> str:
    load, begin = os.getloadavg()[0], time.monotonic()
    code, _ = system.type(account, f"cd oncenter && {command}")
    outcome = "passed" if code == 0 else f"**exit code {code}**"
    result = f"{outcome}, {time.monotonic() - begin:.0f} s, load {load:.1f} to {os.getloadavg()[0]:.1f}"
    print(f"{command}: {result}", flush=True)
    return result


@contextlib.contextmanager
def bare_system(debian: str) -> Iterator[System]:
    folder = Path(tempfile.mkdtemp(prefix=f"{debian}-"))
    folder.chmod(0o755)
    try:
        print(f"making a bare {debian} in {folder}", flush=True)
        bootstrap(debian, folder)
        copy_network(folder)
        subprocess.run(
            ["git", "-C", ROOT, "bundle", "create", "--quiet", folder / "oncenter.bundle", "HEAD"], check=True
        )
        yield System(folder)
    finally:
        remove(folder)


def bootstrap(debian: str, folder: Path) -> None:
    """By this machine's package sources and network settings of apt, where it is a Debian."""
    codename = re.findall(r"^VERSION_CODENAME=(\w+)", Path("/etc/os-release").read_text(), re.M)
    sources = Path("/etc/apt/sources.list.d/debian.sources")
    given = sources.read_text().replace(codename[0], debian) if codename and sources.is_file() else ""
    settings = [file for file in Path("/etc/apt/apt.conf.d").glob("*") if "Acquire::" in file.read_text()]
    command = [*ALONE, "mmdebstrap", "--quiet", "--variant=minbase", "--include=ca-certificates,git,make"]
    command += [f"--aptopt={file}" for file in settings]
    subprocess.run([*command, debian, folder, *(["-"] if given else [])], input=given, text=True, check=True)


def copy_network(folder: Path) -> None:
    named = {value for name, value in os.environ.items() if NETWORK.fullmatch(name)}
    for file in map(Path, sorted({"/etc/resolv.conf", "/etc/hosts", "/etc/pip.conf", *named})):
        if file.is_absolute() and file.is_file():
            copy = folder / file.relative_to("/")
            copy.parent.mkdir(parents=True, exist_ok=True)
            copy.write_bytes(file.read_bytes())


def remove(folder: Path) -> None:
    """Not while anything is mounted in it."""
    if f" {folder}/" in Path("/proc/self/mountinfo").read_text():
        sys.exit(f"{folder} is left, since something is mounted in it")
    subprocess.run(["rm", "-rf", "--one-file-system", folder], check=True)


def write_row(begin: str, cells: list[str]) -> None:
    """Renews the row that begins so."""
    head, _, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
    table, _, tail = rest.partition(END)
    row = f"{begin} {' | '.join(cells)} |\n"
    lines = [row if line.startswith(begin) else line for line in table.splitlines(keepends=True)]
    PAGE.write_text("".join([head, BEGIN, *lines, END, tail]), encoding="utf-8")


if __name__ == "__main__":
    main()

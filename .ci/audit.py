"""Asks pip-audit for known vulnerabilities of all packages that the locks pin: `make audit`.

    audit.py LOCK …

Without the advisories it ends with "skipped: …", which is no pass. pip-audit itself reports "no known vulnerabilities"
when its source knows none of the packages.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

UNREACHED = "skipped: the advisories cannot be reached from here"


def audited(lock: str) -> list[dict[str, Any]] | None:
    """The packages of a lock as pip-audit reports them; None if it reports nothing."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "requirements.txt"
        file.write_text(lock, encoding="utf-8")
        command = [sys.executable, "-m", "pip_audit", "--disable-pip", "--require-hashes", "--progress-spinner=off"]
        done = subprocess.run([*command, "--format=json", "-r", file], capture_output=True, text=True, check=False)
    try:
        found: list[dict[str, Any]] = json.loads(done.stdout)["dependencies"]
    except (ValueError, KeyError):
        return None
    return found


def verdict(packages: list[dict[str, Any]]) -> tuple[int, list[str]]:
    """Exit code and lines: each vulnerability, and each package that the source does not know."""
    lines = [f"not audited: {each['name']}: {each['skip_reason']}" for each in packages if "skip_reason" in each]
    for each in packages:
        for known in each.get("vulns", ()):
            fixed = ", ".join(known["fix_versions"]) or "no version"
            lines.append(f"{each['name']} {each['version']}: {known['id']}, corrected in {fixed}")
    return int(bool(lines)), [*lines, f"{len(packages)} packages, {len(lines)} to look at"]


def main(locks: list[str]) -> int:
    texts = [Path(lock).read_text(encoding="utf-8") for lock in locks]
    first = audited(first_pin(texts[0]))  # one question before hundreds
    if not first or "skip_reason" in first[0]:
        print(UNREACHED)
        return 0
    packages = [each for text in texts for each in audited(text) or [{"name": "a lock", "skip_reason": "no report"}]]
    code, lines = verdict(packages)
    print("\n".join(lines))
    return code


def first_pin(lock: str) -> str:
    """The first package of a lock, with its hashes."""
    lines = [line for line in lock.splitlines() if not line.startswith("#")]
    end = next(k for k, line in enumerate(lines) if not line.endswith("\\"))
    return "\n".join(lines[: end + 1]) + "\n"


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

"""What was learned of a truck, kept on disk between two drives: a file with two slots, as in the truck."""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Callable
from pathlib import Path

from oncenter import _core
from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.files import lock
from oncenter.files.file_name import file_stem
from oncenter.files.regular_file import O_BINARY

SLOTS = 2
_CONTENT_MAX_BYTES = 1 << 22


def default_folder() -> Path:
    """Where this system keeps what programs remember."""
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local") / "oncenter"
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Application Support" / "oncenter"
    return Path(os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state") / "oncenter"


class Memory:
    """The saved states of one truck.

    Args:
        folder: is made where it is not there.
        truck: the key; each has files of its own, see `oncenter.files.file_name`.
        say: is told in one line what was resumed, and what could not be saved.

    Raises:
        OncenterError: "state", exit code 2: the folder cannot be made.
    """

    def __init__(self, folder: Path, truck: str, say: Callable[[str], None]) -> None:
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise OncenterError(f"--state {folder}: {error.strerror}", code="state", exit_code=WRONG_USAGE) from None
        self._stem = folder / file_stem(truck)
        self._truck, self._say = truck, say
        self._file: int | None = None
        self._sequence = 0
        self._failing = False

    def resume(self, core: _core.Core) -> None:
        """Gives the core what was learned before, and takes hold of the file."""
        path = self._stem.with_name(f"{self._stem.name}.state")
        try:
            self._file = os.open(path, os.O_RDWR | os.O_CREAT | O_BINARY, 0o644)
            why = "" if lock.take(self._file) else "another oncenter live has it"
            content = b"" if why else os.read(self._file, _CONTENT_MAX_BYTES)
        except OSError as error:
            why = error.strerror or str(error)
        if why:
            self.close()
            self._say(f"the state of {self._truck} is neither resumed nor saved: {path}: {why}")
            return
        self._reserve(len(content), len(core.save(0)))
        fault, self._sequence = restored(core, _slots(content))
        if fault == "ok":
            core.restart()
            self._say(f"resumed what was learned of {self._truck}")
        elif fault != "missing" or any(content):  # one that is only reserved holds zeros
            why = "no saved state is in it" if fault == "missing" else fault
            self._say(f"the saved state of {self._truck} is not resumed ({path}: {why}); learning starts afresh")

    def _reserve(self, there: int, size: int) -> None:
        """Room for both slots, so that a disk that is full later does not matter."""
        try:
            self._write(bytes(max(SLOTS * size - there, 0)), there)
        except OSError as error:
            self._say(f"no room for the state of {self._truck}: {error.strerror}; tried again each minute")

    def save(self, core: _core.Core) -> None:
        """To the older slot, so that a power cut leaves the newer one; says so once when it fails."""
        if self._file is None:
            return
        sequence = (self._sequence + 1) % 2**32
        image = core.save(sequence)
        try:
            self._write(image, sequence % SLOTS * len(image))
            os.fsync(self._file)
        except OSError as error:
            if not self._failing:
                self._say(f"the state of {self._truck} cannot be saved: {error.strerror}; trying again")
            self._failing = True
            return
        self._sequence = sequence
        if self._failing:
            self._say(f"the state of {self._truck} is saved again")
        self._failing = False

    def _write(self, image: bytes, at: int) -> None:
        assert self._file is not None
        os.lseek(self._file, at, os.SEEK_SET)
        if os.write(self._file, image) < len(image):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    def close(self) -> None:
        if self._file is not None:
            os.close(self._file)
        self._file = None


def _slots(content: bytes) -> list[bytes]:
    size = len(content) // SLOTS
    return [content[k * size : (k + 1) * size] for k in range(SLOTS)]


def restored(core: _core.Core, slots: list[bytes]) -> tuple[str, int]:
    """The core as the newer image that is not refused has it; else what is wrong with one."""
    found = {k: core.restore(image) for k, image in enumerate(slots) if image}
    good = {k: sequence for k, (fault, sequence) in found.items() if fault == "ok"}
    if not good:
        faults = [fault for fault, _ in found.values() if fault != "missing"]
        return (faults[0] if faults else "missing"), 0
    any_of_them = next(iter(good.values()))
    newest = max(good, key=lambda k: (good[k] - any_of_them + 2**31) % 2**32)  # they may have gone round
    return core.restore(slots[newest])

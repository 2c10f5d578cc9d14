"""The learned state of a truck on disk, kept from one drive to the next: a file with two slots, as in an ECU."""

from __future__ import annotations

import errno
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path

from oncenter import _core
from oncenter.errors import WRONG_USAGE, OncenterError
from oncenter.files import lock
from oncenter.files.file_name import file_stem
from oncenter.files.regular_file import O_BINARY, O_NOFOLLOW, O_NONBLOCK, refuse_mode

SLOTS = 2
_CONTENT_MAX_BYTES = 1 << 22


def default_folder() -> Path:
    """The system's folder for program state."""
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local") / "oncenter"
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Application Support" / "oncenter"
    return Path(os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state") / "oncenter"


class Memory:
    """The saved states of one truck.

    Args:
        folder: made if missing.
        truck: the key, see `oncenter.files.file_name` for the name of its file.
        say: called with one line when a state is resumed, or cannot be saved.

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
        """Restores the core's saved state, and locks the file."""
        path = self._stem.with_name(f"{self._stem.name}.state")
        try:
            self._file = os.open(path, os.O_RDWR | os.O_CREAT | O_NOFOLLOW | O_NONBLOCK | O_BINARY, 0o644)
            refuse_mode(os.fstat(self._file).st_mode, "a file")
            why = "" if lock.take(self._file) else "another oncenter live uses it"
            saved_s = os.fstat(self._file).st_mtime
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
            core.restart(max(time.time() - saved_s, 0.0))
            self._say(f"resumed the saved state of {self._truck}")
        elif fault != "missing" or any(content):  # a reserved file holds zeros
            why = "it has no saved state" if fault == "missing" else fault
            self._say(f"the saved state of {self._truck} is not resumed ({path}: {why}); learning starts from zero")

    def _reserve(self, there: int, size: int) -> None:
        """Reserves both slots, so that a disk that is full later does not matter."""
        try:
            self._write(bytes(max(SLOTS * size - there, 0)), there)
        except OSError as error:
            self._say(f"no room for the state of {self._truck}: {error.strerror}; oncenter tries again each minute")

    def save(self, core: _core.Core) -> None:
        """Writes to the older slot, so that a power cut leaves the newer one. Reports a failure once."""
        if self._file is None:
            return
        sequence = (self._sequence + 1) % 2**32
        image = core.save(sequence)
        try:
            self._write(image, sequence % SLOTS * len(image))
            os.fsync(self._file)
        except OSError as error:
            if not self._failing:
                self._say(f"the state of {self._truck} cannot be saved: {error.strerror}; next try in a minute")
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
    """Restores the newer valid image into the core; else returns the fault of one."""
    found = {k: core.restore(image) for k, image in enumerate(slots) if image}
    good = {k: sequence for k, (fault, sequence) in found.items() if fault == "ok"}
    if not good:
        faults = [fault for fault, _ in found.values() if fault != "missing"]
        return (faults[0] if faults else "missing"), 0
    any_of_them = next(iter(good.values()))
    newest = max(good, key=lambda k: (good[k] - any_of_them + 2**31) % 2**32)  # sequence numbers wrap around
    return core.restore(slots[newest])

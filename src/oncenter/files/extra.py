"""Packages that only some work needs: which extra brings each, and the one line that says so where it is missing.

Imports nothing heavy, so that a verb can ask before its work begins.
"""

from __future__ import annotations

from importlib.util import find_spec

from oncenter.errors import OncenterError

# By the module that is imported: what the package is called, and the smallest extra that brings it.
_BROUGHT_BY = {
    "asammdf": ("asammdf", "mf4"),
    "bokeh": ("bokeh", "report"),
    "can": ("python-can", "can"),
    "cantools": ("cantools", "can"),
    "blake3": ("blake3", "fleet"),
    "pyarrow": ("pyarrow", "fleet"),
    "ray": ("Ray", "fleet"),
    "matplotlib": ("matplotlib", "thesis"),
    "msgpack": ("msgpack", "live"),
    "h5py": ("h5py", "mat"),
    "scipy": ("scipy", "mat"),
    "rosbags": ("rosbags", "ros"),
}


def missing_extra(extra: str, what: str) -> OncenterError:
    """What to say where an extra is not installed.

    Args:
        extra: its name in pyproject.toml, as "mf4".
        what: the file or option and the package that it needs, as "drive.mf4 needs asammdf".
    """
    return OncenterError(f"{what}, which is not installed: pip install 'oncenter[{extra}]'", code="missing_extra")


def require_package(module: str, what: str, extra: str | None = None) -> None:
    """Asks for a package before it is imported; costs next to nothing, for it is looked for and not loaded.

    Args:
        module: as it is imported, one of those that an extra brings.
        what: the file or option that needs it, as "drive.mf4".
        extra: that to name where a larger one is meant than the smallest that brings it.

    Raises:
        OncenterError: "missing_extra", exit code 1: it is not installed.
    """
    package, smallest = _BROUGHT_BY[module]
    if not is_installed(module):
        raise missing_extra(extra or smallest, f"{what} needs {package}")


def is_installed(module: str) -> bool:
    try:
        return find_spec(module) is not None
    except (ImportError, ValueError):  # something keeps it from being imported
        return False

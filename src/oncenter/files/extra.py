"""Optional packages: the extra that installs each, and the error if one is missing.

Imports nothing heavy, so that a command can check before its work starts.
"""

from __future__ import annotations

from importlib.util import find_spec

from oncenter.errors import OncenterError

# By imported module: the name of the package, and the smallest extra that installs it.
_BROUGHT_BY = {
    "asammdf": ("asammdf", "mf4"),
    "bokeh": ("bokeh", "report"),
    "can": ("python-can", "can"),
    "cantools": ("cantools", "can"),
    "blake3": ("blake3", "fleet"),
    "pyarrow": ("pyarrow", "s3"),
    "ray": ("Ray", "ray"),
    "matplotlib": ("matplotlib", "thesis"),
    "msgpack": ("msgpack", "live"),
    "h5py": ("h5py", "mat"),
    "scipy": ("scipy", "mat"),
    "rosbags": ("rosbags", "ros"),
}


def missing_extra(extra: str, what: str) -> OncenterError:
    """The error for an extra that is not installed.

    Args:
        extra: its name in pyproject.toml, as "mf4".
        what: the file or option and the package that it needs, as "drive.mf4 needs asammdf".
    """
    return OncenterError(f"{what}, which is not installed: pip install 'oncenter[{extra}]'", code="missing_extra")


def require_package(module: str, what: str, extra: str | None = None) -> None:
    """Checks that a package is installed, without importing it.

    Args:
        module: imported name, one of those that an extra installs.
        what: the file or option that needs it, as "drive.mf4".
        extra: to be named instead of the smallest extra.

    Raises:
        OncenterError: "missing_extra", exit code 1: it is not installed.
    """
    package, smallest = _BROUGHT_BY[module]
    if not is_installed(module):
        raise missing_extra(extra or smallest, f"{what} needs {package}")


def is_installed(module: str) -> bool:
    try:
        return find_spec(module) is not None
    except (ImportError, ValueError):  # not importable
        return False

"""Packages that only some work needs: the one line that says so where one is missing."""

from __future__ import annotations

from oncenter.errors import OncenterError


def missing_extra(extra: str, what: str) -> OncenterError:
    """What to say where an extra is not installed.

    Args:
        extra: its name in pyproject.toml, as "mat".
        what: the file and the package that it needs, as "drive.mat needs scipy".
    """
    return OncenterError(f"{what}, which is not installed: pip install 'oncenter[{extra}]'", code="missing_extra")

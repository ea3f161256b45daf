"""Origin of a report: when, from which commit and on which machine it was made."""

from __future__ import annotations

import subprocess
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from comparison.models import platform_name


@dataclass(frozen=True)
class Origin:
    """When, from what and where a report was made, one line each."""

    time: str
    code: str
    machine: str


def origin() -> Origin:
    """Return the origin of a report that is made now."""
    return Origin(
        time=datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
        code=_code(Path(__file__)),
        machine=platform_name(),
    )


def _code(file: Path) -> str:
    """Return version and, where this file is tracked in a checkout, the commit; "modified" if it differs."""
    try:
        release = f"sixbar-crossval {version('sixbar-crossval')}"
    except PackageNotFoundError:
        release = "sixbar-crossval"
    # An installed package may lie inside another project's checkout, whose commit says nothing about it.
    if _git(file, "ls-files", "--error-unmatch", file.name) is None:
        return release
    commit = _git(file, "rev-parse", "--short=10", "HEAD")
    if not commit:
        return release
    changed = _git(file, "status", "--porcelain", "--untracked-files=no", ":/")
    return f"{release}, commit {commit}{' with modifications' if changed else ''}"


def _git(file: Path, *arguments: str) -> str | None:
    """Return git's answer in the file's folder; None where there is no git, or it fails."""
    try:
        ran = subprocess.run(
            ["git", "-C", str(file.parent), *arguments],
            capture_output=True,
            text=True,
            timeout=10,
            check=True,
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return ran.stdout.strip()

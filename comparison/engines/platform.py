"""Machine and library identification, as far as the last bits of a result depend on it."""

from __future__ import annotations

import os
import platform
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

# The C mathematical library and numba's compiler select code paths with different rounding by these features.
_FEATURES = ("avx2", "avx512f", "fma", "asimd", "sve")
# Variables that make them select others. Where glibc's say something else, stored results are computed again.
_CHOSEN = {
    "OPENBLAS_CORETYPE": "OpenBLAS for",
    "GLIBC_TUNABLES": "glibc with",
    "NUMBA_CPU_NAME": "numba for",
    "NUMBA_CPU_FEATURES": "numba with",
}


@cache
def platform_name() -> str:
    """Return system, C library and processor: ``"Linux x86_64, glibc 2.36, AMD EPYC 25/1 avx2 fma"``.

    Followed by what the environment makes OpenBLAS, the C library and numba take it for, if anything.
    """
    library = " ".join(platform.libc_ver()).strip()
    parts = (
        f"{platform.system()} {platform.machine()}",
        library,
        _processor(Path("/proc/cpuinfo")),
        *(f"{words} {chosen}" for name, words in _CHOSEN.items() if (chosen := os.environ.get(name))),
    )
    return ", ".join(part for part in parts if part)


def versions() -> dict[str, str]:
    """Return the versions of Python and of the packages that compute."""
    return {"python": platform.python_version()} | {
        name: _version(name) for name in ("numpy", "scipy", "numba", "exudyn")
    }


def made_on() -> str:
    """Return machine and versions in one line, for display below numbers that depend on them."""
    return f"{platform_name()}; {', '.join(f'{name} {number}' for name, number in versions().items())}"


def _processor(cpuinfo: Path) -> str:
    """Return the processor's model, family, number and features from ``/proc/cpuinfo``."""
    try:
        lines = cpuinfo.read_text("utf-8", errors="replace").splitlines()
    except OSError:
        return platform.processor()
    first: dict[str, str] = {}
    for line in lines:
        key, _, value = line.partition(":")
        first.setdefault(key.strip(), value.strip())
    can = first.get("flags", first.get("Features", "")).split()
    numbers = "/".join(first[key] for key in ("cpu family", "model") if key in first)
    return " ".join(
        part
        for part in (first.get("model name", ""), numbers, *(name for name in _FEATURES if name in can))
        if part
    )


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "none"

"""Progress of work that has parts."""

from __future__ import annotations

from comparison.execution.run import Progress


def part(on_progress: Progress | None, start: float, end: float) -> Progress | None:
    """Return what reports the progress of a part, which takes the whole from one share to another."""
    return None if on_progress is None else lambda share: on_progress(start + (end - start) * share)

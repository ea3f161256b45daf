"""The gate as a command, and its baseline edited."""

from __future__ import annotations

import json
import re
from pathlib import Path

from comparison.cli import main

BASELINE = Path("sixbar-baseline.toml")


def gate(*arguments: str) -> int:
    """One worker: starting another costs more than the fakes' runs."""
    return main(["gate", *arguments, "--jobs", "1"])


def edit(pattern: str, by: str) -> None:
    text, count = re.subn(pattern, by, BASELINE.read_text(), count=1, flags=re.MULTILINE)
    assert count == 1
    BASELINE.write_text(text)


def checks() -> dict[tuple[str, str], dict[str, str]]:
    """What did not pass, by run and item."""
    record = json.loads(Path("reports/out/gate/gate.json").read_text())
    return {(c["group"], c["name"]): c for c in record["checks"] if c["status"] in ("failed", "error")}

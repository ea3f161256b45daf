"""The gate as a command, and its baseline edited."""

from __future__ import annotations

import json
import re
import tomllib
from contextlib import suppress
from pathlib import Path

from comparison.cli import main
from comparison.regression.baseline import Baseline, checksum

BASELINE = Path("sixbar-baseline.toml")


def gate(*arguments: str) -> int:
    """One worker: starting another costs more than the fakes' runs."""
    return main(["gate", *arguments, "--jobs", "1"])


def edit(pattern: str, by: str) -> None:
    text, count = re.subn(pattern, by, BASELINE.read_text(), count=1, flags=re.MULTILINE)
    assert count == 1
    seal(text)


def seal(text: str) -> None:
    """Write the baseline with the checksum of what it holds, if that is a baseline at all."""
    BASELINE.write_text(text)
    with suppress(ValueError):
        content = tomllib.loads(text)
        content.pop("checksum")
        made = checksum(Baseline.model_validate(content))
        BASELINE.write_text(re.sub("^checksum = .*", f'checksum = "{made}"', text, flags=re.MULTILINE))


def checks() -> dict[tuple[str, str], dict[str, str]]:
    """What did not pass, by run and item."""
    record = json.loads(Path("reports/out/gate/gate.json").read_text())
    return {(c["group"], c["name"]): c for c in record["checks"] if c["status"] in ("failed", "error")}

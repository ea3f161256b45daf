"""Numbers of the paper's equations: one table (docs/model.md, section 11), to which every mention is held."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
FOLDERS = (
    "comparison",
    "reference_model",
    "exudyn_model",
    "sixbar",
    "docs",
    "examples",
    "benchmarks",
    "tests",
)
MENTION = re.compile(r"\bEqs?\.\s(\d+(?:(?:-|–|, | and | to )\d+)*)(?!\d)")


def spread(text: str) -> list[int]:
    """Return the numbers of "3-6", "7, 8", "9 to 11"."""
    numbers: list[int] = []
    for piece in re.split(r", | and ", text):
        first, *last = re.split(r"-|–| to ", piece)
        numbers += range(int(first), int(last[0] if last else first) + 1)
    return numbers


def table() -> dict[int, str]:
    section = (ROOT / "docs" / "model.md").read_text("utf-8").partition("\n## 11. ")[2]
    rows = re.findall(r"^\| ([\d, -]+) \| ([\d.]+) \| (.+?) \|", section, re.MULTILINE)
    return {number: equation for numbers, _, equation in rows for number in spread(numbers)}


def mentions():
    for folder in FOLDERS:
        for path in sorted((ROOT / folder).rglob("*")):
            if path.suffix not in (".py", ".md", ".toml", ".j2") or path == Path(__file__):
                continue
            text = path.read_text("utf-8")
            yield from ((path.relative_to(ROOT), match) for match in MENTION.finditer(text))


def test_the_table_has_every_equation_once_in_order():
    assert list(table()) == list(range(1, 38))


def test_every_mention_is_in_the_table():
    known, found = table(), list(mentions())
    assert len(found) > 100
    assert [(str(path), match[0]) for path, match in found if not set(spread(match[1])) <= known.keys()] == []

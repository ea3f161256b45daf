"""Numbers of the paper's equations: one table (docs/model.md, section 11), to which every mention is held."""

import re
from pathlib import Path

import pytest

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
            for match in MENTION.finditer(text):
                start = text.rfind("\n\n", 0, match.start()) + 1
                yield path.relative_to(ROOT), match, text[max(start, match.start() - 60) : match.end() + 60]


def test_the_table_has_every_equation_once_in_order():
    assert list(table()) == list(range(1, 38))


def test_every_mention_is_in_the_table():
    known, found = table(), list(mentions())
    assert len(found) > 100
    assert [
        (str(path), match[0]) for path, match, _ in found if not set(spread(match[1])) <= known.keys()
    ] == []


@pytest.mark.parametrize(
    ("phrase", "equations"),
    [
        (r"Phi\(beta\), Eq", {37}),
        (r"beta(, | is beta of\s+)Eq", {35}),
        (r"Delta_mu of Eq", {36}),
        (r"error is .*Eq", {34}),
        (r"alpha and beta.*Eq", {21}),
        (r"c_f of Eq", {12}),
        (r"n of Eq\. 9", {9}),
    ],
)
def test_mentions_of_a_quantity_are_of_its_equation(phrase, equations):
    of = [match for _, match, around in mentions() if re.search(phrase, around)]
    assert of
    assert any(equations == set(spread(match[1])) for match in of)

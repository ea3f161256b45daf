"""The README's numbers are those of the committed reports and of the code."""

import re
import tomllib
from pathlib import Path
from xml.etree import ElementTree

from comparison.accuracy.levels import TIERS, thresholds
from comparison.accuracy.uncertainty import PERTURBATION
from comparison.cli.study import generated, index, with_generated
from comparison.scene import load_scene, shipped_scenes
from comparison.studies import NAMES
from comparison.studies.paper import MAIN, PARTS

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text("utf-8")
VERDICTS = (ROOT / "docs" / "verdicts.md").read_text("utf-8")
REPORTS = ROOT / "reports"


def test_the_verdicts_and_rates_are_those_of_the_reports():
    pages = {path: (REPORTS / path).read_text("utf-8") for path in (f"{name}/README.md" for name in NAMES)}
    text = generated(pages)
    assert sum(line[:1] == "|" for line in text.splitlines()) == 2 + len(shipped_scenes())
    assert re.search(r"\d+ false alarms in \d{3,} decided comparisons", text)
    assert with_generated(README, text) == README


def test_the_verdicts_on_record_are_those_of_the_reports():
    recorded = tomllib.loads((REPORTS / "verdicts" / "verdicts.toml").read_text("utf-8"))["scenes"]
    assert list(recorded) == shipped_scenes()
    text = (REPORTS / "verdicts" / "README.md").read_text("utf-8")
    rows = {line.split(" | ")[0].removeprefix("| "): line for line in text.splitlines() if line[:1] == "|"}
    for name, known in recorded.items():
        scene = load_scene(name)
        assert known["hash"] == scene.hash
        reported = re.findall(r"\*\*(.+?)\*\*", rows[scene.title])
        assert reported == [known[tier] for tier in TIERS]


def test_the_list_of_the_studies_is_that_of_their_reports():
    paths = [f"{name}/README.md" for name in NAMES]
    paths[2:2] = [f"paper/{part}.md" for part in PARTS if part != MAIN]
    pages = {path: (REPORTS / path).read_text("utf-8") for path in paths}
    assert (REPORTS / "README.md").read_text("utf-8") == index(pages)
    for path, text in pages.items():
        assert text.startswith("# ")
        for link in re.findall(r"\]\(([\w./-]+\.(?:svg|csv|md))\)", text):
            assert (REPORTS / path).parent.joinpath(link).is_file(), f"{path}: {link}"
    for picture in REPORTS.glob("*/**/*.svg"):
        ElementTree.parse(picture)  # it raises


def test_it_is_short():
    assert len(README) <= 7000


def test_the_numbers_in_the_sentences_of_the_verdicts_are_those_of_the_code():
    said = " ".join(VERDICTS.replace("$", "").split())
    standard, tight = thresholds("standard"), thresholds("tight")
    assert f"u must be {standard.alpha / tight.alpha:g} times smaller" in said
    assert {2.0: "within twice the combined u"}[standard.k] in said
    assert {1e-9: "from a start moved by a billionth of the clearance"}[PERTURBATION] in said


def test_every_file_that_the_readme_names_exists():
    for name in re.findall(r"`([a-z_./]+\.(?:toml|cff|py|svg))`|\]\(([A-Za-z_./-]+)\)", README):
        assert (ROOT / (name[0] or name[1])).exists(), name

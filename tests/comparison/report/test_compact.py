"""Shorter drawings that show the same."""

import re

import pytest

from comparison.report import svg
from comparison.report.compact import compact
from comparison.report.gallery import representative
from comparison.verdict.results import SceneComparison

NUMBER = re.compile(r"-?\d*\.?\d+")


def absolute(path: str) -> list[tuple[float, float]]:
    """Return the points of a path of straight lines, in tenths of a point."""
    points, here, start = [], (0.0, 0.0), (0.0, 0.0)
    for letter, numbers in re.findall(r"([MLmlz])([^MLmlz]*)", path):
        if letter == "z":
            here = start
            continue
        values = [float(number) for number in NUMBER.findall(numbers)]
        for n, (x, y) in enumerate(zip(values[::2], values[1::2], strict=True)):
            here = (here[0] + x, here[1] + y) if letter.islower() else (x, y)
            if letter in "mM" and n == 0:
                start = here
            points.append((round(10 * here[0]), round(10 * here[1])))
    return points


def test_a_drawing_keeps_its_points_texts_and_references_in_less_text(scene: SceneComparison) -> None:
    with svg.style():
        (drawing,) = representative(scene, "s0")
    before, after = str(drawing.svg), compact(str(drawing.svg))
    assert len(after) < 0.75 * len(before)
    paths = [re.findall(r' d="([^"]*)"', text) for text in (before, after)]
    assert [absolute(path) for path in paths[0]] == [absolute(path) for path in paths[1]]
    for kept in (r">([^<]+)</text>", r'(?:url\(#|href="#)([^")]+)', r' id="([^"]+)"', r"var\(--\w+\)"):
        assert re.findall(kept, before) == re.findall(kept, after)
    assert len(re.findall("<g[ >]", after)) == after.count("</g>")


@pytest.mark.parametrize(
    ("path", "shorter"),
    [
        ("M0 0L1.5 -2L1.5 -2.1z", "m0 0 1.5-2 0-.1z"),
        ("M1 1L2 2zM5 5L6 5", "m1 1 1 1zm4 4 1 0"),
        ("M0 0Q1 1 2 2", "M0 0Q1 1 2 2"),
        ("M0 0L0.25 1", "M0 0L0.25 1"),
        ("", ""),
    ],
)
def test_paths_become_relative_or_stay(path: str, shorter: str) -> None:
    assert compact(f'<path d="{path}"/>') == f'<path d="{shorter}"/>'

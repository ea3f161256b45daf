"""What a reader sees of each kind of verdict: named, first, in words and numbers."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from playwright.sync_api import Page

pytestmark = pytest.mark.browser

MOVED = ["slider x: |E|/2u (99%) is ", ": 1.0 µm against"]
ORDER = ["crashed", "fault", "confirmed", "undecided", "press", "underestimated"]


SHADE = """name => {
  const s = document.createElement("span"); s.style.color = `var(--${name})`; document.body.append(s);
  const c = getComputedStyle(s).color; s.remove(); return c;
}"""


@pytest.mark.parametrize("width", [1440, 390])
def test_the_worst_scenes_come_first_and_are_named_in_the_headline(
    show: Callable[..., Page], width: int
) -> None:
    page = show(width)
    assert page.locator(".grid tbody th").all_inner_texts() == ORDER
    assert page.locator(".lead .verdict").inner_text().split(maxsplit=1)[1] == "cannot compare"
    named = page.locator(".failing a").all_inner_texts()
    assert [text.split(",")[0] for text in named] == ORDER[:4]


@pytest.mark.parametrize(
    ("scene", "sign", "shade", "said"),
    [
        ("crashed", "!", "bad", ["the exudyn run did not succeed: crashed", "--model exudyn"]),
        ("fault", "✗", "bad", [*MOVED, "unconfirmed, 3 runs", "formulation="]),
        ("confirmed", "✗", "bad", [*MOVED, "confirmed by at least 30 runs"]),
        ("undecided", "?", "open", ["Not decided: ", "are required", "--accuracy strict"]),
        ("underestimated", "✓", "good", ["underestimated 6.4 times and is corrected"]),
        ("press", "✓", "good", ["no channel is nearer to its limit", "Nothing to do."]),
    ],
)
def test_each_verdict_says_what_how_much_and_what_next(
    show: Callable[..., Page], scene: str, sign: str, shade: str, said: list[str]
) -> None:
    key = f"s{ORDER.index(scene)}"
    page = show(anchor=f"#{key}-standard")
    cell = page.locator(f'.grid a.cell[href="#{key}-standard"]')
    assert sign in cell.inner_text()
    card = page.locator(f"#{key}-standard")
    card.wait_for(state="visible")
    assert card.evaluate("e => getComputedStyle(e).borderLeftColor") == page.evaluate(SHADE, shade)
    text = " ".join(card.inner_text().split())
    for words in said:
        assert words in text
    # Nothing is drawn of a run that does not exist.
    assert page.locator(f"#{key} .viewer").count() == (scene != "crashed")

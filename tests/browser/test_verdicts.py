"""What a reader sees of each kind of verdict: named, first, in words and numbers."""

import pytest

pytestmark = pytest.mark.browser

MOVED = ["slider_x, |E|/2u (99%) = ", "the difference is -1e-06 m"]
ORDER = ["crashed", "fault", "confirmed", "undecided", "press", "underestimated"]


SHADE = """name => {
  const s = document.createElement("span"); s.style.color = `var(--${name})`; document.body.append(s);
  const c = getComputedStyle(s).color; s.remove(); return c;
}"""


@pytest.mark.parametrize("width", [1440, 390])
def test_the_worst_scenes_come_first_and_are_named_in_the_headline(show, width):
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
        ("undecided", "?", "open", ["are indeterminate", "required: at least 50%", "--accuracy strict"]),
        ("underestimated", "✓", "good", ["uncertainty underestimated 6.4 times"]),
        ("press", "✓", "good", ["excited channels agree, nearest to its limit"]),
    ],
)
def test_each_verdict_says_what_how_much_and_what_next(show, scene, sign, shade, said):
    page = show(anchor=f"#{scene}--standard")
    cell = page.locator(f'.grid a.cell[href="#{scene}--standard"]')
    assert sign in cell.inner_text()
    card = page.locator(f"#{scene}--standard")
    card.wait_for(state="visible")
    assert card.evaluate("e => getComputedStyle(e).borderLeftColor") == page.evaluate(SHADE, shade)
    text = " ".join(card.inner_text().split())
    for words in said:
        assert words in text
    # Nothing is drawn of a run that does not exist.
    assert page.locator(f"#{scene} .viewer").count() == (scene != "crashed")

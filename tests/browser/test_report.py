"""The report as a browser shows it: nothing missing, cut off or on top of something else, wide and narrow."""

import pytest
from axe_playwright_python.sync_playwright import Axe

from comparison.report.page import render

pytestmark = pytest.mark.browser

# All parts opened, the drawings shown as in print and where scripts are off.
MEASURE = """
() => {
  const root = document.documentElement, closed = document.querySelectorAll("details:not([open])").length;
  root.classList.remove("interactive");
  document.querySelectorAll("details").forEach(d => { d.open = true; });
  const box = e => e.getBoundingClientRect(), drawn = e => box(e).width > 0 && box(e).height > 0;
  const cut = [], overlaps = [];
  for (const figure of document.querySelectorAll("figure svg")) {
    const outer = box(figure), texts = [...figure.querySelectorAll("text")];
    const boxes = texts.map(box);
    boxes.forEach((b, i) => {
      const name = texts[i].textContent.trim();
      const out = [outer.left - b.left, b.right - outer.right, outer.top - b.top, b.bottom - outer.bottom];
      if (Math.max(...out) > 1) cut.push(name);
      for (let j = 0; j < i; j++) {
        const c = boxes[j];
        const wide = Math.min(b.right, c.right) - Math.max(b.left, c.left);
        const high = Math.min(b.bottom, c.bottom) - Math.max(b.top, c.top);
        if (wide > 1 && high > 3) overlaps.push(name + " / " + texts[j].textContent.trim());
      }
    });
  }
  const figures = [...document.querySelectorAll(".static figure svg")];
  const letters = figures.flatMap(s => [...s.querySelectorAll("text, tspan")].map(t =>
    parseFloat(getComputedStyle(t).fontSize) * box(s).width / s.viewBox.baseVal.width));
  return {
    overflow: root.scrollWidth - root.clientWidth, closed, cut, overlaps,
    figures: figures.filter(drawn).length,
    lines: figures.map(s => [...s.querySelectorAll("path")].filter(p => p.getTotalLength() > 0).length),
    strips: [...document.querySelectorAll("td.strip")].filter(drawn).length,
    smallest: Math.min(...letters),
  };
}
"""


@pytest.mark.parametrize("width", [390, 1280])
def test_the_page_holds_all_and_nothing_is_cut_off_or_overlaps(width, show, comparisons):
    sizes = show(width).evaluate(MEASURE)
    assert sizes["figures"] == 5  # one a scene with channels
    # Axes with grid and ticks, both models, the difference and its threshold, legends.
    assert min(sizes["lines"]) >= 10
    channels = [
        channel for scene in comparisons for tier in scene.tiers for channel in tier.channels.values()
    ]
    assert sizes["strips"] == sum(channel.verdict != "unexcited" for channel in channels)
    assert sizes["overflow"] == 0
    assert sizes["cut"] == []
    assert sizes["overlaps"] == []
    # Exponents of the logarithmic ticks are the smallest: 0.7 of the labels.
    assert sizes["smallest"] >= 0.7 * (7.0 if width < 500 else 11.0)


def test_the_overview_is_on_the_first_screen(show):
    page = show(1440, 900)
    for part in (".lead", ".failing", ".contents", ".worst svg", ".grid tbody tr:last-child", ".terms"):
        box = page.locator(part).first.bounding_box()
        assert box is not None
        assert box["y"] + box["height"] <= 900, part


@pytest.mark.parametrize(("width", "scheme"), [(1440, "light"), (1440, "dark"), (390, "light")])
def test_axe_finds_nothing(show, width, scheme):
    page = show(width, 900, color_scheme=scheme)
    page.evaluate("document.querySelectorAll('details').forEach(d => { d.open = true; })")
    for root in page.locator(".viewer").all():
        root.scroll_into_view_if_needed()
        root.locator("canvas").first.wait_for()
    violations = Axe().run(page).response["violations"]
    assert [(rule["id"], rule["impact"], rule["nodes"][0]["html"]) for rule in violations] == []


def test_a_link_of_the_overview_opens_its_scene_and_the_navigation_stays_in_view(show):
    page = show()
    page.locator('.grid a.cell[href="#press--standard"]').click()
    page.locator("#press--standard").wait_for(state="visible")
    page.locator('.contents a[href="#definition"]').click()
    page.wait_for_function(
        "() => Math.abs(document.querySelector('.contents').getBoundingClientRect().y) < 1"
    )
    heading, bar = (page.locator(name).bounding_box() for name in ("#definition", ".contents"))
    assert heading["y"] >= bar["height"]


def test_a_page_that_lacks_a_scene_is_not_green(show, comparisons, tmp_path):
    path = tmp_path / "a.html"
    html = render(comparisons[:1], title="Press", command="sixbar validate", missing=["late"])
    path.write_text(html, "utf-8")
    page = show(path=path)
    colour = page.locator(".card .verdict.agree").first.evaluate("e => getComputedStyle(e).color")
    colours = page.locator("header *").evaluate_all("all => all.map(e => getComputedStyle(e).color)")
    assert colour not in colours
    assert "Not compared: late." in page.locator(".lead").inner_text()


def test_drawings_stand_in_for_the_plots_in_print_and_without_scripts(show):
    screen, paper = show(anchor="#fault"), show(anchor="#fault")
    fallback = show(java_script_enabled=False)
    paper.emulate_media(media="print")
    fallback.locator("details.scene > summary").nth(1).click()
    for page, drawn in ((screen, False), (paper, True), (fallback, True)):
        assert page.locator("#fault .static svg").first.is_visible() == drawn
        assert page.locator("#fault .viewer").is_visible() != drawn


SHIFT = ["slider_x, |E|/2u (99%) = ", "the difference is -1e-06 m"]
ORDER = ["crashed", "fault", "confirmed", "undecided", "press", "underestimated"]


SHADE = """name => {
  const s = document.createElement("span"); s.style.color = `var(--${name})`; document.body.append(s);
  const c = getComputedStyle(s).color; s.remove(); return c;
}"""


def test_the_worst_scenes_come_first_and_are_named_in_the_headline(show):
    page = show()
    assert page.locator(".grid tbody th").all_inner_texts() == ORDER
    assert page.locator(".lead .verdict").inner_text().split(maxsplit=1)[1] == "cannot compare"
    links = page.locator(".failing a").all_inner_texts()
    assert [text.split(",")[0] for text in links] == ORDER[:4]


@pytest.mark.parametrize(
    ("scene", "sign", "shade", "pieces"),
    [
        ("crashed", "!", "bad", ["the exudyn run did not succeed: crashed", "--model exudyn"]),
        ("fault", "✗", "bad", [*SHIFT, "unconfirmed, 3 runs", "formulation="]),
        ("undecided", "?", "open", ["are indeterminate", "required: at least 50%", "--accuracy strict"]),
        ("press", "✓", "good", ["excited channels agree, nearest to its limit"]),
    ],
)
def test_each_verdict_says_what_how_much_and_what_next(show, scene, sign, shade, pieces):
    page = show(anchor=f"#{scene}--standard")
    cell = page.locator(f'.grid a.cell[href="#{scene}--standard"]')
    assert sign in cell.inner_text()
    card = page.locator(f"#{scene}--standard")
    card.wait_for(state="visible")
    assert card.evaluate("e => getComputedStyle(e).borderLeftColor") == page.evaluate(SHADE, shade)
    text = " ".join(card.inner_text().split())
    for words in pieces:
        assert words in text
    # Nothing is drawn of a run that does not exist.
    assert page.locator(f"#{scene} .viewer").count() == (scene != "crashed")

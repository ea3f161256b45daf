"""The interactive plots: zoom, shared cursor, channels, impacts, moving schematic; by mouse and by key."""

import numpy as np
import pandas as pd
import pytest

from comparison.tables.channels import CORNERS

pytestmark = pytest.mark.browser

STATE = """
id => {
  const v = [...viewers.values()].find(v => "#" + v.key === id), plots = v.plots;
  return {
    range: v.range, ranges: plots.map(p => [p.scales.x.min, p.scales.x.max]), time: v.data.t[v.index],
    cursors: plots.map(p => p.cursor.idx), index: v.index, shown: [...v.shown], tier: v.tier,
  };
}
"""
IN_VIEW = """
label => {
  const figures = [...document.querySelectorAll("#press--plots figure")];
  const figure = figures.find(f => f.ariaLabel.startsWith(label));
  const {top, bottom} = figure.getBoundingClientRect();
  return top >= 0 && bottom <= innerHeight + 1;
}
"""
PULSES = """
id => {
  const v = [...viewers.values()].find(v => "#" + v.key === id), [low, high] = v.range;
  const pulses = v.data.pulses.map(list => list.filter(p => p.end > low && p.start < high));
  const [name] = v.data.places[pulses[0][0].corner];
  const at = v.data.channels.filter(c => v.shown.has(c.name)).findIndex(c => c.name === name);
  return {pulses, top: v.plots[2 * at].scales.y.max};
}
"""
SCHEMATIC = """
() => {
  const figure = document.querySelector("#press .schematic"), g = JSON.parse(figure.dataset.geometry);
  const points = figure.querySelector(".body.first").points, middle = (points[0].x + points[2].x) / 2;
  const at = name => ["cx", "cy"].map(k => Number(figure.querySelector(`.at-${name}`).getAttribute(k)));
  const [O, A] = ["O", "A"].map(at);
  return {
    title: figure.querySelector(".heading").textContent, x: (middle - g.slider[0]) / g.magnified,
    crank: Math.hypot(A[0] - O[0], A[1] - O[1]) / g.view[0], scale: g.view[0],
  };
}
"""
PLOTS = "#press--plots"  # of the scene that agrees at both tiers
FAULT = "#fault--plots"


def open_plots(show, plots=PLOTS, **options):
    page = show(anchor=plots.replace("plots", "standard"), **options)
    page.locator(plots).scroll_into_view_if_needed()
    page.locator(f"{plots} canvas").first.wait_for()
    return page


def state(page, plots=PLOTS):
    """Range, time of the cursor, shown channels; as the viewer has them."""
    return page.evaluate(STATE, plots)


def press(page, *keys, plots=PLOTS):
    page.focus(f"{plots} .plots")
    for key in keys:
        page.keyboard.press(key)
    page.wait_for_timeout(50)  # the plots draw in the next frame
    return state(page, plots)


def test_dragging_the_wheel_and_keys_zoom_all_plots_together_and_move_the_cursor(show):
    page = open_plots(show)
    whole = state(page)["range"]
    span = whole[1] - whole[0]
    box = page.locator(f"{PLOTS} .u-over").first.bounding_box()
    page.mouse.move(box["x"] + 0.25 * box["width"], box["y"] + 20)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 20, steps=5)
    page.mouse.up()
    page.wait_for_timeout(50)
    view = state(page)
    # A pixel of some 700.
    assert view["range"] == pytest.approx([whole[0] + 0.25 * span, whole[0] + 0.5 * span], abs=0.005 * span)
    assert all(each == pytest.approx(view["range"]) for each in view["ranges"])
    page.mouse.wheel(0, -100)
    page.wait_for_timeout(100)
    nearer = state(page)["range"]
    assert nearer[1] - nearer[0] == pytest.approx(0.8 * (view["range"][1] - view["range"][0]))
    page.get_by_role("button", name="Whole run (0)").locator("visible=true").first.click()
    assert state(page)["range"] == whole
    page = open_plots(show)
    one = press(page, "ArrowRight", "ArrowRight", "ArrowRight")
    assert one["index"] == 3
    assert set(one["cursors"]) == {3}  # of all plots
    assert f"t = {one['time']:.5f} s" in page.locator(f"{PLOTS} .readout").inner_text()
    zoom = press(page, "+", "+")["range"]
    assert zoom[1] - zoom[0] == pytest.approx(span / 4)
    pan = press(page, "Shift+ArrowRight")["range"]
    assert pan[0] - zoom[0] == pytest.approx((zoom[1] - zoom[0]) / 4)
    assert press(page, "0")["range"] == whole


def test_impacts_are_reached_one_by_one_with_both_pulses_up_to_the_peaks_of_the_event_tables(
    show, comparisons
):
    page, readout = open_plots(show), f"{PLOTS} .readout"
    first, second = (events.sort_values("start") for events in comparisons[0].events)
    event = first.iloc[0]
    jump = press(page, "n")
    assert jump["range"][0] < event["start"] < jump["range"][1] < jump["range"][0] + 0.01  # of 0.8 s
    assert f"corner_{event['corner']}_normal" in jump["shown"]
    page.wait_for_function(IN_VIEW, arg=f"normal force, {CORNERS[event['corner']]} corner")
    assert f"{event['start']:.6f} s" in page.locator(readout).inner_text()
    later = press(page, "n")["range"]
    assert later[0] > jump["range"][0]
    assert press(page, "p")["range"] == pytest.approx(jump["range"])
    jump, view = press(page, "n"), page.evaluate(PULSES, PLOTS)
    pair = first.iloc[1], second.iloc[1]
    for (pulse,), event in zip(view["pulses"], pair, strict=True):
        assert len(pulse["t"]) >= 20
        assert max(pulse["n"]) == pytest.approx(event["peak_force"], rel=0.01)
        # 16 bits of the contact's length.
        assert [pulse["t"][0], pulse["t"][-1]] == pytest.approx([event["start"], event["end"]], abs=1e-8)
        assert jump["range"][0] < event["start"] < event["end"] < jump["range"][1]
    # Both peaks are inside the axes, and reach at least half of their height.
    peaks = [event["peak_force"] for event in pair]
    assert max(peaks) < view["top"] < 2 * max(peaks)
    text = f"peak {peaks[0]:.4g} N (reference), {peaks[1]:.4g} N (exudyn)"
    assert text in page.locator(readout).inner_text()


def test_the_first_sample_beyond_is_found(show, comparisons):
    page, channels = open_plots(show, FAULT), comparisons[1].channels.values()
    outside = [c.predictable & (abs(c.difference) > c.limits.k * c.u) for c in channels]
    earliest = min(int(mask.argmax()) for mask in outside if mask.any())
    assert press(page, "o", plots=FAULT)["index"] == earliest
    page = open_plots(show)
    press(page, "o")
    assert "No sample is beyond 2 u" in page.locator(f"{PLOTS} .readout").inner_text()


def test_channels_and_ratio_can_be_chosen(show):
    page = open_plots(show)
    count = page.locator(f"{PLOTS} canvas").count()
    page.locator(f"{PLOTS} .picker input[name=slider_vx]").check()
    assert page.locator(f"{PLOTS} canvas").count() == count + 2
    page.get_by_text("|E| / 2 u", exact=True).locator("visible=true").first.click()
    labels = page.evaluate("() => [...viewers.values()].at(-1).plots.map(p => p.axes[1].label)")
    assert "|difference| / 2 u" in labels


def test_a_link_opens_tier_channels_and_range_and_follows_them(show):
    page = show(anchor="#underestimated")
    # From another scene, as a click on a link does it; a channel that does not exist is ignored.
    page.evaluate("location.hash = '#press/tight/slider_vx,gone/0.1230-0.1400'")
    page.locator(f"{PLOTS} canvas").first.wait_for()
    page.wait_for_timeout(1000)  # the plots above get their heights
    view = state(page)
    assert (view["tier"], view["shown"]) == ("tight", ["slider_vx"])
    assert all(each == pytest.approx([0.123, 0.14]) for each in view["ranges"])
    assert page.locator(f"{PLOTS} .legend b").all_inner_texts() == ["slider velocity x"]
    title, bar = (page.locator(name).bounding_box() for name in (f"{PLOTS} h3", ".contents"))
    assert bar["y"] + bar["height"] <= title["y"] + 1 < 300
    page.locator(f"{PLOTS} .picker input[name=slider_x]").check()
    page.locator(f"{PLOTS} .bar").get_by_text("standard", exact=True).click()
    address = "#press/standard/slider_x,slider_vx/0.12300-0.14000"
    page.wait_for_function("address => location.hash === address", arg=address)
    link = page.locator(f"{PLOTS} .bar a")
    assert link.get_attribute("href") == address
    # The address of one page opens the same view of another.
    copy = show(anchor=address)
    copy.locator(f"{PLOTS} canvas").first.wait_for()
    for key in ("tier", "range"):
        assert state(copy)[key] == state(page)[key]
    assert sorted(state(copy)["shown"]) == ["slider_vx", "slider_x"]
    press(page, "0")
    assert link.get_attribute("href") == "#press/standard/slider_x,slider_vx"


def test_the_shown_curves_are_written_as_csv(show, comparisons):
    page, channel = show(anchor="#press/tight/slider_x"), comparisons[0].tight.channels["slider_x"]
    page.locator(f"{PLOTS} canvas").first.wait_for()
    with page.expect_download() as download:
        page.locator(f"{PLOTS} .legend").get_by_role("button", name="slider x as CSV").click()
    assert download.value.suggested_filename == "press-tight-slider_x.csv"
    table = pd.read_csv(download.value.path())
    first, second = (f"{label} x - guide [m]" for label in ("reference", "exudyn"))
    assert list(table) == ["time [s]", first, second, "reference - exudyn [m]", "2 u [m]", "judged [1]"]
    assert table["time [s]"].to_numpy() == pytest.approx(channel.time)
    step, zero = np.ptp(channel.a) / 65534, comparisons[0].scene["mechanism"]["guide_x"]
    # Half of one of 65,534 steps of the values; 5 bits of the difference and of its threshold.
    assert table[first].to_numpy() == pytest.approx(channel.a - zero, abs=0.51 * step)
    apart = 2**-6 * abs(channel.difference).max()
    assert table[second].to_numpy() == pytest.approx(channel.b - zero, abs=0.51 * step + apart)
    assert table["reference - exudyn [m]"].to_numpy() == pytest.approx(
        channel.difference, rel=0.012, abs=1e-30
    )
    assert table["2 u [m]"].to_numpy() == pytest.approx(channel.threshold, rel=0.012)
    assert (table["judged [1]"] == channel.predictable).all()


def test_the_schematic_moves_with_the_cursor_and_plays_forward_from_an_impact_to_the_end(show, comparisons):
    page = open_plots(show)
    jump = press(page, "n", "n")
    at, schematic = jump["index"], page.evaluate(SCHEMATIC)
    channel, mechanism = comparisons[0].channels["slider_x"], comparisons[0].scene["mechanism"]
    assert schematic["title"] == f"press at {channel.time[at]:.4f} s"
    # A tenth of a pixel, of which 18 are the clearance.
    assert schematic["x"] == pytest.approx(channel.a[at] - mechanism["guide_x"], abs=0.2 / 18 * 2e-4)
    assert schematic["crank"] == pytest.approx(mechanism["crank"]["length"], abs=0.2 / schematic["scale"])
    press(page, " ")
    end = jump["range"][1]
    page.wait_for_function(
        "([id, end]) => [...viewers.values()].find(v => '#' + v.key === id).range[0] > end", arg=[PLOTS, end]
    )
    pause = press(page, " ")
    # The enlarged range has moved along, and is as wide as before.
    assert pause["index"] > at
    assert pause["range"][0] <= pause["time"] <= pause["range"][1]
    assert pause["range"][1] - pause["range"][0] == pytest.approx(end - jump["range"][0])
    page.locator(f"{PLOTS} input[type=range]").evaluate(
        "e => { e.value = 0.79; e.dispatchEvent(new Event('input')); }"
    )
    page.locator(f"{PLOTS} select").select_option("1")
    press(page, " ")
    page.wait_for_function(
        "id => { const v = [...viewers.values()].find(v => '#' + v.key === id);"
        "return v.index === v.data.t.length - 1 && !v.timer; }",
        arg=PLOTS,
    )

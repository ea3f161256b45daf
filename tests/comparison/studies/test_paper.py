"""Printed figures and statements of the paper: how they are judged, on made-up motions with known errors."""

import dataclasses
from collections import Counter
from itertools import product
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from comparison.execution.run import run_one
from comparison.models import MODELS
from comparison.reliability.assessment import cap, reliability
from comparison.scene import SceneError, load_scene
from comparison.scene.schema import Limits
from comparison.studies.paper import claims, fitting, ledger, runs, study
from comparison.studies.paper.claims import Verdict
from comparison.studies.paper.exponents import Chaos
from comparison.studies.paper.ledger import Outcome, Size, Use
from comparison.studies.shared.published import printed_rows, published
from comparison.studies.shared.scenes import settable
from comparison.tables.table import Table

CYCLES, DENSE, SPARSE = 12, 200, 50
CONFIG = runs.Config(DENSE, SPARSE, CYCLES, CYCLES, draws=2, long_draws=1)
LIMITS = {"displacement": 2.0, "velocity": 1.0, "acceleration": 120.0}
SUPPORTED, CONTRADICTED, UNDECIDED = Verdict.SUPPORTED, Verdict.CONTRADICTED, Verdict.UNDECIDED


def table(period, cycles, per_cycle, y=0.0, x=0.0, vy=0.0, ay=0.0, events=()):
    """A run: the ideal motion y = 0.1 cos, plus errors of shape (cycles * per_cycle + 1,) or numbers."""
    time = np.arange(cycles * per_cycle + 1) * (period / per_cycle)
    angle, w = 2 * np.pi * time / period, 2 * np.pi / period
    frame = pd.DataFrame(
        {
            "time": time,
            "slider_x": -0.54995 + x + 0 * time,
            "slider_y": 0.112 * np.cos(angle) + y,
            "slider_vx": 0 * time,
            "slider_vy": -0.112 * w * np.sin(angle) + vy,
            "slider_ay": -0.112 * w**2 * np.cos(angle) + ay,
        }
    )
    contacts = pd.DataFrame(events, columns=["start", "peak_force"])
    return Table(
        frame, contacts, {name: {"min": frame[name].min(), "max": frame[name].max()} for name in frame}
    )


def motions(changes=None, long=None, angles=(45,), chaos=Chaos.UNDECIDED, shape=np.sin):
    """Runs of all conditions without any error, but for some: (scene, channel) -> sizes of each member's.

    A shape is that of the errors over the cycle; a size may be a series of its own instead. The pin pushes
    its bearing at angles (deg) by turns.
    """
    short, ideal, many = {}, {}, {}
    phase = shape(2 * np.pi * np.arange(2 * DENSE + 1) / DENSE)
    for scene, model in product(runs.SCENES, MODELS):
        period = load_scene(scene).period
        ideal[scene, model] = table(period, 2, DENSE)
        members = [
            {
                channel.removeprefix("slider_"): each * phase if np.isscalar(each) else each
                for (name, channel), each in errors.items()
                if name == scene
            }
            for errors in (changes or [{}])
        ]
        short[scene, model] = [table(period, 2, DENSE, **errors) for errors in members]
        many[scene, model] = table(period, CYCLES, SPARSE, **(long or {}).get(scene, {}))
    time = np.linspace(0.0, 0.8, 2 * DENSE + 1)
    # In the first cycle it pushes elsewhere.
    angle = np.radians(np.where(time < 0.399, 45, np.resize(angles, time.size)))
    push = {"time": time, "reaction_A_x": 50 * np.cos(angle), "reaction_A_y": 50 * np.sin(angle)}
    pin = {model: Table(pd.DataFrame(push)) for model in MODELS}
    usual = {pair: tables[0] for pair, tables in short.items()}
    exponents = {model: [2.0] for model in MODELS}
    return runs.Runs(CONFIG, short, ideal, many, pin, usual, chaos=chaos, exponents=exponents)


def spike(scene, time, size):
    """An error that is zero but for one sample of two cycles."""
    values = np.zeros(2 * DENSE + 1)
    values[round(time / load_scene(scene).period * DENSE)] = size
    return values


def ordered(count):
    """Where the k-th of so many uniform numbers between -1 and 1 is in the mean, shape (count,)."""
    return np.linspace(-1, 1, count + 2)[1:-1]


def drawn(made_up, spread=0.1, count=41, **turned):
    """Draws about what the reference shows, by the first id of each number, uniform by a share of its size.

    ``turned``: id -> (share of the draws with the other sign, share half a cycle later).
    """
    result = {}
    for name in runs.numbers().index:
        peak = runs.measure(name, made_up, "reference", LIMITS)
        values = peak.value * (1 + spread * ordered(count))
        if "reliability" in printed_rows().loc[name, "quantity"]:  # what is missing to the cap is spread
            values = runs.CAP - (runs.CAP - peak.value) * (1 + spread * ordered(count))
        time, place = np.full(count, peak.time), np.arange(count) / count
        other_sign, later = turned.get(name.replace("-", "_"), (0, 0))
        values[place < other_sign] *= -1
        time[place >= 1 - later] += load_scene(runs.scene_of(name)).period / 2
        result[name] = pd.DataFrame({"value": values, "time": time, "first": values / 3})
    return result


def judged(made_up, **options):
    return ledger.ledger(made_up, drawn(made_up, **options), LIMITS)


def entries(made_up, **options):
    """Every entry by each of its ids."""
    rows = judged(made_up, **options).to_dict("records")
    return {name: SimpleNamespace(**row) for row in rows for name in row["ids"].split(", ")}


# ---- printed figures


def test_what_a_fit_reads_is_calibration_and_no_prediction(monkeypatch):
    def used_for(word):
        return {str(name) for name, use in printed_rows()["use"].items() if word in use}

    read = []
    monkeypatch.setattr(fitting, "published", lambda name: (read.append(name), published(name))[1])
    fitting.printed_facts()
    assert used_for("geometry") == set(read) == {
        "S2.2-tdc", "S4.2-stroke", "F14c-vy", "F14c-vy2", "F14e-y2", "F14a-x", "F14e-vy", "F14e-vy2",
    }  # fmt: skip
    # The line of the ideal slider is the middle of the printed range of x, to the rounding of its ends.
    low, high = (published(name) for name in sorted(used_for("reference line")))
    offset = load_scene("paper").data["mechanism"]["reference_offset"]
    assert -(low.value + high.value) / 2 == pytest.approx(offset, abs=low.rounding + high.rounding)
    # Each quantity's limit is fitted to the reliabilities that are not at the cap.
    below = {
        name
        for name, _, printed in ledger.printed_reliabilities()
        if cap(Limits(upper=1.0)) - printed.value > printed.rounding
    }
    assert used_for("reliability limit") == below
    assert used_for("cap") == {name for name, *_ in ledger.printed_reliabilities()} - below == {"F16-01-d"}


def test_uses_of_the_distinct_figures():
    # A limit of 2 m is more than the stroke of 0.224 m: no limit of an error.
    rows = judged(motions([{(scene, "slider_y"): 5e-5 for scene in runs.SCENES}]))
    # 9 figures of the motion and 8 reliabilities; 4 reliabilities of the displacement say nothing.
    assert Counter(rows["use"]) == {
        Use.PREDICTION: 25, Use.CALIBRATION: 17, Use.UNINFORMATIVE: 4, Use.MISPRINT: 2,
    }  # fmt: skip
    assert list(rows["ids"][rows["use"] == Use.UNINFORMATIVE]) == [
        "F16-01-d", "F16-05-d", "F17-150-d", "F17-300-d"
    ]  # fmt: skip


@pytest.mark.parametrize("spread", [0.0, 0.2])
def test_what_a_linear_response_to_a_uniform_input_leaves_open(spread):
    """The quantiles of a uniform number are exact: 95 % of it lie within 0.95 of its half-width."""
    within = ledger.interval(10.0 + spread * ordered(2001), 0.0, 0.0)
    assert within.u_input == pytest.approx(0.95 * spread, abs=1e-12)
    assert (within.low, within.high) == pytest.approx((10 - 0.95 * spread, 10 + 0.95 * spread), rel=1e-12)


@pytest.mark.parametrize("count", [50, 200])
def test_an_interval_of_few_draws_holds_its_share_of_further_ones(count):
    sizes = np.random.default_rng(1).uniform(0.0, 1.0, (2000, count))
    within = [ledger.interval(each, 0.0, 0.0) for each in sizes]
    # Of uniform numbers an interval holds what it is long. Three standard errors of a mean of 2000 are below
    # 0.003; the linear rule would hold 0.913 and 0.941.
    assert np.mean([high - low for low, high, _ in within]) == pytest.approx(0.95, abs=0.003)


def test_uncertainties_add_in_squares_to_each_side_of_the_median():
    # Ends 0.95 * 3 below and 0.95 * 40 above the median: 2.85 and 38; numerics and print 3 and 4, together 5.
    u = ordered(4001)
    within = ledger.interval(100 + np.where(u < 0, 3.0, 40.0) * u, 3.0, 4.0)
    assert within.low == pytest.approx(100 - np.hypot(2.85, 5.0), rel=1e-9)
    assert within.high == pytest.approx(100 + np.hypot(38.0, 5.0), rel=1e-9)
    assert within.u_input == pytest.approx((2.85 + 38.0) / 2, rel=1e-9)


@pytest.mark.parametrize(
    ("low", "high", "size"),
    [
        (0.9, 1.1, Size.REPRODUCED),
        (0.5, 1.5, Size.REPRODUCED),  # a factor of three
        (0.5, 1.51, Size.WIDE),
        (-0.1, 1.1, Size.WIDE),  # down to nothing: any factor
        (1.01, 1.1, Size.OUTSIDE),
        (0.1, 0.99, Size.OUTSIDE),  # however wide
        (1.0, 1.0, Size.REPRODUCED),
    ],
)
def test_a_size_is_judged_by_its_interval_and_the_width_of_that(low, high, size):
    assert ledger.Interval(low, high, 0.0).size(1.0) is size


@pytest.mark.parametrize(
    ("ways", "share", "outcome"),
    [
        (1, 1.0, Outcome.AGREES),
        (1, 0.95, Outcome.AGREES),
        (1, 0.94, Outcome.VARIES),
        (1, 0.06, Outcome.VARIES),
        (1, 0.05, Outcome.DIFFERS),
        (2, 1.0, Outcome.OPEN),
        (1, np.nan, Outcome.NONE),
    ],
)
def test_sign_and_instant_are_judged_by_the_share_of_the_draws(ways, share, outcome):
    assert ledger.outcome(ways, share) is outcome


@pytest.mark.parametrize(
    ("row", "at", "size", "sign", "instant"),
    [
        ("F9-69-v", 0.7906, 1.0, Outcome.AGREES, Outcome.AGREES),  # printed: 11.84 mm/s at 0.7906 s
        ("F9-69-v", 0.7906, -1.0, Outcome.DIFFERS, Outcome.AGREES),
        ("F9-69-v", 0.4141, 1.0, Outcome.AGREES, Outcome.DIFFERS),  # the same angle is not the same instant
        # Printed in two ways: neither success nor failure.
        ("F9-210-a", 0.4112, 1.0, Outcome.OPEN, Outcome.OPEN),
        ("F9-210-a", 0.7568, -1.0, Outcome.OPEN, Outcome.OPEN),
    ],
)
def test_size_sign_and_instant_are_judged_apart(row, at, size, sign, instant):
    printed, scene = published(row), runs.scene_of(row)
    channel = {"v": "slider_vy", "a": "slider_ay"}[row[-1]]
    entry = entries(motions([{(scene, channel): spike(scene, at, size * printed.value)}]))[row]
    assert (entry.use, entry.size) == (Use.PREDICTION, Size.REPRODUCED)
    assert (entry.sign, entry.instant) == (sign, instant)
    assert (entry.reference_ratio, entry.exudyn_ratio) == pytest.approx((1.0, 1.0))
    assert (entry.low, entry.high) == pytest.approx(np.array([0.905, 1.095]) * abs(printed.value), rel=1e-3)


def test_shares_of_sign_and_instant_are_those_of_the_draws():
    printed = published("F9-69-v")
    made_up = motions([{("69GPa", "slider_vy"): spike("69GPa", printed.time, printed.value)}])
    entry = entries(made_up, count=100, F9_69_v=(0.25, 0.1))["F9-69-v"]
    assert (entry.sign_share, entry.instant_share, entry.both_share) == pytest.approx((0.75, 0.9, 0.65))
    assert (entry.sign, entry.instant) == (Outcome.VARIES, Outcome.VARIES)


def test_the_numerical_uncertainty_is_the_largest_difference_of_models_and_tiers_and_what_samples_miss():
    printed = published("F9-69-v")
    spikes = {f: [{("69GPa", "slider_vy"): spike("69GPa", 0.79, f * printed.value)}] for f in (1.0, 1.1, 0.7)}
    made_up, model, tier = (motions(each) for each in spikes.values())
    assert entries(made_up)["F9-69-v"].u_num == pytest.approx(runs.MISSED * printed.value)
    made_up.short["69GPa", "exudyn"] = model.short["69GPa", "exudyn"]
    assert entries(made_up)["F9-69-v"].u_num == pytest.approx((0.1 + runs.MISSED) * printed.value)
    made_up.standard["69GPa", "reference"] = tier.standard["69GPa", "reference"]
    entry = entries(made_up)["F9-69-v"]
    assert entry.u_num == pytest.approx((0.3 + runs.MISSED) * printed.value)
    # It widens the interval that the inputs leave, 0.095 of the size.
    assert entry.high == pytest.approx((1 + np.hypot(0.095, 0.302)) * printed.value, rel=1e-3)


def test_an_event_and_a_fitted_figure_add_nothing_to_the_count_of_predictions():
    """The peak of the velocity is printed four times in one way, and the range of y was fitted."""
    errors = {(runs.CENTRAL, "slider_vy"): spike(runs.CENTRAL, 0.7566, -published("F7-T-v").value)}
    made_up = motions([errors], {runs.CENTRAL: {"x": published("F14a-x").value}})
    rows = judged(made_up)
    close = rows[(rows["use"] == Use.PREDICTION) & (rows["size"] == Size.REPRODUCED)]
    assert list(close["ids"]) == ["F7-T-v, F9-210-v, F10-28-v, F12-150-v"]
    assert list(close["both_share"]) == [0.0]  # opposite, and 0.86 of a cycle late
    assert entries(made_up)["F14a-x"].size == Size.REPRODUCED


def test_misprints_and_reliabilities_at_the_cap_are_not_judged():
    by_id = entries(motions())
    for name, use in (("F7-T-d", Use.MISPRINT), ("F14c-y", Use.MISPRINT), ("F16-01-d", Use.UNINFORMATIVE)):
        entry = by_id[name]
        assert (entry.use, entry.size, entry.sign) == (use, Size.NONE, Outcome.NONE)
        assert np.isnan(entry.reference_ratio)
    assert by_id["F7-T-d"].note.startswith("misprint")
    # Without any error nothing is missing to the cap, whatever the limit; the paper misses 0.02.
    assert by_id["F17-300-a"].exudyn_ratio == pytest.approx(0.0, abs=1e-9)
    assert by_id["F17-300-a"].size == Size.OUTSIDE


def test_stroke_dead_centre_and_first_cycle_of_known_motions():
    made_up = motions([{(runs.CENTRAL, "slider_y"): 1e-5 * np.r_[np.ones(DENSE), 3 * np.ones(DENSE + 1)]}])
    shown = {name: runs.measure(name, made_up, "exudyn", {}).value for name in ("S4.2-stroke", "S2.2-tdc")}
    assert shown == pytest.approx({"S4.2-stroke": -0.224, "S2.2-tdc": 111.36}, abs=1e-9)
    assert runs.second(made_up.ideal[runs.CENTRAL, "reference"]).sum() == DENSE + 1
    sizes = [runs.measure("F9-210-d", made_up, "reference", {}, cycle).value for cycle in (1, 2)]
    assert sizes == pytest.approx([3e-5, 3e-5])  # the end of the first is the start of the second
    rising = motions([{(runs.CENTRAL, "slider_y"): 1e-5 * np.linspace(0, 2, 2 * DENSE + 1)}])
    sizes = [runs.measure("F9-210-d", rising, "reference", {}, cycle).value for cycle in (1, 2)]
    assert sizes == pytest.approx([1e-5, 2e-5])


# ---- what is drawn


def test_a_draw_is_the_same_again_and_its_groups_move_their_own_keys_alone():
    scene = load_scene(runs.CENTRAL)
    first = runs.draw(scene, 5)
    runs.drawn.cache_clear()
    assert runs.draw(scene, 5) == first != runs.draw(scene, 6)
    known, moved = settable(scene.data), set()
    for group in runs.GROUPS:
        own = {key for key, value in runs.draw(scene, 5, group).items() if value != known[key]}
        assert own >= {one["key"] for one in runs.INPUTS if one["group"] == group}
        if group not in (runs.GEOMETRY, "Tables 1 and 2"):
            assert own <= {one["key"] for one in runs.INPUTS if one["group"] == group} | {runs.START}
        moved |= own
    assert moved == first.keys() - {"environment.gravity"} | (moved & {"environment.gravity"})


def test_drawn_inputs_are_in_their_bounds_and_the_geometry_meets_the_printed_facts():
    scene, facts = load_scene(runs.CENTRAL), fitting.printed_facts()
    known, gravities = settable(scene.data), set()
    for number in range(12):
        values = runs.draw(scene, number)
        gravities.add(values["environment.gravity"])
        for one in runs.INPUTS:
            middle, value = known[one["key"]], values[one["key"]]
            if "factor" in one:
                assert 1 / one["factor"] <= value / middle <= one["factor"]
            elif "half" in one and one["key"] not in (runs.START, runs.ANGLE):
                assert abs(value - middle) <= one["half"] * (1 + 1e-9)
        line = values["mechanism.guide_x"] + values[runs.OFFSET]
        crank, rod2, rocker, rod4 = (values[f"mechanism.{rod}.length"] for rod in runs.RODS)
        lengths = fitting.Lengths(crank, rod2, rocker, rocker / 2, rod4)
        geometry = fitting.Geometry(*values["mechanism.rocker_pivot"], line)
        _, shown = fitting.shown(geometry, fitting.TOPOLOGIES[0], lengths)
        assert np.all(np.abs(shown - facts["value"]) <= facts["allowance"] * (1 + 1e-9))
        # The press starts at its dead centre, to the nudge of the start.
        assert values[runs.ANGLE] == pytest.approx(shown[0], abs=1.1e-7)
        assert abs(values[runs.START] - values[runs.OFFSET]) <= 1e-6 * (1 + 1e-9)
    assert gravities == {0.0, 9.81}


def test_draws_of_an_input_without_effect_show_the_nominal_run_however_many_they_are(monkeypatch):
    """No journal is in the central case; a number draws the same beside others."""
    ids, central = ("F9-210-d", "F9-210-a"), runs.CENTRAL
    config = CONFIG._replace(samples=400)
    one = runs.Draw(central, ids, config, {}, only="journal radius")
    scene = runs.short_scene(config, central)
    still = run_one(scene.with_values(runs.WITHOUT_CLEARANCE), "reference")
    short = {(central, "reference"): [run_one(scene, "reference")]}
    nominal = runs.Runs(config, short, {(central, "reference"): still}, {})
    peaks = [runs.measure(name, nominal, "reference", {}) for name in ids]
    for number in range(3):
        values = runs.measure_draw(dataclasses.replace(one, number=number), lambda _: None)["shown"]
        assert values[::3] == [peak.value for peak in peaks]
        assert values[1::3] == [peak.time for peak in peaks]
    monkeypatch.setattr(
        runs,
        "measure_all",
        lambda measure, tasks, *_: [{"status": "success"} | measure(task, None) for task in tasks],
    )
    every = dataclasses.replace(one, only="")
    (whole,), both = (runs.run_draws(asked, 0, None) for asked in ([(every, 2)], [(every, 3), (one, 3)]))
    pd.testing.assert_frame_equal(whole.shown, both[0].shown[:2])
    assert list(both[0].shown.index) == [0, 1, 2]
    assert [len(set(each.shown["F9-210-a", "value"])) for each in both] == [3, 1]


def test_a_draw_that_does_not_succeed_leaves_its_reason_and_the_others_stay(monkeypatch):
    one = runs.Draw(runs.CENTRAL, ("F9-210-d",), CONFIG, {}, changes={"contact.poisson": 0.7})
    with pytest.raises(SceneError, match="poisson"):
        runs.measure_draw(one, lambda _: None)
    rows = [
        {"status": "bad input", "message": "contact.poisson is too large"},
        {"status": "success", "message": "", "shown": [1.0, 2.0, 3.0]},
        {"status": "step-too-small", "message": "loosen the tolerance"},
        {"status": "crashed", "message": "its process died"},
    ]
    monkeypatch.setattr(runs, "measure_all", lambda *_: rows)
    (found,) = runs.run_draws([(one, 4)], 0, None)
    assert found.shown.to_dict("index") == {
        1: {("F9-210-d", field): value for field, value in zip(runs.FIELDS, (1.0, 2.0, 3.0), strict=True)}
    }
    assert found.failures == ["contact.poisson is too large", "step-too-small", "its process died"]


def test_shares_of_inputs_are_those_of_the_squares_of_what_each_leaves_open():
    u = ordered(2001)

    def ensemble(half):
        columns = pd.MultiIndex.from_product([["F9-210-d"], runs.FIELDS])
        return runs.Ensemble(pd.DataFrame(np.column_stack([-1.0 + half * u] * 3), columns=columns), [])

    rows = ledger.shares({"a": ensemble(0.3), "b": ensemble(0.4), "c": ensemble(0.0)}, ["F9-210-d"])
    assert list(rows["u_input"]) == pytest.approx([0.285, 0.38, 0.0], abs=1e-12)
    assert list(rows["share"]) == pytest.approx([0.36, 0.64, 0.0])


# ---- what would reach a printed figure


NOT_TRIED = pd.DataFrame({"id": [], "settings": [], "chance": []})


@pytest.fixture
def tried(monkeypatch):
    """Variants of the ledger without any error, by made-up draws: the foundation meets all, a law is refused.

    The first cycle shows a third of the second. The log has the tasks that ran.
    """
    log = []

    def run(asked, *_):
        log.extend(asked)
        return [answer(*each) for each in asked]

    def answer(task, count):
        law = task.changes.get("contact.law", "")
        factor = {"foundation": 1.0, "paper-switching": 5.0}.get(law, 0.2)
        values = [[v for name in task.ids for v in (factor * published(name).value, 0.0, 0.0)]] * count
        columns = pd.MultiIndex.from_product([task.ids, runs.FIELDS])
        if law == "adams-impact":
            return runs.Ensemble(pd.DataFrame([], columns=columns, dtype=float), ["not simulated"])
        return runs.Ensemble(pd.DataFrame(values, columns=columns), [])

    monkeypatch.setattr(ledger, "run_draws", run)
    errors = {("69GPa", "slider_vy"): spike("69GPa", 0.79, 3 * published("F9-69-v").value)}
    made_up = motions([errors])
    frames = drawn(made_up)
    rows = ledger.ledger(made_up, frames, LIMITS)
    return rows, ledger.try_variants(rows, frames, CONFIG, 1, None), log


def test_the_variant_that_reaches_a_figure_is_named_and_a_refused_one_is_left_out(tried):
    rows, found, log = tried
    cause = ledger.causes(rows, found, NOT_TRIED).set_axis(ledger.missed(rows)["ids"])
    # 3 times the printed size in the second cycle: in the first it is that, and the foundation meets all.
    assert cause["reached_by"]["F9-69-v"] == ["first cycle", "foundation"]
    assert cause["reached_by"]["F11-01-v"] == ["foundation"]
    assert not {"S4.2-stroke", "F7-T-d"} & set(cause.index)
    refused = found[found["variant"] == "adams-impact"]
    assert set(refused["why"]) == {"not simulated"}
    assert set(refused["size"]) == {Size.NONE}
    probed = [count for task, count in log if task.changes.get("contact.law") == "adams-impact"]
    assert set(probed) == {ledger.PROBED}
    without = found[~found["variant"].isin(["foundation", "first cycle"])]
    # Paper-switching, no gravity, slider alone, all of aluminium; of other scenes the first two.
    cause = ledger.causes(rows, without, NOT_TRIED).set_axis(ledger.missed(rows)["ids"])
    assert cause.loc["F9-69-v", ["reached_by", "variants"]].tolist() == [[], 4]
    assert cause.loc["F11-01-v", ["reached_by", "variants"]].tolist() == [[], 2]


def test_materials_are_tried_for_their_figures_whether_reproduced_or_not(tried):
    _, found, _ = tried
    alone = found[found["variant"] == "slider alone"]
    assert set(alone["ids"]) == {f"F{figure}-{letter}" for figure in ("9-69", "10-33") for letter in "dva"}


def test_ranges_are_tried_over_many_cycles_and_largest_errors_are_not(tried):
    rows, found, log = tried
    open_ranges = {ids for ids in ledger.missed(rows)["ids"] if ids.startswith("F14")}
    assert open_ranges
    reached = found[found["ids"].isin(open_ranges) & (found["size"] == Size.REPRODUCED)]
    assert set(reached["ids"]) == open_ranges
    assert set(reached["variant"]) == {"foundation"}
    assert {name: task.many for task, _ in log for name in task.ids if name in open_ranges} == dict.fromkeys(
        open_ranges, True
    )
    assert not any(task.many for task, _ in log if not open_ranges & {*task.ids})


def test_settings_of_the_papers_own_that_give_a_figure_are_counted_with_their_chance(tried):
    rows, found, _ = tried
    numerics = pd.DataFrame({"id": ["F9-69-v", "F12-150-d"], "settings": [2, 0], "chance": [0.25, 0.5]})
    cause = ledger.causes(rows, found[:0], numerics)
    cause = cause.set_axis(ledger.missed(rows)["ids"])
    assert cause.loc["F9-69-v", ["settings", "chance"]].tolist() == [2, 0.25]
    assert cause.loc["F9-210-d, F10-28-d, F12-150-d", ["settings", "chance"]].tolist() == [
        0,
        0.5,
    ]  # by any id
    assert np.isnan(cause.loc["F7-R-d", "settings"])
    lines = rows.set_index("ids", drop=False).join(cause)
    tried_for, not_for = (study._missed(lines.loc[ids].to_dict()) for ids in ("F9-69-v", "F7-R-d"))
    assert (tried_for["reached by"], tried_for["numerics"]) == ("none of 0", "2 settings (chance 25\u00a0%)")
    assert not_for["numerics"] == "not tried"


def test_what_the_law_changes_is_told_from_what_the_code_changes():
    """The second model is 1 um off, the law of ADAMS moves either by 3 um; only in the second cycle."""
    off = {(runs.CENTRAL, "slider_y"): 1e-6 * np.ones(2 * DENSE + 1)}
    made_up, moved = motions(), motions([off])
    made_up.short[runs.CENTRAL, "exudyn"] = moved.short[runs.CENTRAL, "exudyn"]
    for model in MODELS:
        frame = made_up.short[runs.CENTRAL, model][0].frame.copy()
        frame["slider_y"] += 3e-6 * (np.arange(2 * DENSE + 1) >= DENSE)
        made_up.adams[model] = Table(frame)
    apart = {name: each["slider_y"] for name, each in made_up.laws_and_codes.items()}
    for name, size in {"code": 1e-6, "law": 3e-6, "law and code": 4e-6}.items():
        assert apart[name] == pytest.approx(np.full(DENSE + 1, size), rel=1e-6)  # 1e-6 rounds to 1e-16 of y


# ---- limits of the permitted error


def test_a_known_limit_is_implied_by_the_reliability_that_it_gives(monkeypatch):
    made_up = motions([{("300rpm-0.2mm", "slider_ay"): 20.0}])
    assessed = made_up.reliabilities["300rpm-0.2mm", "reference"]["acceleration"]
    last = int(np.argmin(np.abs(assessed.angle - 360.0)))
    exact = float(reliability(Limits(upper=55.0), assessed.mean[last], assessed.deviation[last]))
    printed = published("F17-300-a")._replace(value=exact, angle=360.0, rounding=5e-6)
    monkeypatch.setattr(ledger, "printed_reliabilities", lambda: [("F17-300-a", "acceleration", printed)])
    (limit,) = ledger.implied(made_up).to_dict("records")
    at, low, high = (limit[f"reference{end}"] for end in ("", "_least", "_most"))
    assert at == pytest.approx(55.0, rel=1e-9)
    assert low < at < high
    assert limit["unit"] == "m/s^2"


def test_one_limit_is_found_from_reliabilities_that_share_it(monkeypatch):
    sizes = {"90rpm-0.1mm": 3.0, "90rpm-0.5mm": 6.0, runs.CENTRAL: 12.0, "300rpm-0.2mm": 30.0}
    made_up = motions([{(scene, "slider_ay"): size for scene, size in sizes.items()}])
    names = ("F16-01-a", "F16-05-a", "F17-150-a", "F17-300-a")

    def printed(identifier):
        if identifier not in names:
            return published(identifier)
        assessed = made_up.reliabilities[runs.scene_of(identifier), "reference"]["acceleration"]
        value = 0.9986501 - runs.lacking(70.0, assessed)
        return published(identifier)._replace(value=value, rounding=5e-7)

    monkeypatch.setattr(ledger, "published", printed)
    # 0.9986501 for the cap of 0.99865010 costs 2e-9 of what is missing, here 1e-5 or more.
    assert ledger.one_limit(made_up, "acceleration") == pytest.approx(70.0, rel=1e-3)
    by_id = entries(made_up)
    for name in names:
        assert (by_id[name].use, by_id[name].fitted) == (Use.CALIBRATION, "reliability limit")


# ---- statements

AS_THE_PAPER_SAYS = {
    "90rpm-0.1mm": 1, "90rpm-0.5mm": 3, runs.CENTRAL: 1, "poisson-0.33": 1, "69GPa": 2, "300rpm-0.2mm": 3,
    runs.PIN: 10,
}  # fmt: skip
THE_OPPOSITE = {
    "90rpm-0.1mm": 3, "90rpm-0.5mm": 1, runs.CENTRAL: 3, "poisson-0.33": 6, "69GPa": 1, "300rpm-0.2mm": 1,
    runs.PIN: 1,
}  # fmt: skip


def short(sizes, chatter=0.0):
    """Errors of two cycles by their sizes in each scene; chatter: of the acceleration, 40 times a cycle."""
    angle = 2 * np.pi * np.arange(401) / 200
    acceleration = 20.0 * np.sin(angle) ** 5 + chatter * np.cos(40 * angle)
    units = {"slider_y": 1e-5, "slider_vy": 1e-3, "slider_ay": acceleration}
    return {(scene, channel): unit * size for scene, size in sizes.items() for channel, unit in units.items()}


def noise(seed, size):
    return size * np.random.default_rng(seed).standard_normal(CYCLES * SPARSE + 1)


def wave(times=1):
    return np.sin(2 * np.pi * times * np.arange(CYCLES * SPARSE + 1) / SPARSE)


def hits(scene, size):
    """As many contacts a cycle as ten times the size, and as hard."""
    period, count = load_scene(scene).period, 10 * size
    return [((c + (k + 0.5) / count) * period, 10.0 * size) for c in range(CYCLES) for k in range(count)]


def long(sizes, y, x):
    """Errors of many cycles: a series of y and its rate by their sizes in each scene, one of x in all."""
    return {
        scene: {"y": 4e-5 * size * y, "vy": 1e-2 * size * y, "x": x, "events": hits(scene, size)}
        for scene, size in sizes.items()
    }


def adverse(series):
    """Motions that contradict the paper, with a series of the errors of y; the two models differ."""
    errors = long(THE_OPPOSITE, series, 2e-4 * wave())
    made_up = motions([short(THE_OPPOSITE)], errors, angles=(135, -45), chaos=Chaos.REGULAR, shape=np.cos)
    other = motions([short({scene: 2 * size for scene, size in THE_OPPOSITE.items()})], shape=np.cos)
    made_up.short.update({(scene, "exudyn"): other.short[scene, "exudyn"] for scene in runs.SCENES})
    return made_up


def test_every_statement_can_be_supported_and_can_be_contradicted():
    favourable = motions(
        [short(AS_THE_PAPER_SAYS, chatter=5.0)],
        long(AS_THE_PAPER_SAYS, wave() + noise(1, 0.02), 2e-4 * wave(4) + noise(2, 1e-5)),
        angles=(135, 225),
        chaos=Chaos.CHAOTIC,
        shape=lambda angle: np.sin(angle) ** 3,  # close to zero around the lowest point
    )
    # At the tightest settings the models agree, at the usual ones they do not.
    favourable.standard[runs.CENTRAL, "exudyn"] = adverse(wave()).short[runs.CENTRAL, "exudyn"][0]
    held = claims.judge_all(favourable)
    assert held["id"].nunique() == len(claims.CLAIMS) == 37
    open_ones = held["reason"] != ""
    assert set(held.loc[open_ones, "id"]) == {"fosm", "closure-frequency", "adams-difference"}
    assert set(held.loc[open_ones, "verdict"]) == {Verdict.UNDECIDABLE}
    held = held[~open_ones]
    assert set(held["verdict"]) == {SUPPORTED}
    # A map of y cannot both be without scatter and not repeat: each needs a motion of its own.
    restless, still = (claims.judge_all(adverse(series)) for series in (noise(3, 1.0), wave()))
    off, off_when_still = (set(rows.loc[rows["verdict"] == CONTRADICTED, "id"]) for rows in (restless, still))
    assert off == set(held["id"]) - {"y-error-scattered"}
    assert "y-error-scattered" in off_when_still
    # Every criterion decided something.
    assert set(restless.loc[restless["decides"], "what"]) == set(claims.CRITERIA)


@pytest.mark.parametrize(
    ("central", "soft", "later", "verdict"),
    [
        ([1.0e-5, 1.1e-5], [2.0e-5, 2.1e-5], 2.0, SUPPORTED),
        ([2.0e-5], [1.0e-5], 0.5, CONTRADICTED),
        ([1.0e-5, 1.1e-5], [2.0e-5, 2.1e-5], 0.5, UNDECIDED),
        ([1e-5, 3e-5], [2e-5, 1e-5], 2.0, UNDECIDED),
        ([1.0e-5], [1.04e-5], 1.04, UNDECIDED),
    ],
)
def test_a_larger_error_must_be_larger_in_both_comparisons_in_all_starts_and_by_more_than_little(
    central, soft, later, verdict
):
    members = [
        {(runs.CENTRAL, "slider_y"): a, ("69GPa", "slider_y"): b} for a, b in zip(central, soft, strict=True)
    ]
    many = {runs.CENTRAL: {"y": 1e-5 * wave()}, "69GPa": {"y": later * 1e-5 * wave()}}
    claim = {"channel": "slider_y", "more": "69GPa", "less": runs.CENTRAL}
    assert claims.verdict(claims.larger(motions(members, many), "reference", claim)) is verdict


def test_pairs_that_differ_by_little_count_for_neither_side():
    # Of six pairs 3 > 1, 3 > 2, 2 > 1; 2 = 2, 1.04 and 2 as good as 1 and 2, and 1.04 < 2.
    assert claims.net_share(np.array([2.0, 3.0, 1.04]), np.array([1.0, 2.0])) == pytest.approx((3 - 1) / 6)


@pytest.mark.parametrize("times", [1, 3])
def test_swings_count_in_a_cycle_only_if_they_are_wide_however_many_contacts_there_are(times):
    clearance = load_scene(runs.CENTRAL).data["clearance"]["slider"]
    # Each goes 0.9 of the clearance there and back, the ripple on it a tenth.
    x = 0.45 * clearance * wave(times) + 0.05 * clearance * wave(10)
    made_up = motions(long={runs.CENTRAL: {"x": x, "events": hits(runs.CENTRAL, 9)}})
    assert claims.oscillating(made_up, "reference", {"scene": runs.CENTRAL})[0] == {"swings": times}


@pytest.mark.parametrize(
    ("angles", "verdict"),
    [
        ((135, 225), SUPPORTED),
        ((-45, 45), SUPPORTED),  # the same in the frame of the pin
        ((135, -45), CONTRADICTED),
        ((135, 135, 135, 225, 225, 45, 45, 45), UNDECIDED),
    ],
)
def test_the_quadrants_in_which_the_pin_pushes(angles, verdict):
    assert claims.verdict(claims.pin_zones(motions(angles=angles), "reference", {})) is verdict


# ---- by the real models: what identifies the press must keep holding


@pytest.mark.slow
@pytest.mark.parametrize("model", MODELS)
def test_key_figures_of_the_paper_by_the_models(model):
    # The extremes of the first cycles and those at the top dead centres are among those of twenty.
    config, central = CONFIG._replace(samples=1000, long_samples=1000, cycles=20), runs.CENTRAL
    ideal = run_one(runs.ideal_scene(config, central).with_values({"solver.exudyn.step": 4e-5}), model)
    many = run_one(runs.long_scene(config, central), model)
    made = runs.Runs(config, {}, {(central, model): ideal}, {(central, model): many})

    def off(row):
        return abs(runs.measure(row, made, model, {}).value - published(row).value)

    assert off("S4.2-stroke") < published("S4.2-stroke").rounding
    # Round values of the geometry bring it to 111.355 degrees, where 111.36 is printed.
    assert off("S2.2-tdc") <= published("S2.2-tdc").rounding * 1.05
    # The clearance moves both ends by a few mm/s, at random instants: 0.5 % of 2 m/s.
    assert all(off(row) <= 0.005 * abs(published(row).value) for row in ("F14c-vy", "F14c-vy2"))
    # Twice the clearance, and not centred. Corners go some micrometres into the wall; the paper's do not.
    assert all(off(row) <= 8e-6 for row in ("F14a-x", "F14a-x2"))
    # The highest error is geometry: at the wall at the top dead centre. The lowest depends on the bounces.
    assert off("F14e-y2") <= 0.05 * abs(published("F14e-y2").value)
    assert 0.5 < runs.measure("F14e-y", made, model, {}).value / published("F14e-y").value < 1.2

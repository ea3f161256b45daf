"""Whole tables of runs: what cannot be compared, what is found, and what is carried along."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from comparison.metrics.contacts import SITUATIONS, WINDOW
from comparison.scene import load_scene
from comparison.tables.channels import channels
from comparison.tables.table import Table, TableError
from comparison.verdict.compare import Runs, compare, recorded_scene
from comparison.words.record import as_mapping
from comparison.words.verdicts import scene_reason

LABELS = ("reference", "exudyn")
PARTS = (
    1.0,
    0.25,
    4.0,
    4.0,
    4.0,
)  # of the error in the runs of a second-order method, in the order of `Runs`
OF_EVENT = ("normal_speed", "impulse", "peak_force", "largest_depth")


def runs(make_table, error: float, stretch: float = 0.0, **options) -> Runs:
    return Runs(*(make_table(part * error, stretch, **options) for part in PARTS))


def test_two_models_whose_errors_explain_their_difference_agree(scene, make_table):
    result = compare(runs(make_table, 1e-6), runs(make_table, -2e-6), scene=scene, labels=LABELS)
    assert {c.verdict for c in result.channels.values()} == {"agree"}
    assert (result.verdict, result.name, result.period) == ("agree", scene.name, scene.period)
    kinds = ("", " finer", " perturbed", " other perturbed", " coarser")
    assert list(result.provenance) == [f"{label}{kind}" for label in LABELS for kind in kinds]
    # The largest error of x is 2e-6 + 4e-6 of the clearance where both are largest.
    assert result.channels["slider_x"].max_scaled < 6e-6
    # A large error is indeterminate and not agreement.
    assert compare(runs(make_table, 0.1), runs(make_table, 1e-6), scene=scene).verdict == "indeterminate"


def test_a_difference_of_models_outside_the_numerics_is_found_in_every_channel_it_touches(scene, make_table):
    result = compare(runs(make_table, 1e-6), runs(make_table, 2e-6, stretch=1e-3), scene=scene, labels=LABELS)
    assert {c.verdict for c in result.channels.values()} == {result.verdict} == {"differ"}
    assert scene_reason(result).startswith("21 of 21 channels differ, most of all ")


@pytest.mark.parametrize("broken", ["base", "finer", "perturbed", "other_perturbed"])
def test_a_number_that_is_not_finite_in_any_run_is_no_pass(scene, make_table, broken):
    a = runs(make_table, 1e-6)
    getattr(a, broken).frame.loc[40, "corner_ur_normal"] = np.nan
    kind = "" if broken == "base" else f" {broken.replace('_', ' ')}"
    with pytest.raises(TableError, match=f"^exudyn{kind}: corner_ur_normal is nan in data row 41"):
        compare(runs(make_table, 1e-6), a, scene=scene, labels=LABELS)


def test_what_is_missing_unexpected_or_truncated_is_refused_with_and_without_a_scene(scene, make_table):
    whole = make_table()
    lacking, short = Table(whole.frame.drop(columns="slider_omega")), Table(whole.frame.iloc[:-2])
    for a, b, of, message in (
        (whole, lacking, scene, "^b: channel slider_omega is missing"),
        (lacking, whole, None, "^a: channel slider_omega is missing"),
        (lacking, lacking, scene, "slider_omega is missing"),  # if the scene asks for it
        (whole, make_table(slider_X=1.0), None, "b: channel slider_X is unexpected"),
        (whole, short, scene, r"^b: truncated: it spans 0 to 0\.796 s and must span 0 to 0\.8 s"),
        (whole, short, None, "one of them is truncated"),
    ):
        with pytest.raises(TableError, match=message):
            compare(Runs(a), Runs(b), scene=of, tolerance=1.0)
    assert "slider_omega" not in compare(Runs(lacking), Runs(lacking), tolerance=1.0).channels


def test_runs_of_one_model_must_share_their_times_and_uncertainty_is_not_interpolated(scene, make_table):
    a = runs(make_table, 1e-6)
    denser = scene.with_values({"output.samples_per_cycle": 1000})
    with pytest.raises(TableError, match="must have the same times"):
        compare(a, runs(make_table, 1e-6, of=denser), scene=scene)
    a.finer.frame["time"] *= 1 + 1e-12
    with pytest.raises(TableError, match="reference finer: its times differ from those of reference"):
        compare(a, runs(make_table, 1e-6), scene=scene, labels=LABELS)
    # A table alone is, and the reader is informed.
    result = compare(Runs(make_table()), Runs(make_table(of=denser)), scene=scene, tolerance=1e-2)
    assert (result.verdict, result.time.size) == ("agree", 401)
    assert "b was interpolated" in result.warnings[0]
    # The cubic of x and vx is off by (w h)^4 / 384 of the clearance, w h = 2 pi / 1000.
    assert result.channels["slider_x"].max_scaled < 1e-10


def test_the_scene_is_found_beside_two_tables_unless_they_are_of_different_ones(scene, make_table):
    def recorded(**values):
        return Table(make_table().frame, None, {}, {"scene": scene.with_values(values).data})

    strict = recorded(**{"solver.reference.tolerance": 1e-11, "scene.title": "other"})
    found, warnings = recorded_scene(recorded(), strict)
    assert warnings == ()
    for section in found.data.keys() - {"solver", "scene"}:  # settings and title are of no account
        assert found.data[section] == scene.data[section]
    none, (warning,) = recorded_scene(recorded(), recorded(**{"drive.speed_rpm": 151.0}))
    assert (none, "drive" in warning) == (None, True)
    assert recorded_scene(recorded(), make_table()) == (None, ())


def test_a_million_rows_of_nine_channels_are_not_looped_over(lines_run):
    names = list(channels())[:9]
    rng = np.random.default_rng(0)
    t = np.arange(1_000_000) * 1e-5
    frame = pd.DataFrame({"time": t, **{name: np.sin(9 * t + k) for k, name in enumerate(names)}})
    output = {"output.groups": ["accelerations"], "output.samples_per_cycle": 40000}
    scene = load_scene("150rpm-0.2mm", output | {"drive.cycles": 25.0 - 1 / 40000})

    def noisy():
        return Table(frame + 1e-9 * rng.normal(size=frame.shape) * (frame.columns != "time"))

    a, b = (Runs(*(noisy() for _ in range(3))) for _ in range(2))
    found = []
    lines = lines_run(lambda: found.append(compare(a, b, scene=scene)))
    assert len(found[0].channels) == 9
    # 65,000; one loop over the samples of one channel is a million.
    assert lines < 200_000


FAULTS = ("nan", "inf", "truncated", "missing", "duplicated time", "zero force", "unexcited", "unexpected")


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])
@given(
    fault=st.sampled_from(FAULTS),
    channel=st.integers(0, 20),
    row=st.integers(1, 399),
    first=st.booleans(),
    known=st.booleans(),
)
def test_a_fault_in_a_table_is_never_agreement(scene, make_table, fault, channel, row, first, known):
    whole, bad = make_table(), make_table()
    frame = bad.frame
    name = bad.channels[channel]
    if fault in {"nan", "inf"}:
        frame.loc[row, name] = float(fault)
    elif fault == "truncated":
        frame = frame.iloc[: row - 1]
    elif fault == "missing":
        frame = frame.drop(columns=name)
    elif fault == "duplicated time":
        frame.loc[row, "time"] = frame.loc[row - 1, "time"]
    elif fault == "zero force":
        frame[f"corner_{('ll', 'lr', 'ul', 'ur')[channel % 4]}_normal"] = 0.0
    elif fault == "unexcited":
        frame[name] = frame[name].mean()
    else:
        frame[f"{name}_2"] = 0.0
    pair = (Runs(Table(frame)), Runs(whole))
    try:
        result = compare(*(pair if first else pair[::-1]), scene=scene if known else None, tolerance=0.01)
    except TableError as error:
        assert "\n" not in str(error)  # noqa: PT017
        assert fault not in {"zero force", "unexcited"}
    else:
        assert result.verdict == "differ"
        assert fault in {"zero force", "unexcited"}


# Contacts


def contacts(*rows: tuple[str, float, float]) -> pd.DataFrame:
    return pd.DataFrame(rows, columns=["corner", "start", "end"]).assign(**dict.fromkeys(OF_EVENT, 1.0))


def moved(events: pd.DataFrame, by: float) -> pd.DataFrame:
    return events.assign(start=events["start"] + by, end=events["end"] + by)


HITS = contacts(*((c, 0.1 * n + 0.01 * k, 0.1 * n + 0.01 * k + 1e-3)
                  for k, c in enumerate(("ll", "lr", "ul", "ur")) for n in range(1, 6)))  # fmt: skip


def test_the_shares_of_contact_situations_of_both_results_where_they_mean_something(make_table, scene):
    table = make_table().frame
    a, b = (Runs(Table(table, events)) for events in (contacts(("ll", 0.0, 0.2)), contacts()))
    found = as_mapping(compare(a, b, scene=scene, labels=LABELS))["situations"]
    assert found["reference"]["one_corner"] == pytest.approx(0.25, abs=1e-15)  # of 0.8 s
    assert (found["exudyn"]["free"], set(found["exudyn"])) == (1.0, set(SITUATIONS))
    assert compare(b, Runs(make_table()), scene=scene).situations[1] is None  # without events
    ideal = load_scene("ideal", {"output.samples_per_cycle": 200})
    still = Runs(Table(make_table(of=ideal).frame, contacts()))
    assert compare(still, still, scene=ideal).situations == (None, None)
    # Of the crank pin, where it has clearance; of a slider without there are none.
    pin = load_scene("crank-pin", {"output.groups": []})
    frame = make_table(of=pin).frame
    touching = Runs(Table(frame[frame.columns[:7]], contacts(("pin", 0.0, frame["time"].iloc[-1] / 4))))
    names = list(frame.columns[1:7])
    result = compare(touching, touching, scene=pin, labels=LABELS, only=names)
    assert result.situations == (None, None)
    assert as_mapping(result)["crank_pin_contact"]["exudyn"] == pytest.approx(0.25, abs=1e-15)
    assert compare(a, b, scene=scene).pin_contact == (None, None)


@pytest.mark.parametrize(("late", "recall"), [(0.9, 1.0), (1.1, 0.0)])
def test_impacts_are_matched_within_a_window_and_told_where_both_have_events(scene, make_table, late, recall):
    a, b = (
        Table(make_table().frame, HITS),
        Table(make_table().frame, moved(HITS, late * WINDOW * scene.period)),
    )
    impacts = as_mapping(compare(Runs(a), Runs(b), scene=scene, tolerance=1e-3))["impacts"]
    # Without uncertainties nothing tells which part is predictable.
    assert list(impacts) == ["all"]
    assert (impacts["all"]["matched"], impacts["all"]["count_a"]) == (20 * recall, 20)
    assert (impacts["all"]["recall"], "pairs" in impacts["all"]) == (recall, False)
    for pair, of in (((a, make_table()), scene), ((make_table(), b), scene), ((a, a), None)):  # no period
        assert compare(*map(Runs, pair), scene=of).impacts is None


def test_a_contact_is_predictable_where_the_gap_of_its_corner_is(scene, make_table):
    """Gaps decide for their corners; where there are none, and for the crank pin, x does."""
    tables = [Table(make_table(part).frame) for part in (1e-6, 2.5e-7, 4e-6, 4e-6)]
    # One finer run is far off in the gap at lower right, in the second half.
    tables[1].frame.loc[tables[1].time > 0.4, "corner_lr_gap"] += 1e-3
    start = [0.6, 0.1, 0.6, 0.6]
    events = HITS.iloc[:4].assign(corner=["ll", "lr", "lr", "pin"], start=start, end=0.7)
    run = Runs(Table(tables[0].frame, events), *tables[1:])
    result = compare(run, run, scene=scene)
    covers = {name: result.channels[name].coverage for name in ("slider_x", "corner_ll_gap", "corner_lr_gap")}
    assert covers == pytest.approx({"slider_x": 1.0, "corner_ll_gap": 1.0, "corner_lr_gap": 0.5}, abs=0.02)
    assert sorted(result.impacts["predictable"].pairs[:, 0]) == [0, 1, 3]
    motion = ["time", *tables[0].channels[:6]]
    bare = [Table(table.frame[motion].copy()) for table in tables]
    bare[1].frame["slider_x"] += 1e-3
    run = Runs(Table(bare[0].frame, events), *bare[1:])
    without = scene.with_values({"output.groups": []})
    assert compare(run, run, scene=without).impacts["predictable"].count_a == 0

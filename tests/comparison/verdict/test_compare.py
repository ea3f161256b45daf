"""Whole tables: what cannot be compared, what is found, and what is carried along."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from comparison.scene import load_scene
from comparison.tables.channels import channels
from comparison.tables.table import Table, TableError
from comparison.verdict.compare import Runs, compare, recorded_scene
from comparison.words.verdicts import scene_reason

LABELS = ("reference", "exudyn")


def runs(make_table, error: float, stretch: float = 0.0, **options) -> Runs:
    """The five runs, in the order of `Runs`, of a second-order method with a known error."""
    return Runs(*(make_table(part * error, stretch, **options) for part in (1.0, 0.25, 4.0, 4.0, 4.0)))


def test_two_models_whose_errors_explain_their_difference_agree(scene, make_table):
    result = compare(runs(make_table, 1e-6), runs(make_table, -2e-6), scene=scene, labels=LABELS)
    assert {c.verdict for c in result.channels.values()} == {"agree"}
    assert (result.verdict, result.name, result.period) == ("agree", scene.name, scene.period)
    assert list(result.provenance) == [
        "reference", "reference finer",
        "reference perturbed", "reference other perturbed", "reference coarser",
        "exudyn", "exudyn finer", "exudyn perturbed", "exudyn other perturbed", "exudyn coarser",
    ]  # fmt: skip
    assert np.all(np.diff(result.time) > 0)
    # The largest error of x is 2e-6 + 4e-6 of the clearance where both are largest.
    assert result.channels["slider_x"].max_scaled < 6e-6


def test_a_difference_of_models_outside_the_numerics_is_found_in_every_channel_it_touches(scene, make_table):
    result = compare(runs(make_table, 1e-6), runs(make_table, 2e-6, stretch=1e-3), scene=scene, labels=LABELS)
    assert result.verdict == "differ"
    assert {name for name, c in result.channels.items() if c.verdict == "differ"} == set(result.channels)
    assert scene_reason(result).startswith("21 of 21 channels differ, most of all ")


def test_a_large_error_is_indeterminate_and_not_agreement(scene, make_table):
    result = compare(runs(make_table, 0.1), runs(make_table, 1e-6), scene=scene)
    assert result.verdict == "indeterminate"


def test_the_ideal_scene_needs_no_perturbed_run_and_its_quiet_channels_are_unexcited(make_table):
    scene = load_scene("ideal", {"output.samples_per_cycle": 100})
    quiet = ("slider_vx", "slider_angle", "slider_omega", "slider_ax", "slider_alpha")
    flat = dict.fromkeys(quiet, 0.0) | {"slider_x": -0.55}
    a, b = (runs(make_table, error, of=scene, **flat) for error in (1e-6, 2e-6))
    result = compare(Runs(a.base, a.finer), Runs(b.base, b.finer), scene=scene)
    assert result.verdict == "agree"
    assert {name for name, c in result.channels.items() if c.verdict == "unexcited"} == set(flat)


@pytest.mark.parametrize("broken", ["base", "finer", "perturbed", "other_perturbed"])
def test_a_number_that_is_not_finite_in_any_run_is_no_pass(scene, make_table, broken):
    a = runs(make_table, 1e-6)
    getattr(a, broken).frame.loc[40, "corner_ur_normal"] = np.nan
    kind = "" if broken == "base" else f" {broken.replace('_', ' ')}"
    with pytest.raises(TableError, match=f"^exudyn{kind}: corner_ur_normal is nan in data row 41"):
        compare(runs(make_table, 1e-6), a, scene=scene, labels=LABELS)


def test_a_channel_that_one_side_lacks_is_not_dropped(scene, make_table):
    whole = make_table()
    lacking = Table(whole.frame.drop(columns="slider_omega"))
    for a, b, who in ((whole, lacking, "b"), (lacking, whole, "a")):
        for known in (scene, None):
            with pytest.raises(TableError, match=f"^{who}: channel slider_omega is missing"):
                compare(Runs(a), Runs(b), scene=known, tolerance=1.0)
    # Nor one that both lack, if the scene asks for it.
    with pytest.raises(TableError, match="slider_omega is missing"):
        compare(Runs(lacking), Runs(lacking), scene=scene, tolerance=1.0)
    assert "slider_omega" not in compare(Runs(lacking), Runs(lacking), tolerance=1.0).channels


def test_an_unknown_column_is_refused(make_table):
    with pytest.raises(TableError, match="b: channel slider_X is unexpected"):
        compare(Runs(make_table()), Runs(make_table(slider_X=1.0)))


def test_a_truncated_table_is_refused_with_and_without_a_scene(scene, make_table):
    whole = make_table()
    short = Table(whole.frame.iloc[:-2])
    with pytest.raises(TableError, match=r"^b: truncated: it spans 0 to 0\.796 s and must span 0 to 0\.8 s"):
        compare(Runs(whole), Runs(short), scene=scene, tolerance=1.0)
    with pytest.raises(TableError, match="one of them is truncated"):
        compare(Runs(whole), Runs(short), tolerance=1.0)


def test_runs_of_one_model_must_share_their_times(scene, make_table):
    a = runs(make_table, 1e-6)
    a.finer.frame["time"] *= 1 + 1e-12
    with pytest.raises(TableError, match="reference finer: its times differ from those of reference"):
        compare(a, runs(make_table, 1e-6), scene=scene, labels=LABELS)


def test_a_table_against_itself(make_table):
    table = make_table()
    assert compare(Runs(table), Runs(table)).verdict == "indeterminate"
    result = compare(Runs(table), Runs(table), tolerance=1e-15)
    assert result.verdict == "agree"
    assert all(channel.max_difference == 0 for channel in result.channels.values())


def test_another_grid_is_interpolated_and_the_reader_is_informed(scene, make_table):
    denser = scene.with_values({"output.samples_per_cycle": 1000})
    result = compare(Runs(make_table()), Runs(make_table(of=denser)), scene=scene, tolerance=1e-2)
    assert result.time.size == 401
    assert "b was interpolated" in result.warnings[0]
    # The cubic of x and vx is off by (w h)^4 / 384 of the clearance, w h = 2 pi / 1000.
    assert result.channels["slider_x"].max_scaled < 1e-10
    assert result.verdict == "agree"


def test_uncertainty_is_not_carried_over_to_another_grid(scene, make_table):
    denser = scene.with_values({"output.samples_per_cycle": 1000})
    with pytest.raises(TableError, match="must have the same times"):
        compare(runs(make_table, 1e-6), runs(make_table, 1e-6, of=denser), scene=scene)


def test_the_scene_is_found_beside_two_tables_unless_they_are_of_different_ones(scene, make_table):
    def recorded(**values):
        return Table(make_table().frame, None, {}, {"scene": scene.with_values(values).data})

    strict = recorded(**{"solver.reference.tolerance": 1e-11, "scene.title": "other"})
    found, warnings = recorded_scene(recorded(), strict)
    assert warnings == ()
    for section in found.data.keys() - {"solver", "scene"}:  # settings and title are of no account
        assert found.data[section] == scene.data[section]
    none, (warning,) = recorded_scene(recorded(), recorded(**{"drive.speed_rpm": 151.0}))
    assert none is None
    assert "drive" in warning
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


@pytest.mark.parametrize(("tolerance", "verdict"), [(1e-10, "differ"), (1e-3, "agree")])
@pytest.mark.parametrize("name", ["slider_x", "slider_vy", "corner_ul_normal"])
def test_a_column_a_thousand_times_larger_in_both_tables_is_judged_the_same(
    make_table, name, tolerance, verdict
):
    def verdicts(factor):
        tables = [make_table(error) for error in (0.0, 1e-6)]
        for table in tables:
            table.frame[name] *= factor
        result = compare(*map(Runs, tables), tolerance=tolerance)
        return {key: (channel.verdict, channel.explained) for key, channel in result.channels.items()}

    plain = verdicts(1.0)
    assert plain[name][0] == verdict
    assert verdicts(1e3) == plain


# A time shift

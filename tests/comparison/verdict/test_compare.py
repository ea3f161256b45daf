"""Whole tables of runs: what cannot be compared, what is found, and what is carried along."""

import numpy as np
import pytest
from by_keywords import compare
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from comparison.accuracy.uncertainty import Runs
from comparison.tables.table import Table, TableError
from comparison.verdict.compare import recorded_scene
from comparison.words.verdicts import scene_reason

LABELS = ("reference", "exudyn")
KINDS = ("", " finer", " perturbed", " other perturbed", " coarser")


def test_errors_explain_a_difference_or_do_not_or_are_too_large_to_tell(scene, make_runs):
    a = make_runs(1e-6)
    for b, verdict in ((make_runs(-2e-6), "agree"), (make_runs(2e-6, stretch=1e-3), "differ")):
        result = compare(a, b, scene=scene, labels=LABELS)
        assert {c.verdict for c in result.channels.values()} == {result.verdict} == {verdict}
        assert (result.name, result.period) == (scene.name, scene.period)
        assert list(result.provenance) == [f"{label}{kind}" for label in LABELS for kind in KINDS]
        # The largest difference of x is the sum of both errors, of the clearance, where both are largest.
        assert (result.channels["slider_x"].max_scaled < 6e-6) == (verdict == "agree")
    assert scene_reason(result).startswith("21 of 21 channels differ, most of all ")
    assert compare(make_runs(0.1), a, scene=scene).verdict == "indeterminate"


def test_what_is_missing_unexpected_truncated_or_no_number_is_refused(scene, make_table, make_runs):
    whole, broken = make_table(), make_runs(1e-6)
    lacking, short = Table(whole.frame.drop(columns="slider_omega")), Table(whole.frame.iloc[:-2])
    for a, b, known, message in (
        (whole, lacking, scene, "^b: channel slider_omega is missing"),
        (lacking, whole, None, "^a: channel slider_omega is missing"),
        (lacking, lacking, scene, "slider_omega is missing"),  # if the scene asks for it
        (whole, make_table(slider_X=1.0), None, "b: channel slider_X is unexpected"),
        (whole, short, scene, r"^b: truncated: it spans 0 to 0\.796 s and must span 0 to 0\.8 s"),
    ):
        with pytest.raises(TableError, match=message):
            compare(Runs(a), Runs(b), scene=known, tolerance=1.0)
    assert "slider_omega" not in compare(Runs(lacking), Runs(lacking), tolerance=1.0).channels
    # Also in a run that only its uncertainty needs
    broken.other_perturbed.frame.loc[40, "corner_ur_normal"] = np.nan
    with pytest.raises(TableError, match=r"^b other perturbed: corner_ur_normal is nan in data row 41"):
        compare(make_runs(1e-6), broken, scene=scene)


def test_runs_of_one_model_must_share_their_times_and_uncertainty_is_not_interpolated(
    scene, make_table, make_runs
):
    a, denser = make_runs(1e-6), scene.with_values({"output.samples_per_cycle": 1000})
    with pytest.raises(TableError, match="must have the same times"):
        compare(a, make_runs(1e-6, scene=denser), scene=scene)
    a.finer.frame["time"] *= 1 + 1e-12
    with pytest.raises(TableError, match="reference finer: its times differ from those of reference"):
        compare(a, make_runs(1e-6), scene=scene, labels=LABELS)
    # A table alone is, and the reader is informed.
    result = compare(Runs(make_table()), Runs(make_table(scene=denser)), scene=scene, tolerance=1e-2)
    assert (result.verdict, result.time.size) == ("agree", 401)
    assert "b was interpolated" in result.warnings[0]
    # The cubic of x and vx is off by (w h)^4 / 384 of the clearance, w h = 2 pi / 1000.
    assert result.channels["slider_x"].max_scaled < 1e-10


def test_the_scene_is_found_beside_two_tables_unless_they_are_of_different_ones(scene, make_table):
    def recorded(**values):
        return Table(make_table().frame, None, {}, {"scene": scene.with_values(values).data})

    strict = recorded(**{"solver.reference.tolerance": 1e-11, "scene.title": "other"})
    result, warnings = recorded_scene(recorded(), strict)
    assert warnings == ()
    for section in result.data.keys() - {"solver", "scene"}:  # settings and title are of no account
        assert result.data[section] == scene.data[section]
    none, (warning,) = recorded_scene(recorded(), recorded(**{"drive.speed_rpm": 151.0}))
    assert (none, "drive" in warning) == (None, True)
    assert recorded_scene(recorded(), make_table()) == (None, ())


FAULTS = {
    "nan": lambda frame, name, row: frame.assign(**{name: frame[name].where(frame.index != row)}),
    "inf": lambda frame, name, row: frame.assign(**{name: frame[name].where(frame.index != row, np.inf)}),
    "truncated": lambda frame, _, row: frame.iloc[: row - 1],
    "missing": lambda frame, name, _: frame.drop(columns=name),
    "unexpected": lambda frame, name, _: frame.assign(**{f"{name}_2": 0.0}),
    "duplicated time": lambda frame, _, row: frame.assign(
        time=frame["time"].where(frame.index != row, frame["time"][row - 1])
    ),
    "zero force": lambda frame, _, row: frame.assign(
        **{f"corner_{('ll', 'lr', 'ul', 'ur')[row % 4]}_normal": 0.0}
    ),
    "unexcited": lambda frame, name, _: frame.assign(**{name: frame[name].mean()}),
}


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])
@given(
    fault=st.sampled_from(list(FAULTS)),
    channel=st.integers(0, 20),
    row=st.integers(1, 399),
    first=st.booleans(),
    known=st.booleans(),
)
def test_a_fault_in_a_table_is_never_agreement(scene, make_table, fault, channel, row, first, known):
    whole = make_table()
    bad = Table(FAULTS[fault](whole.frame, whole.channels[channel], row))
    pair = [Runs(bad), Runs(whole)][:: 1 if first else -1]
    differs = fault in {"zero force", "unexcited"}
    try:
        said = compare(*pair, scene=scene if known else None, tolerance=0.01).verdict
    except TableError as error:
        said = str(error)
    assert (said == "differ") == differs
    assert said not in ("agree", "indeterminate")
    assert "\n" not in said

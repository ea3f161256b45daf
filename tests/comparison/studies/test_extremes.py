"""The study extremes: its cells, the class of a comparison, and a handful of cells run for real."""

from collections import Counter

import pytest

from comparison.studies.extremes import study
from comparison.studies.extremes.runs import CUT_OFF, PairRun, run_pairs
from comparison.studies.extremes.study import AXES, HYPERCUBE, LAWS, PAIRS, Class, cells, classify

pytestmark = pytest.mark.usefixtures("empty_cache")

EVERY_CELL = cells(study.STUDY.full.axes, study.STUDY.full.points)


def test_each_cell_is_there_once_and_has_its_law():
    assert max(Counter((cell.axis, cell.label, cell.law) for cell in EVERY_CELL).values()) == 1
    assert {cell.axis for cell in EVERY_CELL} == {*AXES, HYPERCUBE}
    assert {cell.law for cell in EVERY_CELL} == {*LAWS}
    for cell in EVERY_CELL:
        if cell.changes.get("contact.restitution", 1.0) >= 0.05:  # some damping models have no smaller one
            assert cell.scene.data["contact"]["law"] == cell.law
            model = cell.changes.get("contact.damping_model", "lankarani-nikravesh")
            assert cell.scene.data["contact"]["damping_model"] == model


@pytest.mark.parametrize(
    ("statuses", "kind"),
    [
        (("success", "success"), Class.DIFFER),
        (("success", "newton-failed"), Class.EXUDYN_STOPS),
        (("work-limit", CUT_OFF), Class.REFERENCE_STOPS),  # the model's own limit, and the study's
        (("chatter", "step-too-small"), Class.BOTH_STOP),
        (("bad input", CUT_OFF), Class.REFUSED),
        (("unusable", "bad input"), Class.NONSENSE),
        (("crashed", "unusable"), Class.CRASHED),
    ],
)
def test_the_class_of_a_comparison_is_its_worst_run_or_its_verdict(statuses, kind):
    sides = dict(zip(("reference", "exudyn"), ({"status": status} for status in statuses), strict=True))
    assert classify({**sides, "verdict": "differ"}) is kind


def test_some_cells_for_real():
    """An ordinary cell, one that cannot be assembled, and one without time to run."""
    places = [("base", "as shipped"), ("edge of assembly", "rod 2 0.5 m")]
    scenes = {(cell.axis, cell.label): cell.scene for cell in reversed(EVERY_CELL)}
    base, edge = (scenes[place].with_values(PAIRS["smallest"]) for place in places)
    rows = run_pairs([PairRun(base), PairRun(edge), PairRun(base, 1e-6)], 1, None)
    assert [classify(row) for row in rows] == [Class.AGREE, Class.REFUSED, Class.NOT_TESTED]
    assert rows[0]["coverage"] > 0.9
    assert 0.0 < rows[0]["apart_m"] < 1e-8
    assert rows[0]["reference"]["contacts"] == rows[0]["exudyn"]["contacts"] > 50
    assert "rod 4 is too short" in rows[1]["reference"]["message"]

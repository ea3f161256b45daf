"""What cannot be assembled is refused."""

import pytest

from exudyn_model.linkage import assemble
from exudyn_model.parameters import read_scene

CANNOT = [
    # Closes at the start, but not where the crank points away from the pivot; rod 4 always reaches
    ({"mechanism.crank.length": 0.25, "mechanism.rod4.length": 2.0}, "crank, rod 2 and rocker"),
    ({"mechanism.rod2.length": 0.05}, "crank, rod 2 and rocker"),  # closes nowhere
    ({"mechanism.rod4.length": 0.04}, "rod 4 and slider"),  # reaches the guide only in part of the cycle
    ({"mechanism.guide_x": -2.0}, "rod 4 and slider"),
]


@pytest.mark.parametrize(("changes", "parts"), CANNOT)
def test_what_cannot_be_assembled_is_refused_in_one_line(make_scene, changes, parts):
    with pytest.raises(ValueError, match=f"{parts} cannot be assembled at a crank angle of") as caught:
        assemble(read_scene(make_scene(changes)))
    assert "\n" not in str(caught.value)

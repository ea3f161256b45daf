"""What is called in each step: the machine code by itself, and the state where Exudyn keeps it."""

import numpy as np
import pytest

from exudyn_model.assembly import assemble
from exudyn_model.compiled import direct
from exudyn_model.contact.corners import force_user_function, slider_force
from exudyn_model.contact.gaps import contact_law
from exudyn_model.contact.states import contact_states
from exudyn_model.five_bodies.constraints import Constraints
from exudyn_model.five_bodies.mechanism import build
from exudyn_model.five_bodies.recording import Recorder
from exudyn_model.five_bodies.step_choice import StepChoice
from exudyn_model.reading import read_scene


@pytest.fixture
def parameters(make_scene):
    return read_scene(make_scene({}))


def test_the_machine_code_gives_what_the_kernel_gives_to_the_last_digit(parameters):
    law = contact_law(parameters.contact, parameters.mechanism.slider, 1e-6)
    corners = contact_states()
    corners["impact_speed"] = 0.02
    # 1 um behind the right wall, rotated so that one corner of it is deeper, sliding
    state = (2.01e-4, 1e-5, 0.01, -0.3, 0.2)
    forces = slider_force(*state, law, corners)
    assert min(abs(part) for part in forces) > 0
    assert direct(slider_force, *state, law, corners)(*state, law, corners) == forces
    x, angle, *rates = state
    assert force_user_function(law, corners)(None, 0.0, 0, [x, 0.1, angle], rates) == forces


def test_a_recorder_reads_its_vectors_anew_and_notices_if_others_take_their_place(parameters):
    state = assemble(parameters)
    model = build(parameters, state, 1e-6)
    choice = StepChoice(model.constants, model.contacts, 1e-6, 2, 1)
    recorder = Recorder(model, choice, 2, 0.4, np.zeros(0), Constraints(parameters))
    q, v, multipliers = state.positions.ravel(), state.velocities.ravel(), np.zeros(13)
    q[12] -= parameters.mechanism.guide_x
    recorder.follow(q, v, multipliers)
    heights = []
    for number in range(5):
        assert choice.time == number * 1e-6
        assert recorder.accept() == (number % 2 == 0)
        choice.choose()
        heights.append(q[13])
        q[13] += 1e-3
    np.testing.assert_array_equal(recorder.columns(("slider_y",))["slider_y"], heights[::2])
    recorder.follow(q, v, multipliers)
    with pytest.raises(AssertionError, match="moved"):
        recorder.follow(q.copy(), v, multipliers)

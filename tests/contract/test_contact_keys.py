"""Keys of a contact that its law uses: both models ignore exactly those that give a warning."""

from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from reference_states import IDEAL, PIN

import exudyn_model
import reference_model
from comparison.scene import load_scene
from comparison.scene.schema import Contact

PAGE = Path(__file__).parents[2] / "docs" / "model.md"
LAWS = get_args(Contact.model_fields["law"].annotation)
OTHER = {
    "youngs_modulus": 100e9,
    "poisson": 0.2,
    "restitution": 0.7,
    "damping_model": "gonthier",
    "exponent": 1.4,
    "corner_radius": 2e-3,
    "impact_speed_floor": 1.0,  # above every speed here: under adams-impact the table of contacts holds it
    "stiffness": 3e9,
    "damping": 400.0,
    "damping_depth": 5e-6,
}
# Thrown into its guide, flat against the wall at first: single corners and both of a side touch.
THROW = {
    "drive.cycles": 0.02,
    "initial.slider_offset": 1.9e-4,
    "initial.slider_vx": 0.05,
    "initial.slider_omega": 0.01,
    "solver.exudyn.formulation": "tree",
}
JOINTS = {"slider": {"drive.cycles": 0.01}, "pin": IDEAL | PIN, "both": PIN}


def test_every_key_of_a_contact_is_changed():
    assert {"law", *OTHER} == set(Contact.model_fields)


def test_both_models_and_the_page_know_the_laws_of_the_schema():
    assert LAWS == reference_model.parameters.LAWS == exudyn_model.laws.LAWS
    page = PAGE.read_text("utf-8").partition("## 6.")[2].partition("## 7.")[0]
    assert [law for law in LAWS if f"`{law}`" not in page and f'"{law}"' not in page] == []


def results(model, values):
    result = model.simulate(load_scene("150rpm-0.2mm", values).data)
    assert result.status == "success", result.remedy
    return np.concatenate([*result.columns.values(), *(v for k, v in result.events.items() if k != "corner")])


@pytest.mark.parametrize("model", [reference_model, exudyn_model], ids=["reference", "exudyn"])
@pytest.mark.parametrize(
    ("law", "stiffness"), [*((law, {}) for law in LAWS), ("adams-impact", {"contact.stiffness": 2e9})]
)
@pytest.mark.parametrize("joints", JOINTS)
def test_keys_have_an_effect_or_a_warning(model, joints, law, stiffness):
    base = THROW | JOINTS[joints] | stiffness | {"contact.law": law}
    reference, idle = results(model, base), {}
    for key, value in OTHER.items():
        if key == "damping_model" and law not in ("hertz-corners", "foundation"):
            continue  # refused there
        change = {f"contact.{key}": value}
        warnings = load_scene("150rpm-0.2mm", base | change).warnings
        if any(line.startswith(f"contact.{key} = ") and "has no effect" in line for line in warnings):
            idle |= change
        else:
            assert not np.array_equal(reference, results(model, base | change)), key
    assert np.array_equal(reference, results(model, base | idle)), idle

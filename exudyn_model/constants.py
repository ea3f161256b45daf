"""The constants of a scene, collected in records for the kernels."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exudyn_model.contact.gaps import contact_law
from exudyn_model.contact.journal import journal_law
from exudyn_model.linkage import tip_jerk
from exudyn_model.parameters import Parameters

_LINKAGE = np.dtype(
    [
        (name, np.float64)
        for name in (
            "crank_length",
            "rod2_length",
            "rocker_to_b",
            "rocker_length",
            "rod2_centroid",
            "rod2_mass",
            "rod2_inertia",
            "rocker_mass",
            "rocker_inertia",
            "rod4_centroid",
            "rod4_length",
            "rod4_mass",
            "rod4_inertia",
            "slider_mass",
            "slider_inertia",
            "gravity",
            "guide_x",
            "pivot_x",
            "pivot_y",
            "rocker_branch",
            "crank_angle",
            "omega",
            "tip_jerk",
        )
    ]
    + [("ideal_slider", np.bool_), ("ideal_pin", np.bool_)]
)


class Constants(NamedTuple):
    """The records of one scene, each of shape (1,).

    Attributes
    ----------
    linkage : ndarray
        From :func:`linkage_record`.
    law : ndarray
        Of the guide: see ``contact.gaps``.
    pin_law : ndarray
        Of the crank pin: see ``contact.journal``.
    """

    linkage: NDArray[np.void]
    law: NDArray[np.void]
    pin_law: NDArray[np.void]


def scene_constants(parameters: Parameters, step: float) -> Constants:
    """Collect the constants of a scene.

    Parameters
    ----------
    parameters : Parameters
    step : float
        Step in a contact, s; nan where there is none: touches inside a step alone read it, and they do not
        occur in steps that end at each touch.
    """
    return Constants(
        linkage_record(parameters),
        contact_law(parameters.contact, parameters.mechanism.slider, step),
        journal_law(parameters, step),
    )


def linkage_record(parameters: Parameters) -> NDArray[np.void]:
    """Collect the constants of linkage and drive for the kernels (SI units, rad), shape (1,)."""
    mechanism = parameters.mechanism
    linkage = np.zeros(1, _LINKAGE)
    linkage["crank_length"] = mechanism.crank.length
    linkage["rod2_length"] = mechanism.rod2.length
    linkage["rocker_to_b"] = mechanism.rocker.centroid
    linkage["rocker_length"] = mechanism.rocker.length
    for name, rod in (("rod2", mechanism.rod2), ("rod4", mechanism.rod4)):
        linkage[f"{name}_centroid"] = rod.centroid
        linkage[f"{name}_mass"] = rod.mass
        linkage[f"{name}_inertia"] = rod.inertia
    linkage["rocker_mass"] = mechanism.rocker.mass
    linkage["rocker_inertia"] = mechanism.rocker.inertia
    linkage["rod4_length"] = mechanism.rod4.length
    linkage["slider_mass"] = mechanism.slider.mass
    linkage["slider_inertia"] = mechanism.slider.inertia
    linkage["gravity"] = mechanism.gravity
    linkage["guide_x"] = mechanism.guide_x
    linkage["pivot_x"], linkage["pivot_y"] = mechanism.rocker_pivot
    linkage["rocker_branch"] = mechanism.rocker_branch
    linkage["crank_angle"] = mechanism.crank_angle
    linkage["omega"] = parameters.drive.omega
    linkage["ideal_slider"] = mechanism.ideal_slider
    linkage["ideal_pin"] = parameters.journal is None
    if parameters.journal is None:
        linkage["tip_jerk"] = tip_jerk(linkage[0])
    return linkage

"""What is pushed to its extremes: one number at a time, and all at once in a Latin hypercube."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

from scipy.stats import qmc

from comparison.scene import Scene, load_scene

BASE, BASE_LABEL = "150rpm-0.2mm", "as shipped"
LITERAL_LAW = "paper-switching"
LAWS = ("hertz-corners", "strip", LITERAL_LAW)
POINTS, SEED = 200, 1
"""Of the Latin hypercube."""
TURNS, SAMPLES = 1.0, 250
"""What an accuracy promises is an error over the first turn; samples of a turn."""

TURNS_AXIS, HYPERCUBE = "turns", "hypercube"
"""Of the first one's cells only the first turn is held against more accurate runs; they have more time."""

NEWTON = "Newton's tolerance"

Values = dict[str, object]


@dataclass(frozen=True)
class Cell:
    """One scene at an extreme.

    Attributes
    ----------
    axis
        What is pushed.
    label
        How far, for a reader.
    law
        Contact law.
    changes
        Dotted keys that differ from the scene `BASE`.
    settings
        Of a solver, dotted keys: over what the way to run it has.
    only
        Names of the ways (`comparison.studies.extremes.ways`) that run it; empty: all.
    """

    axis: str
    label: str
    law: str
    changes: Mapping[str, object] = field(hash=False)
    settings: Mapping[str, object] = field(default_factory=dict, hash=False)
    only: tuple[str, ...] = ()

    @cached_property
    def scene(self) -> Scene:
        """The scene, without any way's solver; raises `SceneError` where it is refused."""
        usual: Values = {
            "drive.cycles": TURNS,
            "output.groups": [],
            "output.samples_per_cycle": SAMPLES,
            "contact.law": self.law,
        }
        return load_scene(BASE, usual | dict(self.changes))


def cells() -> list[Cell]:
    """Return all cells: every axis under every law, then the hypercube, which draws the law too."""
    usual = [cell for law in LAWS for axis in axes() for cell in along(axis, law)]
    return [*usual, *settings(), *long(), *hypercube(POINTS, SEED)]


@dataclass(frozen=True)
class Axis:
    """Values of one thing, in order, each as the keys that it sets.

    Attributes
    ----------
    name, unit
        For a reader.
    points
        Label and values of each point.
    """

    name: str
    unit: str
    points: Sequence[tuple[str, Values]]


LITERAL = ("base", "clearance", "speed", "modulus", "restitution", "friction", "gravity")
"""Axes that are run under the paper's literal switch too. It creates energy at each of its switches and
converges nowhere, see the study contact-laws: most of its runs take all the time they are given."""


def along(axis: Axis, law: str) -> list[Cell]:
    """Return the cells of an axis under a law: of the laws of a whole side the ends alone; they cost much."""
    ends = (axis.points[0], axis.points[-1])
    if law == LITERAL_LAW and axis.name not in LITERAL:
        return []
    points = axis.points if law == LAWS[0] else [point for point in axis.points if point in ends]
    return [Cell(axis.name, label, law, changes) for label, changes in points]


def _of(name: str, unit: str, key: str, values: Sequence[float], **more: object) -> Axis:
    return Axis(name, unit, [(f"{value:g}", {key: value, **more}) for value in values])


CENTRED: Values = {"mechanism.reference_offset": 0.0, "initial.slider_offset": 0.0}
"""A slider that starts in the middle of its guide, and the ideal one with it: what limits are taken with."""


def _decades(first: int, last: int) -> tuple[float, ...]:
    return tuple(float(f"1e{n}") for n in range(first, last + 1))


def _rod(name: str, length: float) -> Values:
    return {f"mechanism.{name}.length": length, f"mechanism.{name}.centroid": 0.5 * length}


def axes() -> list[Axis]:
    """Return the axes in the order of the report; the first is the scene as it is."""
    rods = [("rod 4", "rod4", length) for length in (0.06, 0.05, 0.0493, 0.0492, 0.049)]
    rods += [("rod 2", "rod2", length) for length in (0.26, 0.255, 0.2525, 0.34, 0.38, 0.5)]
    return [
        Axis("base", "", [(BASE_LABEL, {})]),
        Axis(
            "clearance",
            "m",
            [(f"{c:g}", {"clearance.slider": c, **CENTRED}) for c in (*_decades(-9, -3), 5e-3)],
        ),
        _of("speed", "rpm", "drive.speed_rpm", (1.0, 10.0, 50.0, 500.0, 1500.0, 3000.0, 6000.0, -150.0)),
        _of("modulus", "Pa", "contact.youngs_modulus", _decades(6, 13)),
        _of("restitution", "", "contact.restitution", (0.0, 0.1, 0.5, 0.99, 1.0)),
        _of("friction", "", "friction.coefficient", (0.0, 0.5, 1.0, 2.0)),
        _of("corner radius", "m", "contact.corner_radius", _decades(-6, 0)),
        _of("exponent", "", "contact.exponent", (1.0, 1.2, 2.0, 3.0)),
        _of("floor of the impact speed", "m/s", "contact.impact_speed_floor", (1e-12, 1e-6, 1e-2, 1.0)),
        Axis(
            "friction's transition",
            "m/s",
            [
                (f"{v:g}", {"friction.static_speed": 0.1 * v, "friction.transition_speed": v})
                for v in (1e-9, 1e-6, 1e-1, 1e1)
            ],
        ),
        _of("gravity", "m/s²", "environment.gravity", (0.0, -9.81, 98.1)),
        Axis("start", "", START),
        Axis(
            "edge of assembly",
            "",
            [(f"{words} {length:g} m", _rod(key, length)) for words, key, length in rods],
        ),
        Axis("slider", "", SLIDER),
    ]


START: list[tuple[str, Values]] = [
    ("on the wall", {"initial.slider_offset": 2e-4}),
    ("1 µm inside the wall", {"initial.slider_offset": 2.01e-4}),
    ("0.1 mm inside the wall", {"initial.slider_offset": 3e-4}),
    ("10 mm inside the wall", {"initial.slider_offset": 1e-2}),
    ("tilted wedge, touching", {"initial.slider_offset": 0.0, "initial.slider_angle": 5.72e-3}),
    ("tilted wedge, pressed in", {"initial.slider_offset": 0.0, "initial.slider_angle": 5.8e-3}),
    ("tilted by 0.5 rad", {"initial.slider_offset": 0.0, "initial.slider_angle": 0.5}),
    ("at 10 m/s", {"initial.slider_vx": 10.0}),
    ("at 1000 rad/s", {"initial.slider_omega": 1000.0}),
]
SLIDER: list[tuple[str, Values]] = [
    ("mass 1e-4 kg", {"mechanism.slider.mass": 1e-4}),
    ("mass 1e3 kg", {"mechanism.slider.mass": 1e3}),
    ("inertia 1e-9 kg m²", {"mechanism.slider.inertia": 1e-9}),
    ("inertia 10 kg m²", {"mechanism.slider.inertia": 10.0}),
]


def settings() -> list[Cell]:
    """Return the cells of the solvers' own settings, from absurdly coarse to round-off."""
    reference, bodies = ("minimal", "multipliers"), ("five bodies", "five bodies, index 2")
    pushed = [
        ("reference's tolerance", reference, "solver.reference.tolerance", (1.0, 1e-3, 1e-5, 1e-14, 1e-16)),
        ("tree's tolerance", ("tree",), "solver.exudyn.tolerance", (1.0, 1e-3, 1e-5, 1e-13, 1e-15)),
        ("step", bodies, "solver.exudyn.step", (1e-2, 1e-3, 1e-4, 2e-5, 1e-7)),
        (NEWTON, bodies, "solver.exudyn.tolerance", (1e3, 1.0, 1e-3, 1e-10, 1e-14)),
    ]
    return [
        Cell(axis, f"{value:g}", LAWS[0], {}, {key: value}, only)
        for axis, only, key, values in pushed
        for value in values
    ]


def long() -> list[Cell]:
    """Return the cells of many turns, each as many as its formulation is meant for."""
    turns = {
        10: ("minimal", "multipliers", "tree", "five bodies", "five bodies, index 2"),
        100: ("minimal", "multipliers", "tree"),
        1000: ("minimal",),
        10_000: ("minimal",),
    }
    few = {"output.samples_per_cycle": 25}
    return [
        Cell(TURNS_AXIS, f"{n}", LAWS[0], {"drive.cycles": float(n), **few}, {}, only)
        for n, only in turns.items()
    ]


def hypercube(count: int, seed: int) -> list[Cell]:
    """Return cells drawn over all ranges at once.

    Clearance 1e-9 to 5e-3 m, speed 1 to 6000 rpm, modulus 1e6 to 1e13 Pa, radius 1e-6 to 1 m, by their
    logarithms; restitution 0 to 1, friction 0 to 2, gravity -9.81 to 98.1 m/s^2, start from wall to wall and
    a tenth of the clearance beyond, tilted up to the wedge; of ten points one under the paper's literal
    switch, of the others each second one under the strip.
    """
    cells = []
    for number, u in enumerate(qmc.LatinHypercube(9, rng=seed).random(count)):
        clearance, speed, modulus, radius = (
            float(f"{10 ** (low + share * (high - low)):.6g}")
            for share, low, high in zip(
                u, (-9.0, 0.0, 6.0, -6.0), (-2.30103, 3.778151, 13.0, 0.0), strict=False
            )
        )
        restitution, friction, gravity = float(u[4]), 2.0 * float(u[5]), -9.81 + 107.91 * float(u[6])
        values: Values = {
            "clearance.slider": clearance,
            "drive.speed_rpm": speed,
            "contact.youngs_modulus": modulus,
            "contact.corner_radius": radius,
            "contact.restitution": round(restitution, 4),
            "friction.coefficient": round(friction, 4),
            "environment.gravity": round(gravity, 4),
            "mechanism.reference_offset": 0.0,
            "initial.slider_offset": 1.1 * (2.0 * float(u[7]) - 1.0) * clearance,
            # Corners of a diagonal touch at about 2 clearances / length.
            "initial.slider_angle": (2.0 * float(u[8]) - 1.0) * clearance / 0.035,
        }
        law = LAWS[2] if number % 10 == 9 else LAWS[number % 2]
        cells.append(Cell(HYPERCUBE, f"{number + 1}", law, values))
    return cells

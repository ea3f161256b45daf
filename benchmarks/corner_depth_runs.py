"""Random runs of the reference for `corner_depths`: three populations, each run drawn from its own number."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

CYCLES = 2.0
TOLERANCES_OF_SCIPY = {"BDF": 1e-8, "Radau": 1e-8, "LSODA": 1e-9, "scipy-DOP853": 1e-9}
"""The finest of each; BDF and Radau take 0.5 ms a step and a thousand steps more for every decade."""
SCIPY_CYCLES = 0.25
SAMPLES = 40_000
"""Of a cycle of scipy's: at 150 rpm 1e-5 s apart, a tenth of an elastic contact of steel."""
FORMULATIONS = {
    "minimal": {},
    "multiplier": {"solver.reference.formulation": "multiplier"},
    "pin": {"joints.slider": "ideal", "joints.crank_pin": "clearance"},
    "both": {"joints.crank_pin": "clearance"},
}
LAWS = ("hertz-corners", "paper-switching", "foundation")


class Draw(NamedTuple):
    """A run: what it is counted under, and the scene's name and changes."""

    number: int
    labels: dict[str, str]
    scene: str
    values: dict[str, Any]


def contacts(rng: np.random.Generator) -> dict[str, Any]:
    """Draw everything that a contact depends on: start, speed, clearances, material, friction, gravity."""
    clearance = 10.0 ** rng.uniform(-5.0, -3.0)
    # Of the clearance; one in ten starts on the centre line, one in twenty a little inside a wall.
    offset = rng.uniform(-1.0, 1.0) * rng.choice([0.0, 1.0], p=[0.1, 0.9])
    if rng.uniform() < 0.05:
        offset = 1.001 * rng.choice([-1.0, 1.0])
    # A corner is off by half the length of 0.07 m times the angle: mostly within the clearance that is left.
    angle = rng.uniform(-1.0, 1.0) * max(0.0, 1.0 - abs(offset)) * clearance / 0.035
    return {
        "drive.cycles": CYCLES,
        "drive.speed_rpm": float(rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(1.0, 3.0)),
        "mechanism.crank_angle_deg": float(rng.uniform(0.0, 360.0)),
        "clearance.slider": float(clearance),
        "clearance.crank_pin": float(10.0 ** rng.uniform(-5.0, -3.3)),
        "initial.slider_offset": float(offset * clearance),
        "initial.slider_angle": float(angle * rng.choice([0.0, 1.0])),
        "initial.slider_vx": float(rng.normal(0.0, 0.05) * rng.choice([0.0, 1.0])),
        "initial.slider_omega": float(rng.normal(0.0, 1.0) * rng.choice([0.0, 1.0])),
        "contact.youngs_modulus": float(10.0 ** rng.uniform(8.0, 12.0)),
        "contact.poisson": float(rng.uniform(0.0, 0.49)),
        "contact.restitution": float(rng.choice([0.0, 1.0, rng.uniform()], p=[0.1, 0.1, 0.8])),
        "contact.corner_radius": float(10.0 ** rng.uniform(-4.0, -1.0)),
        "friction.coefficient": float(rng.choice([0.0, rng.uniform()], p=[0.2, 0.8])),
        "environment.gravity": float(rng.choice([0.0, 9.81, -9.81, rng.uniform(-30.0, 30.0)])),
        "contact.impact_speed": str(rng.choice(["frozen", "current"], p=[0.8, 0.2])),
    }  # fmt: skip


def random_runs(count: int, seed: int) -> Iterator[Draw]:
    """Draw runs of the compiled integrator."""
    for number in range(count):
        rng = np.random.default_rng([seed, 0, number])
        name = str(rng.choice(list(FORMULATIONS)))
        law = str(rng.choice(LAWS)) if name != "pin" else "journal"
        exponent = rng.uniform(-12.0, -8.0)
        values = contacts(rng) | FORMULATIONS[name] | {"solver.reference.tolerance": float(10.0**exponent)}
        if name != "pin":
            values["contact.law"] = law
        labels = {"formulation": name, "law": law, "tolerance": f"1e{int(np.floor(exponent)):+d}.."}
        yield Draw(number, labels, "paper", values)


def grazing_runs(count: int, seed: int) -> Iterator[Draw]:
    """Draw starts and speeds of the shipped scene of 0.2 mm, everything else as shipped."""
    for number in range(count):
        rng = np.random.default_rng([seed, 1, number])
        values = {
            "drive.cycles": CYCLES,
            "drive.speed_rpm": float(rng.uniform(150.0, 300.0)),
            "initial.slider_offset": float(rng.uniform(-2e-4, 2e-4)),
            "solver.reference.tolerance": 1e-9,
        }
        yield Draw(number, {"population": "grazing"}, "150rpm-0.2mm", values)


def scipy_runs(count: int, seed: int) -> Iterator[Draw]:
    """Draw runs of scipy's solvers, in turn; corners only."""
    methods = list(TOLERANCES_OF_SCIPY)
    for number in range(count):
        rng = np.random.default_rng([seed, 2, number])
        method = methods[number % len(methods)]
        name = str(rng.choice(["minimal", "multiplier", "both"]))
        law = str(rng.choice([law for law in LAWS if law != "paper-switching"]))
        exponent = rng.uniform(np.log10(TOLERANCES_OF_SCIPY[method]), -6.0)
        values = contacts(rng) | FORMULATIONS[name] | {
            "contact.law": law,
            "drive.cycles": SCIPY_CYCLES,
            "output.samples_per_cycle": SAMPLES,
            "output.groups": ["corners"],
            "solver.reference.method": method,
            "solver.reference.tolerance": float(10.0**exponent),
        }  # fmt: skip
        yield Draw(number, {"method": method, "formulation": name, "law": law}, "paper", values)

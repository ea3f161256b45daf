"""The random scenes of the campaign: three in four drawn from ranges that both models carry to the end.

One in four is a shipped scene of which only the start is moved. One in eight besides has a workpiece, the law
of ADAMS, or both.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np

from comparison.scene import Scene, load_scene
from comparison.studies.shared.scenes import at_tier, clearance_and_start, log_uniform

SEED = 26112026  # fixed before any scene of it was run; under 13062026 another law was drawn
CYCLES = 2.0
DRAWN_SHARE = 0.1  # of the scenes, whose whole family of runs is compared however close the single runs are
SHIPPED_SHARE = 0.25
# Whose starts are moved: those with a clearance at the slider, but for the wedge, which starts in walls.
SHIPPED = (
    "150rpm-0.2mm",
    "300rpm-0.2mm",
    "69GPa",
    "90rpm-0.1mm",
    "90rpm-0.5mm",
    "poisson-0.33",
    "both-clearances",
)
MOVED = 0.02  # of the clearance, the most that a shipped start is moved
JOINTS = {"slider": 0.75, "both": 0.2, "crank pin": 0.05}  # which joints have clearance, and how often
FOUNDATION_SHARE = 0.06
BOUNCY, OTHER_GRAVITY = "restitution of every second scene", "gravity, where it is not the usual"
RANGES = {
    "speed, either sense": (10.0, 1000.0, "rpm"),
    "clearances": (0.05e-3, 1e-3, "m"),
    "Young's modulus": (1e9, 400e9, "Pa"),
    # With that of a metal the tree takes minutes on a stiff side.
    "of a foundation": (1e6, 1e9, "Pa"),
    "corner radius": (0.2e-3, 5e-3, "m"),
    "Poisson's ratio": (0.0, 0.45, "1"),
    "restitution": (0.0, 1.0, "1"),
    # The more a contact leaves, the more contacts and flights follow.
    BOUNCY: (0.8, 1.0, "1"),
    "friction": (0.0, 0.8, "1"),
    OTHER_GRAVITY: (-20.0, 20.0, "m/s^2"),
}
EVERY = 8
"""One scene in so many has a workpiece, the law of ADAMS, or both; the others are drawn as without these."""
AT_WORK = {
    "damping": (1.0, 1e4, "N s/m"),
    "depth of the full damping": (1e-6, 1e-4, "m"),
    "force of the workpiece": (10.0, 2000.0, "N"),
    "depth of this force": (0.5e-3, 10e-3, "m"),
    "exponent of the workpiece": (1.0, 3.0, "1"),
}
BOTTOM = -0.0348  # y of the slider at its bottom dead centre, m: lengths and pivots are never drawn
GRAVITY = {"usual": 0.6, "none": 0.1, "reversed": 0.1, "drawn": 0.2}
_shipped = cache(load_scene)


@dataclass(frozen=True)
class Case:
    """One scene of the campaign: its place in the population determines, with the seed, everything else."""

    number: int
    scene: Scene  # at the settings of the tight tier
    family: bool = False  # whether its whole family of runs is compared in any case


def cases(count: int, seed: int) -> list[Case]:
    """Draw scenes; scene k of a seed is the same whatever the count."""
    return [case(number, seed) for number in range(count)]


def case(number: int, seed: int) -> Case:
    """Draw one scene."""
    rng = np.random.default_rng([seed, number])
    drawn = _beside_shipped(rng) if rng.uniform() < SHIPPED_SHARE else _anywhere(rng)
    texts = {"scene.name": f"campaign-{number}", "scene.title": f"Scene {number} of the seed {seed}"}
    if number % EVERY == EVERY - 1:
        drawn = _at_work(drawn, np.random.default_rng([seed, number, 1]))
    common = {"drive.cycles": CYCLES, "output.groups": ["accelerations", "corners"]}
    scene = at_tier(drawn.with_values(common | texts), "tight")
    return Case(number, scene, bool(rng.uniform() < DRAWN_SHARE))


def _beside_shipped(rng: np.random.Generator) -> Scene:
    base = _shipped(str(rng.choice(SHIPPED)))
    start, length = base.data["initial"], base.data["mechanism"]["slider"]["length"]
    shift, rotation = MOVED * base.data["clearance"]["slider"] * rng.uniform(-1.0, 1.0, 2)
    return base.with_values(
        {
            "initial.slider_offset": float(start["slider_offset"] + shift),
            "initial.slider_angle": float(start["slider_angle"] + 2.0 * rotation / length),
        }
    )


def _at_work(base: Scene, rng: np.random.Generator) -> Scene:
    """Return a scene with a workpiece, the law of ADAMS, or both."""
    damping, full = (log_uniform(rng, AT_WORK[name][:2]) for name in ("damping", "depth of the full damping"))
    force = log_uniform(rng, AT_WORK["force of the workpiece"][:2])
    depth = log_uniform(rng, AT_WORK["depth of this force"][:2])
    exponent = float(rng.uniform(*AT_WORK["exponent of the workpiece"][:2]))
    which = str(rng.choice(["law", "power law", "table", "both"]))
    values: dict[str, object] = {}
    if which in ("law", "both"):
        values |= {"contact.law": "adams-impact", "contact.damping": damping, "contact.damping_depth": full}
    if which != "law":
        values["load.surface"] = BOTTOM + depth
    if which == "table":
        middle = [float(rng.uniform(0.2, 0.8)) * depth, float(rng.uniform(0.0, 1.0)) * force]
        values["load.table"] = [[0.0, 0.0], middle, [depth, force]]
    elif which != "law":
        values |= {"load.force": force, "load.depth": depth, "load.exponent": exponent}
    return base.with_values(values)


def _anywhere(rng: np.random.Generator) -> Scene:
    def uniform(name: str) -> float:
        return float(rng.uniform(*RANGES[name][:2]))

    def log(name: str) -> float:
        return log_uniform(rng, RANGES[name][:2])

    base = _shipped("paper")
    foundation = rng.uniform() < FOUNDATION_SHARE
    loose = str(rng.choice(list(JOINTS), p=list(JOINTS.values())))
    bounds = RANGES["clearances"][:2]
    values: dict[str, object] = {
        **clearance_and_start(rng, bounds, base.data["mechanism"]["slider"]["length"]),
        "mechanism.crank_angle_deg": float(rng.uniform(0.0, 360.0)),
        "drive.speed_rpm": float(rng.choice((-1.0, 1.0))) * log("speed, either sense"),
        "joints.slider": "ideal" if loose == "crank pin" else "clearance",
        "joints.crank_pin": "ideal" if loose == "slider" else "clearance",
        "clearance.crank_pin": log("clearances"),
        "contact.law": "foundation" if foundation else "hertz-corners",
        "contact.youngs_modulus": log("of a foundation" if foundation else "Young's modulus"),
        "contact.poisson": uniform("Poisson's ratio"),
        "contact.restitution": uniform(BOUNCY if rng.uniform() < 0.5 else "restitution"),
        "contact.corner_radius": log("corner radius"),
        "friction.coefficient": uniform("friction"),
    }
    kind, drawn = str(rng.choice(list(GRAVITY), p=list(GRAVITY.values()))), uniform(OTHER_GRAVITY)
    usual = float(base.data["environment"]["gravity"])
    gravity = {"usual": usual, "none": 0.0, "reversed": -usual, "drawn": drawn}[kind]
    return base.with_values(values | {"environment.gravity": gravity})


def loose_joints(scene: Scene) -> list[str]:
    """Return the joints that have clearance; the first is the one that moves the slider."""
    return [name for name in ("slider", "crank_pin") if scene.data["joints"][name] == "clearance"]

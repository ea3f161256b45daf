r"""Numerical uncertainty of a run as a function of time.

Five runs of one model give it: the run itself (S), one at a finer setting (S_f), one at a coarser (S_c), and
two perturbed runs of the coarser one whose start is moved by a billionth of the clearance, but by no less
than x is rounded (S_t): the
divergence of neighbouring trajectories is a property of the motion, and the coarser setting shows it at the
least cost. One perturbed run has offset and angle moved with equal signs, the other with opposite ones, since
a force may be insensitive to one of the two. A level changes the setting by the factor r and should change
the error by r^p. With the window W(t) of one hundredth of a crank cycle to either side,

.. math:: d_f = \max_{W(t)} |S - S_f|, \quad d_c = \max_{W(t)} |S_c - S|, \quad
          d_t = \max_{W(t)} |S_c - S_t| \text{ of either perturbed run}, \quad d = \max(d_f, d_c / r^p),

.. math:: u(t) = \max\bigl(F_s d,\; 3 d_t,\; u_0\bigr),

u_0 being the channel's round-off and F_s a factor of safety after P. J. Roache (J. Fluids Eng. 116, 1994,
405-413): 3, but 1.25 r^p / (r^p - 1) where the three levels show the expected order, |log_r(d_c / d_f) - p|
<= p / 4; then the error of S is r^p / (r^p - 1) of its distance to S_f. The third level is needed because two
can have the same error by chance, for a whole flight between two impacts, where their distance is
uninformative. A window is used instead of a running maximum because diverged runs converge again in sustained
contact.

Five runs are a small sample: where motion magnifies errors by decades they may be close by chance. Where more
runs M_i of the same setting from moved starts are there (`comparison.verdict.confirmation`), u is never
below :math:`F_e \max_i \max_{W(t)} |S - M_i|`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import degrees

import numpy as np
from scipy.ndimage import maximum_filter1d

from comparison.scene import Scene
from comparison.tables.arrays import Array
from comparison.tables.table import Table

SAFETY_FACTOR = 3.0
SAFETY_FACTOR_IN_ORDER = 1.25
ORDER_BAND = 0.25  # of the expected order, to either side
# With k = 2 the smallest for which a run that an ensemble does not exclude is explained: members are then
# within 2 u / F_e of the centre, the run itself within u / F_e, and k u - u / F_e >= 2 u / F_e from 3 / k on.
ENSEMBLE_FACTOR = 1.5
WINDOW = 0.01  # of a crank cycle, to either side
PERTURBATION = 1e-9  # of the clearance, across the guide; of clearance / slider length in the angle
LEAST_PERTURBATION = 1e-15  # m; x of half a metre is rounded to 1e-16 m: less would perturb nothing
ROUND_OFF = 4 * float(np.finfo(np.float64).eps)  # of the largest value: storing it and a few operations
# Of the run's duration: N additions of a step may add up to N eps / 2, i.e. 4e-11 for the 4e5 steps of two
# cycles at 1e-6 s; measured there (slider_y of the ideal mechanism, known in closed form) is 4e-12.
TIME_ROUND_OFF = 1e-11


def perturbed_scenes(scene: Scene, times: float = 1.0) -> dict[str, Scene]:
    """Return the scenes with their start moved by `perturbation`, or a multiple of it.

    The slider in its guide, offset and angle with equal and with opposite signs; where only the crank pin has
    clearance, the crank, since the journal has no start of its own. None where there is no clearance.

    Returns
    -------
    dict
        By the names in `Runs`.
    """
    joint = movable(scene)
    if joint is None:
        return {}
    shift = times * perturbation(scene)
    signs = {"perturbed": 1.0, "other_perturbed": -1.0} if joint == "slider" else {"perturbed": 1.0}
    return {name: moved(scene, shift, sign * shift) for name, sign in signs.items()}


def movable(scene: Scene) -> str | None:
    """Return the joint whose clearance lets the start be moved: "slider", else "crank_pin", else None."""
    joints = scene.data["joints"]
    return next((joint for joint in ("slider", "crank_pin") if joints[joint] == "clearance"), None)


def perturbation(scene: Scene) -> float:
    """Return the shift of the start of a perturbed run, m; for a scene whose start is `movable`."""
    return max(LEAST_PERTURBATION, float(PERTURBATION * scene.data["clearance"][movable(scene)]))


def moved(scene: Scene, across: float, turned: float) -> Scene:
    """Return the scene with its start moved; it must be `movable`.

    Parameters
    ----------
    scene
        Whose start.
    across
        By which the slider is moved across its guide, m; of a scene with clearance at the crank pin alone
        the crank pin along its circle.
    turned
        By which the slider's end moves as the slider turns, m: its angle times its length. Not used where
        only the crank pin has clearance: such a start has one coordinate.
    """
    start, mechanism = scene.data["initial"], scene.data["mechanism"]
    if movable(scene) == "slider":
        return scene.variant(
            {
                "initial.slider_offset": start["slider_offset"] + across,
                "initial.slider_angle": start["slider_angle"] + turned / mechanism["slider"]["length"],
            }
        )
    angle = mechanism["crank_angle_deg"] + degrees(across / mechanism["crank"]["length"])
    return scene.variant({"mechanism.crank_angle_deg": angle})


def window_samples(period: float, interval: float) -> int:
    """Half-width of the window in samples, rounded up, at least one.

    Parameters
    ----------
    period
        Of a crank cycle, s.
    interval
        Between samples, s.
    """
    # The subtracted share keeps 1 % of 0.4 s at 0.4 ms at ten samples, whichever way the quotient rounds.
    return max(1, int(np.ceil(WINDOW * period / interval - 1e-6)))


def round_off(values: Array, time: Array, absolute: float) -> float:
    """Return the round-off of one sample in double precision, in the channel's unit.

    The largest of three: the channel's absolute number, some epsilon of its largest value, and the change
    within the error of time itself, which a solver with fixed steps sums up from thousands of them.

    Parameters
    ----------
    values, time
        The channel and its times (s), shape (n,).
    absolute
        ``round_off`` of ``channels.toml``.
    """
    rate = float(np.abs(np.diff(values) / np.diff(time)).max())
    clock = TIME_ROUND_OFF * float(time[-1] - time[0])
    largest = float(np.abs(values).max())
    return max(absolute, ROUND_OFF * largest, clock * rate)


@dataclass(frozen=True)
class Runs:
    """One model's runs of a scene; without a finer run it has no uncertainty."""

    base: Table
    finer: Table | None = None
    perturbed: Table | None = None
    """The coarser run (without one: the base) with its start moved; None where it cannot be moved."""
    coarser: Table | None = None
    other_perturbed: Table | None = None
    """As ``perturbed``, with the angle moved the other way; None where a start has no two coordinates."""
    refinement: tuple[float, float] = (2.0, 2.0)
    """Factor between two levels and order of the error, see `comparison.accuracy.levels.refinement`."""

    @property
    def gain(self) -> float:
        """Expected error ratio of two levels, factor^order."""
        factor, order = self.refinement
        return float(factor**order)

    @property
    def perturbed_runs(self) -> tuple[Table, ...]:
        """The available perturbed runs."""
        return tuple(run for run in (self.perturbed, self.other_perturbed) if run is not None)

    @property
    def original(self) -> Table:
        """The unperturbed run of the perturbed ones."""
        return self.base if self.coarser is None else self.coarser


@dataclass(frozen=True)
class Levels:
    """One channel in the runs of one model at the same times, each of shape (n,)."""

    base: Array
    finer: Array
    coarser: Array | None = None
    perturbed: tuple[Array, ...] = ()
    """Of the coarser run, or of the base where there is none; none where the start cannot be moved."""
    factor: float = 2.0
    """Between the settings of two levels."""
    order: float = 2.0
    """At which the error should follow the setting."""
    ensemble: tuple[Array, ...] = ()
    """Of the base, from moved starts."""


def uncertainty(levels: Levels, half_width: int, floor: float) -> Array:
    """Evaluate u(t) for one channel, in its unit.

    Parameters
    ----------
    levels
        The channel in the runs.
    half_width
        Of the window, samples.
    floor
        What u never falls below: see `round_off`.

    Returns
    -------
    ndarray
        Shape (n,), positive.
    """
    distance = _widened(np.abs(levels.base - levels.finer), half_width)
    u = SAFETY_FACTOR * distance
    if levels.coarser is not None:
        gain = levels.factor**levels.order
        coarse = _widened(np.abs(levels.coarser - levels.base), half_width)
        # Equal runs have no order: 0/0 is nan and x/0 is inf, both outside the band.
        with np.errstate(divide="ignore", invalid="ignore"):
            order = np.log(coarse / distance) / np.log(levels.factor)
        in_order = np.abs(order - levels.order) <= ORDER_BAND * levels.order
        safety = np.where(in_order, SAFETY_FACTOR_IN_ORDER * gain / (gain - 1.0), SAFETY_FACTOR)
        u = safety * np.maximum(distance, coarse / gain)
    original = levels.base if levels.coarser is None else levels.coarser
    u = np.maximum(np.maximum(u, spread(original, levels.perturbed, half_width)), floor)
    if not levels.ensemble:
        return u
    farthest = np.max([np.abs(run - levels.base) for run in levels.ensemble], axis=0)
    return np.maximum(u, ENSEMBLE_FACTOR * _widened(farthest, half_width))


def spread(original: Array, perturbed: Sequence[Array], half_width: int) -> Array:
    """Return the part of u due to neighbouring starts, which no setting removes, 3 d_t; shape (n,).

    Parameters
    ----------
    original, perturbed
        One channel of a run and of its perturbed runs, shape (n,) each; zero without any.
    half_width
        Of the window, samples.
    """
    farthest = np.max([np.abs(original - run) for run in perturbed], axis=0, initial=0.0)
    return SAFETY_FACTOR * _widened(np.broadcast_to(farthest, original.shape), half_width)


def _widened(distance: Array, half_width: int) -> Array:
    """Return the largest distance within the window, shape (n,)."""
    widest: Array = maximum_filter1d(distance, 2 * half_width + 1, mode="nearest")
    return widest


def combined(u_a: Array, u_b: Array) -> Array:
    """Return the uncertainty of a difference of independent results, sqrt(u_a^2 + u_b^2); shape (n,)."""
    return np.hypot(u_a, u_b)

r"""Numerical uncertainty of a run as a function of time, from five runs of one model.

The run itself (S), one at a finer setting (S_f), one at a coarser (S_c), and two of the coarser setting whose
start is moved (S_t), with offset and angle of equal and of opposite signs: how neighbouring trajectories
diverge is a property of the motion, which the coarser setting shows at the least cost. A level changes the
setting by the factor r and should change the error by r^p. With the window W(t) of one hundredth of a period
to either side (no running maximum: diverged runs converge again in sustained contact),

.. math:: d_f = \max_{W(t)} |S - S_f|, \quad d_c = \max_{W(t)} |S_c - S|, \quad
          d_t = \max_{W(t)} |S_c - S_t| \text{ of either perturbed run}, \quad d = \max(d_f, d_c / r^p),

.. math:: u(t) = \max\bigl(F_s d,\; 3 \kappa d_t,\; u_0\bigr), \quad
          \kappa(t) = \min\bigl(1, \max_{s \le t} d_f(s) / d_t(s)\bigr),

u_0 being the channel's round-off and F_s a factor of safety after P. J. Roache (J. Fluids Eng. 116, 1994,
405-413): 3, but 1.25 r^p / (r^p - 1) where the three levels show the expected order, |log_r(d_c / d_f) - p|
<= p / 4. Where they show a lower one, max(1, d_c / d_f - 1) replaces r^p in d, after Richardson: errors that
impacts have magnified no longer follow the setting. Two levels alone can have the same error by chance for a
whole flight between two impacts. The moved starts count as far as the run's own error has come, which at fine
settings is less than what they were moved by; without a scene, where a user says how far, they count as a
whole: kappa is 1. With more runs M_i of the same setting from moved starts
(`comparison.verdict.confirmation`), u is never below :math:`F_e \max_i \max_{W(t)} |S - M_i|`.

Once a channel has been unpredictable for longer than the window, a verdict takes `REGAINED` u.

Contacts are shorter than the distance of samples: that all runs have no force at one shows little. Where a
corner's force is zero and its gap within u of zero, u of the force is at least the largest force of the run,
and so of the journal of a linkage.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import degrees, isfinite, isnan, log, nan, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d

from comparison.scene import Scene
from comparison.tables.channels import Array, BoolArray, Channel
from comparison.tables.table import Table

SAFETY_FACTOR = 3.0
SAFETY_FACTOR_IN_ORDER = 1.25
ORDER_BAND = 0.25  # of the expected order, to either side
# With k = 2 the smallest for which a run that an ensemble does not exclude is explained: members are then
# within 2 u / F_e of the centre, the run itself within u / F_e, and k u - u / F_e >= 2 u / F_e from 3 / k on.
ENSEMBLE_FACTOR = 1.5
# Of u after `until`, where runs that have parted have come together again. Of 5382 intervals between touches
# of 20 random scenes 171 had an error above 1.41 u, held against a truth. With four times u after `until` 71
# of 5189 have, with ten 37 of 5087, 33 of them before it, for 4 and 6 % of the predictable samples.
REGAINED = 10.0
WINDOW = 0.01  # of a crank cycle, to either side
PERTURBATION = 1e-9  # of the clearance, across the guide; of clearance / slider length in the angle
LEAST_PERTURBATION = 1e-15  # m; x of half a metre is rounded to 1e-16 m: less would perturb nothing
ROUND_OFF = 4 * float(np.finfo(np.float64).eps)  # of the largest value: storing it and a few operations
# Of the run's duration: N additions of a step may add up to N eps / 2, i.e. 4e-11 for the 4e5 steps of two
# cycles at 1e-6 s; measured there (slider_y of the ideal mechanism, known in closed form) is 4e-12.
TIME_ROUND_OFF = 1e-11
FIRST = 1000
"""Samples that give the range of a motion without a stated period or scale: later ones only widen it."""

Windows = tuple[NDArray[np.intp], NDArray[np.intp]]
"""First and last sample of the window of each sample, each of shape (n,); n where it exceeds the run."""


@dataclass(frozen=True)
class Runs:
    """One model's runs of a scene; without a finer run it has no uncertainty.

    The perturbed runs have the coarser setting, or the base's where there is no coarser run. ``refinement``
    is the factor between two levels and the order of the error; nan where the order is not known: then the
    least of any method, 1, counts for the coarser run, and the factor of safety is always the large one.
    """

    base: Table
    finer: Table | None = None
    perturbed: Table | None = None
    coarser: Table | None = None
    other_perturbed: Table | None = None
    refinement: tuple[float, float] = (2.0, 2.0)

    @property
    def gain(self) -> float:
        """Expected error ratio of two levels."""
        return float(self.refinement[0] ** self.refinement[1])

    @property
    def tables(self) -> dict[str, Table]:
        """The available runs, by the names of their fields."""
        names = ("base", "finer", "perturbed", "other_perturbed", "coarser")
        return {name: table for name in names if (table := getattr(self, name)) is not None}

    @property
    def perturbed_runs(self) -> tuple[Table, ...]:
        """The available perturbed runs."""
        return tuple(run for run in (self.perturbed, self.other_perturbed) if run is not None)

    @property
    def original(self) -> Table:
        """The unperturbed run at the setting of the perturbed ones."""
        return self.base if self.coarser is None else self.coarser


@dataclass(frozen=True)
class RunValues:
    """One quantity in the runs of one model, each of shape (n,); see `Runs`."""

    base: Array
    finer: Array
    coarser: Array | None = None
    perturbed: tuple[Array, ...] = ()
    factor: float = 2.0
    order: float = 2.0
    ensemble: tuple[Array, ...] = ()


def perturbed_scenes(scene: Scene) -> dict[str, Scene]:
    """Return the scenes whose start is moved by `perturbation`, by name in `Runs`; none without clearance."""
    if not scene.loose:
        return {}
    if scene.is_linkage:  # of every second state to the other side
        shifts = {state: PERTURBATION * scale for state, scale in clearance_scales(scene).items()}
        opposites = {state: shift * (-1) ** n for n, (state, shift) in enumerate(shifts.items())}
        return {"perturbed": shift_start(scene, shifts), "other_perturbed": shift_start(scene, opposites)}
    shift = perturbation(scene)
    scenes = {"perturbed": move_start(scene, shift, shift)}
    return scenes | ({"other_perturbed": move_start(scene, shift, -shift)} if "slider" in scene.loose else {})


def movable(scene: Scene) -> str | None:
    """Return the joint whose clearance lets the start be moved: "slider", else "crank_pin", else None."""
    return scene.loose[-1] if scene.loose else None


def perturbation(scene: Scene) -> float:
    """Return the shift of the start of a perturbed run, m; for a scene whose start is `movable`."""
    return max(LEAST_PERTURBATION, PERTURBATION * scene.clearance(scene.loose[-1]))


def move_start(scene: Scene, shift: float, tilt: float) -> Scene:
    """Return a scene whose slider, else crank pin, starts ``shift`` (m) and ``tilt`` / length off."""
    start, mechanism = scene.data["initial"], scene.data["mechanism"]
    if "slider" not in scene.loose:
        angle = mechanism["crank_angle_deg"] + degrees(shift / mechanism["crank"]["length"])
        return scene.variant({"mechanism.crank_angle_deg": angle})
    angle = start["slider_angle"] + tilt / mechanism["slider"]["length"]
    offset = start["slider_offset"] + shift
    return scene.variant({"initial.slider_offset": offset, "initial.slider_angle": angle})


def clearance_scales(scene: Scene) -> dict[str, float]:
    """Return the states of the start within the clearances of a linkage, and their scales (m, rad)."""
    scales = dict[str, float]()
    for name, clearance in scene.data.get("clearance", {}).items():
        size, guide = clearance["size"], "length" in clearance
        scales |= {f"{name}.{axis}": size for axis in (["offset"] if guide else "xy")}
        scales |= {f"{name}.tilt": size / clearance["length"]} if guide else {}
    return scales


def shift_start(scene: Scene, offsets: Mapping[str, float]) -> Scene:
    """Return a linkage whose start is moved in states: BODY.angle and the like, and `clearance_scales`."""
    changes: dict[str, Any] = {}
    for state, offset in offsets.items():
        if not offset:
            continue
        name, _, quantity = state.partition(".")
        key = {"angle": "angle_deg", "tilt": "tilt_deg"}.get(quantity, quantity)
        table = "clearance" if name in scene.loose else "initial"
        value = scene.data[table].get(name, {})
        if table == "clearance" and quantity in "xy":
            vector = changes.setdefault(f"clearance.{name}.offset", [*value["offset"]])
            vector["xy".index(quantity)] += offset
        else:
            change = degrees(offset) if key.endswith("_deg") else offset
            changes[f"{table}.{name}.{key}"] = value.get(key, 0.0) + change
    for name in scene.loose:  # one that touches stays within the gap
        if vector := changes.get(key := f"clearance.{name}.offset"):
            share = min(1.0, (1 - 1e-15) * scene.clearance(name) / float(np.linalg.norm(vector)))
            changes[key] = [share * each for each in vector] if isinstance(vector, list) else share * vector
    return scene.variant(changes)


def uncertainty(
    levels: RunValues, half_width: int | Windows, floor: float | Array, *, whole: bool = False
) -> Array:
    """Evaluate u(t) for one quantity in its unit, shape (n,), from a window's half-width in samples.

    With a half-width of zero they are numbers, not samples in time: kappa is 1, as where moved starts count
    as a ``whole``.
    """
    distance = _window_maximum(np.abs(levels.base - levels.finer), half_width)
    u, original = SAFETY_FACTOR * distance, levels.base
    if levels.coarser is not None:
        original, gain = levels.coarser, levels.factor ** (1.0 if isnan(levels.order) else levels.order)
        coarse_distance = _window_maximum(np.abs(levels.coarser - levels.base), half_width)
        # Equal runs have no order: 0/0 is nan and x/0 is inf, both outside the band.
        with np.errstate(divide="ignore", invalid="ignore"):
            order = np.log(coarse_distance / distance) / np.log(levels.factor)
            observed_gain = np.clip(coarse_distance / distance - 1.0, 1.0, gain)
        in_order = np.abs(order - levels.order) <= ORDER_BAND * levels.order
        safety = np.where(in_order, SAFETY_FACTOR_IN_ORDER * gain / (gain - 1.0), SAFETY_FACTOR)
        reduction = np.where(order < (1.0 - ORDER_BAND) * levels.order, observed_gain, gain)
        u = safety * np.maximum(distance, coarse_distance / reduction)
    parting = spread(original, levels.perturbed, half_width)
    if half_width and not whole:
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.nan_to_num(SAFETY_FACTOR * distance / parting, nan=0.0)
        parting = parting * np.minimum(np.maximum.accumulate(share), 1.0)
    u = np.maximum(np.maximum(u, parting), floor)
    if not levels.ensemble:
        return u
    farthest = np.max([np.abs(run - levels.base) for run in levels.ensemble], axis=0)
    return np.maximum(u, ENSEMBLE_FACTOR * _window_maximum(farthest, half_width))


def model_uncertainty(
    runs: Runs,
    name: str,
    period: float,
    ensemble: Sequence[Table] = (),
    every: int = 1,
    n_first: int | None = None,
    *,
    gap_u: Array | None = None,
) -> Array | None:
    """Evaluate u(t) for one channel of one model's runs, in its unit; None without a finer run.

    ``period`` is that of the motion, s; the ensemble has further runs at the base's setting and times from
    moved starts; of ``every`` so many samples the first counts. ``n_first``: see `so_far`. ``gap_u`` is u of
    the gap that the channel follows, where available.
    """
    if runs.finer is None:
        return None

    def values(run: Table, name: str = name) -> Array:
        return run.values(name)[::every]

    time, base = runs.base.time[::every], values(runs.base)
    levels = RunValues(
        base,
        values(runs.finer),
        None if runs.coarser is None else values(runs.coarser),
        tuple(map(values, runs.perturbed_runs)),
        *runs.refinement,
        ensemble=tuple(map(values, ensemble)),
    )
    floor = round_off(base, time, runs.base.definitions[name], n_first)
    u = uncertainty(levels, windows(time, WINDOW * period), floor, whole=n_first is not None)
    axes = runs.base.definitions[name].gap
    if axes and {*axes} <= {*runs.base.names}:
        if gap_u is None or len(axes) > 1:
            parts = [model_uncertainty(runs, axis, period, ensemble, every, n_first) for axis in axes]
            gap_u = np.hypot.reduce([part for part in parts if part is not None])
        # The eccentricity of a journal is its clearance, the scale of both, where it touches.
        clearance = 0.0 if len(axes) == 1 else runs.base.definitions[axes[0]].given
        gap = np.abs(np.hypot.reduce([values(runs.base, axis) for axis in axes]) - clearance)
        touching = (base == 0.0) & (gap <= gap_u)
        u = np.where(touching, np.maximum(u, so_far(np.abs(base), n_first)), u)
    return u


def spread(original: Array, perturbed: Sequence[Array], half_width: int | Windows) -> Array:
    """Return 3 d_t, the distance of runs from neighbouring starts; shape (n,)."""
    farthest = np.max([np.abs(original - run) for run in perturbed], axis=0, initial=0.0)
    return SAFETY_FACTOR * _window_maximum(np.broadcast_to(farthest, original.shape), half_width)


def windows(time: Array, width: float) -> Windows:
    """Return the window of each sample, up to the first ones ``width`` (s) or more away on either side."""
    # A whole number of samples, whichever way times round.
    slack = 1e-7 * width + 4 * np.spacing(np.abs(time))
    first = np.searchsorted(time, time - width + slack, side="right") - 1
    return np.maximum(first, 0), np.searchsorted(time, time + width - slack)


def so_far(values: Array, n_first: int | None = None) -> Array:
    """Return the largest value up to each sample, shape (n,).

    The first ``n_first`` samples (None: all of them) share their largest value.
    """
    largest = np.maximum.accumulate(values)
    largest[:n_first] = largest[:n_first][-1]
    return largest


def _window_maximum(distance: Array, half_width: int | Windows) -> Array:
    """Return the largest distance within the window, shape (n,)."""
    if isinstance(half_width, int):
        return np.asarray(maximum_filter1d(distance, 2 * half_width + 1, mode="nearest"))
    ends = half_width[0], np.minimum(half_width[1] + 1, distance.size)
    return np.maximum.reduceat(np.append(distance, 0.0), np.column_stack(ends).ravel())[::2]


def combined(u_a: Array, u_b: Array) -> Array:
    """Return the uncertainty of a difference of independent results, sqrt(u_a^2 + u_b^2); shape (n,)."""
    return np.hypot(u_a, u_b)


def share_within(u: Array, error: float) -> float:
    """Return the share of the samples at which u is at most an error; 0 without samples."""
    return float(np.mean(u <= error)) if u.size else 0.0


def error_on(u: Array, share: float) -> float:
    """Return the smallest error that u keeps on a share of the samples."""
    return float(np.quantile(u, share, method="higher"))


def window_samples(period: float, interval: float) -> int:
    """Return the half-width of the window in samples; from the period and the distance of samples, s."""
    # The subtracted share keeps 1 % of 0.4 s at 0.4 ms at ten samples, whichever way the quotient rounds.
    return max(1, int(np.ceil(WINDOW * period / interval - 1e-6)))


def round_off(values: Array, time: Array, channel: Channel, n_first: int | None = None) -> Array:
    """Return the round-off of samples in double precision, in the channel's unit; shape (n,).

    The largest of: its absolute number (``channels.toml``), some epsilon, or half of the last digit that a
    table prints, of its largest value, and its change within the error of time (s); all but the first as far
    as `so_far` says.
    """
    rate = so_far(np.append(0.0, np.abs(np.diff(values) / np.diff(time))), n_first)
    time_error = TIME_ROUND_OFF * so_far(time - time[0], n_first)
    storage_error = max(ROUND_OFF, channel.rounding) * so_far(np.abs(values), n_first)
    return np.maximum(np.maximum(channel.round_off, storage_error), time_error * rate)


def observed_order(runs: Runs, samples_by_channel: Mapping[str, tuple[BoolArray, float]]) -> float:
    """Return the order at which the error of a model follows its setting, nan if unknown.

    With d_c and d_f the root mean squares of coarser minus base and of base minus finer, over the channel's
    scale, of the judged samples of all channels (name -> samples, shape (n,), and scale), it is log(d_c /
    d_f) / log(r): of runs in their asymptotic range, which located events and a tolerance need not have.
    """
    if runs.coarser is None or runs.finer is None:
        return nan
    coarse = fine = 0.0
    for name, (samples, scale) in samples_by_channel.items():
        coarser, base, finer = (run.values(name) for run in (runs.coarser, runs.base, runs.finer))
        if base.shape != samples.shape:  # it was interpolated
            return nan
        coarse += float(np.sum(((coarser - base)[samples] / scale) ** 2))
        fine += float(np.sum(((base - finer)[samples] / scale) ** 2))
    if not (coarse > 0.0 and fine > 0.0):
        return nan
    order = log(sqrt(coarse / fine)) / log(runs.refinement[0])
    return order if isfinite(order) else nan

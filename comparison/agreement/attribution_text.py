"""Sentences of an attribution."""

from __future__ import annotations

from dataclasses import dataclass
from math import floor, isnan

from comparison.accuracy.levels import AccuracyError, finer, solver_values
from comparison.accuracy.uncertainty import Runs
from comparison.agreement.event_description import describe
from comparison.agreement.results import Attribution
from comparison.scene import Scene

_CHANGED = 0.1  # of the difference: less is reported as a percentage, more as a factor
# Of the samples outside, near which a run must still move as far. Where a stiffness of 0.1 % makes the
# difference it is 65 % at the standard tier, whose band is not much narrower.
_SUSPECT = 0.9
_MOST = 0.5  # of the samples that are not predictable


@dataclass(frozen=True)
class _Refinement:
    """Description of the refinement of one side."""

    label: str
    setting: str
    """"exudyn's step (2e-06 s)"."""
    factor: float
    gain: float
    """Expected ratio of the errors of two levels."""

    def of(self, setting: str) -> str:
        """Return "halving exudyn's step (2e-06 s)"."""
        return f"halving {setting}" if self.factor == 2 else f"dividing {setting} by {self.factor:g}"


def sentences(
    found: Attribution,
    runs: tuple[Runs, Runs],
    *,
    labels: tuple[str, str],
    scene: Scene | None,
    tier: str,
) -> tuple[str, ...]:
    """Return the sentences of an attribution, most important first; empty if it is empty.

    Parameters
    ----------
    found
        The numbers.
    runs, labels, scene, tier
        As in `comparison.agreement.attribution.attribute`.
    """
    outside = ""
    if found.outside_in:
        events = {label: of.base.events for label, of in zip(labels, runs, strict=True)}
        period, record = (None, None) if scene is None else (scene.period, scene.data)
        instant = describe(found.outside_from, events, period=period, scene=record)
        outside = f"{found.outside_in} at {instant}"
    if scene is None or isnan(found.explained):
        limit = "band" if all(of.finer is not None for of in runs) else "tolerance"
        return (f"first outside the {limit}: {outside}",) if outside else ()
    sides = [_refinement(label, of, scene) for label, of in zip(labels, runs, strict=True)]
    sentences = [_of_cause(found, sides)] if found.cause else []
    if outside:
        sentences.append(f"first outside the band: {outside}")
    sentences += [
        f"but near {found.still_moves[key]:.0%} of the samples outside {side.label} still changes under "
        "refinement by as much as the difference: its uncertainty may be underestimated"
        for key, side in zip("ab", sides, strict=True)
        if found.still_moves.get(key, 0.0) >= _SUSPECT
    ]
    if found.unpredictable:
        sentences.append(_of_coverage(found, labels) + _advice(found, labels, scene, tier))
    return tuple(sentences)


def percent(share: float) -> str:
    """Return a share as percent with two decimals, truncated: "100.00%" only for all."""
    return f"{floor(share * 10000 + 1e-8) / 100:.2f}%"


def _of_cause(found: Attribution, sides: list[_Refinement]) -> str:
    left = found.remaining
    first, second = (
        f"{side.of(side.setting)} {_effect(left[key], side.gain)}"
        for key, side in zip("ab", sides, strict=True)
    )
    both = f"both together {_effect(left['both'], min(side.gain for side in sides))}"
    if left["both"] > 1 + _CHANGED:
        both += "; it grows, as accumulated round-off does with more steps"
    if found.cause in {"a", "b"}:
        chief, other = (sides[0], second) if found.cause == "a" else (sides[1], first)
        effect = _effect(left[found.cause], chief.gain, "the difference")
        return f"explained by {chief.setting}: {chief.of('it')} {effect}; {other}"
    return {
        "round-off": "at round-off: no setting has an effect",
        "both": f"both contribute: {first}, {second}, {both}",
        "neither": f"within the uncertainty, but not resolved by refinement: {first}, {second}, {both}",
        "models": f"difference of models: no refinement removes it ({first}, {second})",
    }[found.cause]


def _effect(remaining: float, gain: float, what: str = "it") -> str:
    if remaining <= 1 - _CHANGED:
        return f"divides {what} by {1 / remaining if remaining else float('inf'):.2g} ({gain:.3g} expected)"
    if abs(remaining - 1) < 5e-4:
        return f"changes {what} by less than 0.1%"
    return f"changes {what} by {remaining - 1:+.1%}"


def _refinement(label: str, of: Runs, scene: Scene) -> _Refinement:
    """Describe the setting that a level changes, and those changed along with it."""
    factor = of.refinement[0]
    refined = finer(label, scene)
    if refined is None:
        return _Refinement(label, f"{label}'s setting", factor, of.gain)
    old, new = (which.data["solver"][label] for which in (scene, refined))
    ratios = {key: old[key] / new[key] for key in old if isinstance(old[key], float) and old[key] != new[key]}
    chief = min(ratios, key=lambda key: abs(ratios[key] - factor))
    along = "".join(f"; with its {key}, {old[key]:g}" for key in ratios if key != chief)
    value = f"{old[chief]:g}{' s' if chief == 'step' else ''}"
    return _Refinement(label, f"{label}'s {chief} ({value}{along})", factor, of.gain)


def _of_coverage(found: Attribution, labels: tuple[str, str]) -> str:
    """State whose uncertainty makes samples of the indeterminate channels unpredictable."""
    whose = {
        "a": f"the uncertainty of {labels[0]} alone",
        "b": f"the uncertainty of {labels[1]} alone",
        "each": "the uncertainty of each model by itself",
        "together": "only both uncertainties together",
    }
    shares = sorted(((found.unpredictable[key], words) for key, words in whose.items()), reverse=True)
    (chief, words), *others = [item for item in shares if item[0] >= 0.005]
    rest = f" ({', '.join(f'{words} {share:.0%}' for share, words in others)})" if others else ""
    return (
        f"of the samples that are not predictable in the indeterminate channels, {words} makes "
        f"{chief:.0%} so, from {found.unpredictable_from:.4g} s on{rest}"
    )


def _advice(found: Attribution, labels: tuple[str, str], scene: Scene, tier: str) -> str:
    """State whether finer settings can help: not where neighbouring trajectories diverge too far."""
    neighbours = found.unpredictable["neighbours"]
    if neighbours >= _MOST:
        return (
            f"; for {neighbours:.0%} of them the spread of neighbouring starts suffices, whatever the setting"
        )
    shares = found.unpredictable
    limiting = [
        label for key, label in zip("ab", labels, strict=True) if shares[key] == max(shares[k] for k in "ab")
    ]
    # The tight tier has its own settings, independent of --accuracy.
    return (
        "; try --accuracy strict" if tier == "standard" and any(_coarse(x, scene) for x in limiting) else ""
    )


def _coarse(model: str, scene: Scene) -> bool:
    """Return whether a built-in model runs at a setting coarser than strict."""
    settings = scene.data["solver"].get(model, {})
    try:
        strict = solver_values(model, "strict", scene)
    except AccuracyError:
        return False
    return all(settings[key.rpartition(".")[2]] > value for key, value in strict.items())

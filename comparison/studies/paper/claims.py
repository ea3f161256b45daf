"""The statements of the paper's text, each decided by both models: supported, contradicted or undecided."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.resources import files
from typing import Any

from comparison.execution.job import MODELS
from comparison.studies.paper import dynamics, trends
from comparison.studies.paper.decision import UNDECIDED, Decision
from comparison.studies.paper.runs import Runs

Claim = Mapping[str, Any]

TESTS: dict[str, Callable[[Runs, str, Claim], Decision]] = {
    "larger": trends.larger,
    "alike": trends.alike,
    "more_contacts": trends.more_contacts,
    "less_reliable": trends.less_reliable,
    "close": dynamics.close,
    "contacts": dynamics.contacts_at_the_bottom,
    "traversals": dynamics.traversals,
    "recurring": dynamics.recurring,
    "scattered": dynamics.scattered,
    "sensitive": dynamics.sensitive,
    "periodic": dynamics.periodic,
    "two_codes": dynamics.two_codes,
    "pin_zones": dynamics.pin_zones,
}


@dataclass(frozen=True)
class Judged:
    """One statement."""

    claim: Claim
    decisions: Mapping[str, Decision]

    @property
    def verdict(self) -> str:
        """What both models say; undecided where they say different things."""
        verdicts = {decision.verdict for decision in self.decisions.values()}
        return verdicts.pop() if len(verdicts) == 1 else UNDECIDED


def all_claims() -> list[Claim]:
    """Return the entries of ``paper/claims.toml``."""
    text = files("comparison.studies.paper").joinpath("claims.toml").read_text("utf-8")
    claims: list[Claim] = tomllib.loads(text)["claim"]
    return claims


def judge_all(runs: Runs) -> list[Judged]:
    """Decide every statement by both models."""
    return [
        Judged(claim, {model: TESTS[claim["test"]](runs, model, claim) for model in MODELS})
        for claim in all_claims()
    ]

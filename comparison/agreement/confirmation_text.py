"""One-sentence summary of the confirmation of a verdict "differ"."""

from __future__ import annotations

from math import isfinite, isnan

from comparison.agreement.results import SUSPICIOUS, Confirmation
from comparison.metrics.outliers import Parting
from comparison.tables.channels import CONTACTS, PIN


def sentence(found: Confirmation, labels: tuple[str, str], why: str = "") -> str:
    """Return the sentence, without a full stop.

    Parameters
    ----------
    found
        Everything but the sentence.
    labels
        Of the two models.
    why
        Of one that is unconfirmed.
    """
    since = "" if isnan(found.since) else f" from {found.since:.4g} s on"
    if found.outcome == "unconfirmed":
        fewest = min((count for count in found.members if count), default=0)
        return f"differ (unconfirmed, {fewest} runs){since}: {why}"
    return (
        _confirmed(found, labels, since)
        if found.outcome == "confirmed"
        else _underestimated(found, labels, since)
    )


def _confirmed(found: Confirmation, labels: tuple[str, str], since: str) -> str:
    each = "each model's run is outside those of the other"
    if 0 in found.members:
        host, guest = labels if found.members[0] else labels[::-1]
        each = f"the {guest} run is outside those of {host}"
    runs = " and ".join(
        f"{count} {label}" for count, label in zip(found.members, labels, strict=True) if count
    )
    text = f"difference confirmed{since} by {runs} runs from moved starts: {each}"
    if isfinite(found.excess):  # not where all members are one
        text += f", {found.excess:.3g} times as far as the farthest of these"
    return f"{text}; they are first separated by {found.contact}" if found.contact else text


def _underestimated(found: Confirmation, labels: tuple[str, str], since: str) -> str:
    inside = " and ".join(
        f"{count} of {members} {host} runs from moved starts are as far out as the {guest} run"
        for count, members, host, guest in zip(
            found.farther, found.members, labels, labels[::-1], strict=True
        )
        if count
    )
    text = (
        "no difference of models, the uncertainty was underestimated by a factor "
        f"{found.factor:.2g}{since}: {inside}"
    )
    if not found.suspicious:
        return text
    kind = "they split into clusters" if found.clustered else f"a factor above {SUSPICIOUS:g}"
    contact = found.contact or "no single contact"
    return f"{text}; {kind}, which indicates a discontinuous event, possibly an intermittent fault: {contact}"


def contact_words(parting: Parting, labels: tuple[str, str]) -> str:
    """Return "the contact of the upper left corner at 0.2454 s, which occurs in 3 of 99 reference runs".

    Parameters
    ----------
    parting
        The contact.
    labels
        Whose runs each group holds; twice the same of two parts of one ensemble.
    """
    corner = CONTACTS.get(parting.corner, parting.corner) + ("" if parting.corner == PIN else " corner")
    counts = list(zip(parting.having, parting.sizes, labels, strict=True))
    if labels[0] == labels[1]:
        counts = [(sum(parting.having), sum(parting.sizes), labels[0])]
    had = " and ".join(f"{having} of {size} {label} runs" for having, size, label in counts)
    return f"the contact of the {corner} at {parting.start:.6g} s, which occurs in {had}"

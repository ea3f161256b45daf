"""Two results judged: the door to `comparison.agreement.compare`."""

from comparison.agreement.compare import Runs, compare

__all__ = ["Runs", "compare"]

"""Floating point of a run: its numbers, and heyoka's options for it."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import heyoka as hy
import numpy as np

DOUBLE, QUADRUPLE = 53, 113


class Arithmetic(NamedTuple):
    """Numbers with a significand of so many bits."""

    number: Callable[[Any], Any]
    """From a float or an integer, exactly."""
    options: dict[str, Any]
    """Keyword arguments of heyoka's integrators and compiled functions."""

    @classmethod
    def of(cls, bits: int) -> "Arithmetic":
        """Return the arithmetic with a significand of at least 53 bits."""
        if bits == DOUBLE:
            return cls(float, {"fp_type": float})
        if bits == QUADRUPLE:
            return cls(hy.real128, {"fp_type": hy.real128})
        return cls(lambda value: hy.real(value, bits), {"fp_type": hy.real, "prec": bits})

    def array(self, values: Any) -> Any:
        """Return an array of these numbers."""
        flat = np.array([self.number(value) for value in np.ravel(np.asarray(values, dtype=object))])
        return flat.reshape(np.shape(values))

    def exact(self, value: Any) -> Any:
        """Return a scene, or a part of one, with these numbers in it."""
        if isinstance(value, Mapping):
            return {key: self.exact(each) for key, each in value.items()}
        if isinstance(value, list | tuple):
            return [self.exact(each) for each in value]
        return self.number(value) if type(value) in (int, float) else value

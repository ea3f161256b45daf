from reference_model.compiled import inlined
import math


@inlined
def cos_sin(angle: float) -> tuple[float, float]:
    return math.cos(angle), math.sin(angle)

"""Checks of single values at the edge."""

import math
from typing import Any

from core.errors import InputError


def checked_number(field: str, value: Any, low: float, high: float, unit: str = "") -> float:
    """``value`` as a finite float in [low, high], or an `InputError` naming the field."""
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise InputError(field, f"must be a number, got {value!r}") from None
    if not math.isfinite(number) or not low <= number <= high:
        where = f"{low:g} to {high:g} {unit}".rstrip()
        raise InputError(field, f"must lie in {where}, got {value}")
    return number

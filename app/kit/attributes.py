"""HTML attributes whose names Python cannot spell."""

from typing import Any


def attributes(**named: str | None) -> dict[str, Any]:
    """``aria_label="Run"`` as ``{"aria-label": "Run"}``, to be passed on by ``**``."""
    return {name.replace("_", "-"): value for name, value in named.items()}

"""Checkpoints of a training, so that one that was interrupted goes on where it stopped."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import torch

from core.files import whole_file


def write_checkpoint(path: Path, identity: Any, state: Mapping[str, Any]) -> None:
    """Write ``state`` and whose it is, whole or not at all; raises `StoreError`."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with whole_file(path) as temporary:
        torch.save({"identity": identity, **state}, temporary)


def read_checkpoint(
    path: Path, identity: Any, device: torch.device | None = None
) -> dict[str, Any] | None:
    """The state written there; None where there is none, or another training's."""
    if not path.exists():
        return None
    state: dict[str, Any] = torch.load(path, weights_only=True, map_location=device)
    return state if state["identity"] == identity else None

"""Models of lab and field, each in both."""

from types import SimpleNamespace
from typing import cast

import pytest

from core.channels import N_CHANNELS
from core.diagnosis.features import Inputs
from core.diagnosis.predict import Diagnoser
from core.experiments.models.cross import _rows


@pytest.mark.parametrize(
    ("inputs", "rows"),
    [("both", [4, 4 + N_CHANNELS]), ("residuals", [4]), ("states", [4])],
)
def test_a_channel_is_found_in_what_the_classifier_is_shown(
    inputs: Inputs, rows: list[int]
) -> None:
    diagnoser = cast("Diagnoser", SimpleNamespace(inputs=inputs))
    assert _rows(4, diagnoser) == rows

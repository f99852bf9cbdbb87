"""What a text mentions: every channel has words, and moments are read as they are printed."""

import pytest

from core.channels import CHANNEL_NAMES, CHANNELS, unit_label
from core.clock import clock
from core.cylinders import CYLINDERS, LAYOUT
from core.errors import InputError
from core.report.case.wording import bank_name, cylinder_name
from core.report.check.mentions import (
    CHANNEL_WORDS,
    channel_mentions,
    channel_patterns,
    cylinder_mentions,
    quantities,
    time_mentions,
)


@pytest.mark.parametrize("channel", CHANNELS, ids=CHANNEL_NAMES)
def test_a_channel_is_read_by_its_label_and_its_unit(channel: object) -> None:
    label, unit = channel.label, channel.unit  # type: ignore[attr-defined]
    read = {mention.channels for mention in channel_mentions(f"{label} moved.")}
    assert read == {(channel.name,)}  # type: ignore[attr-defined]
    (number,) = quantities(f"It moved by 12.5 {unit_label(unit)}.", ())
    assert (number.low, number.unit) == (12.5, unit)


def test_a_channel_without_words_and_words_without_a_channel_are_refused() -> None:
    for name in CHANNEL_WORDS:
        forgotten = {key: words for key, words in CHANNEL_WORDS.items() if key != name}
        with pytest.raises(InputError, match=name):
            channel_patterns(forgotten)
    with pytest.raises(InputError, match="E1 MAP"):
        channel_patterns({**CHANNEL_WORDS, "E1 MAP": "manifold pressure"})


@pytest.mark.parametrize("time_s", [0.0, 75.0, 3599.0, 3661.0, 7200.0])
def test_a_moment_is_read_as_it_is_printed(time_s: float) -> None:
    (mention,) = time_mentions(f"Repaired at {clock(time_s)}: nothing later is evidence.")
    assert mention.time_s == time_s


@pytest.mark.parametrize("cylinder", CYLINDERS)
def test_cylinders_are_read_by_number_and_place(cylinder: int) -> None:
    said = cylinder_mentions(f"It sits {LAYOUT[cylinder].name}, at cylinder {cylinder}.", ())
    assert [mention.cylinders for mention in said] == [(cylinder,), (cylinder,)]
    assert cylinder_name(cylinder) == f"cylinder {cylinder} ({LAYOUT[cylinder].name})"


def test_a_bank_is_named_by_its_side_and_its_cylinders() -> None:
    assert bank_name(3) == "right bank (cylinders 1 and 3)"
    assert bank_name(4) == "left bank (cylinders 2 and 4)"

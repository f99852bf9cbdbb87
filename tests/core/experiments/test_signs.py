"""The sign matrix: the reference carried over faithfully, judged correctly, and held."""

import csv
from pathlib import Path

import numpy as np
import pytest

from core.channels import CHANNEL_INDEX, N_CHANNELS, channel
from core.clock import DT_S
from core.errors import InputError
from core.experiments.signs.signatures import (
    Dispute,
    Expected,
    Signatures,
    read_signatures,
    signatures,
)
from core.experiments.signs.signs import CLEAR, SIGNS_ONSET_S, fly_shifts, judge, run, shift
from core.fmea.catalogue import class_ids
from core.paths import DATA, ROOT
from core.twin.plan import Plan

FACTS = ROOT / "assets" / "facts"


def test_the_reference_is_that_of_the_fact_sheets():
    with (FACTS / "fault_magnitudes.csv").open() as file:
        magnitudes = {
            (row["fault"], row["channel"]): Expected(
                row["sign"], float(row["delta_lo"]), float(row["delta_hi"])
            )
            for row in csv.DictReader(file)
        }
    ours = {
        (mode, name): entry
        for mode, entries in signatures().expected.items()
        for name, entry in entries.items()
    }
    for mode, name in magnitudes:
        assert ours[mode, name] == magnitudes[mode, name], (mode, name)
    with (FACTS / "sign_matrix.csv").open() as file:
        for row in csv.DictReader(file):
            for name in signatures().channels:
                assert ours[row["fault"], name].sign == row[name]


def _judged(expected: Expected, shifts: list[float], dispute: Dispute | None = None):
    """The row of one mode and one channel (RPM, which wanders by 5.2 rpm) for given shifts."""
    reference = Signatures(
        ("E1 RPM",),
        {"engine_overspeed": {"E1 RPM": expected}},
        {("engine_overspeed", "E1 RPM"): dispute} if dispute else {},
        {},
    )
    flown = {}
    for severity, value in zip((0.3, CLEAR, 1.0), shifts, strict=True):
        plans = np.zeros((2, N_CHANNELS))
        plans[:, CHANNEL_INDEX["E1 RPM"]] = value - 1.0, value + 1.0
        flown[severity] = plans
    (row,) = judge(reference, {"engine_overspeed": flown})
    return row


@pytest.mark.parametrize(
    ("sign", "shifts", "held", "within"),
    [
        ("+", [240.0, 300.0, 380.0], True, True),
        ("+", [236.0, 300.0, 384.0], True, True),  # the range, give or take the wander
        ("+", [230.0, 300.0, 380.0], True, False),
        ("+", [240.0, 5.0, 380.0], False, False),  # within the wander is no shift
        ("-", [240.0, 300.0, 380.0], False, True),
        ("-", [-50.0, -6.0, -80.0], True, False),
        ("0", [0.0, 300.0, 380.0], True, False),
        ("0", [240.0, 400.0, 380.0], False, False),
        ("~", [240.0, 300.0, 380.0], None, True),
    ],
)
def test_an_entry_is_judged_by_sign_and_range(sign, shifts, held, within):
    assert 5.0 < channel("E1 RPM").sigma < 6.0
    row = _judged(Expected(sign, 240.0, 380.0), shifts)
    assert (row.held, row.within) == (held, within)
    assert row.delta == shifts[1]
    assert (row.plans_low, row.plans_high) == (shifts[1] - 1.0, shifts[1] + 1.0)
    assert (row.disputed, row.stands) == (None, None)


def test_a_disputed_entry_is_judged_like_any_other_and_by_our_own_range():
    row = _judged(Expected("0", 0.0, 0.0), [20.0, 40.0, 50.0], Dispute("why", 20.0, 50.0))
    assert (row.held, row.within, row.disputed, row.stands) == (False, False, "why", True)
    row = _judged(Expected("0", 0.0, 0.0), [20.0, 40.0, 70.0], Dispute("why", 20.0, 50.0))
    assert row.stands is False


def test_each_mode_is_measured_where_it_shows():
    seconds = np.arange(0.0, 300.0, DT_S) - SIGNS_ONSET_S
    ramp = np.repeat(seconds[:, None], N_CHANNELS, axis=1)
    assert shift("baffle_crack", ramp) == pytest.approx(240.0, abs=0.1)
    assert shift("engine_failure", ramp) == pytest.approx(90.0, abs=0.1)
    pulse = np.where((ramp > 40.0) & (ramp < 60.0), -7.0, 0.5)
    assert shift("inflight_anomaly", pulse) == pytest.approx(-7.0)


def test_signs_hold_on_a_plan_that_no_constant_was_fitted_to():
    """Every `+`, `-` and `0`, or our reasoned dispute; flown clear, on one plan."""
    reference = signatures()
    shifts = fly_shifts([Plan.sampled(20_261_123)], class_ids(), (CLEAR,))
    rows = judge(reference, shifts)
    assert len(rows) == len(class_ids()) * len(reference.channels)
    wrong = [row for row in rows if row.held is False and not row.stands]
    assert wrong == []


@pytest.mark.slow
def test_the_experiment_counts_what_its_rows_say():
    result = run(True, lambda share: None).to_dict()
    rows = result["rows"]
    counted = [row for row in rows if row["expected"] != "~"]
    assert result["of"] == len(counted)
    assert result["held"] == sum(row["held"] for row in counted)
    assert result["magnitudes_within"] == sum(row["within"] for row in counted)
    assert (result["settings"]["conditions"], result["settings"]["power"]) == ("lab", "fixed")
    for row in counted:
        assert row["held"] or row["stands"], row
        assert row["within"] or row["stands"] or _barely_outside(row), row


def _barely_outside(row) -> bool:
    """By no more than a tenth of the range: its ends are round numbers."""
    margin = 0.1 * (row["high"] - row["low"]) + row["resolution"]
    return all(
        row["low"] - margin <= value <= row["high"] + margin
        for value in row["deltas_by_severity"].values()
    )


def test_every_dispute_concerns_an_entry_of_the_matrix_and_says_why():
    for (mode, name), dispute in signatures().disputed.items():
        assert len(dispute.reason) > 40, (mode, name)
        entry = signatures().expected[mode][name]
        assert (dispute.low, dispute.high) != (entry.low, entry.high)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[differs.baffle_seal]", "[differs.bafle_seal]", "unknown: 'bafle_seal'"),
        ('"E1 CHT3" = ["+", 5.0, 17.0]', '"E1 CHC3" = ["+", 5.0, 17.0]', "unknown: 'E1 CHC3'"),
        ('["+", 5.0, 17.0]', '["plus", 5.0, 17.0]', "must be"),
        ('["+", 5.0, 17.0]', '["+", 17.0, 5.0]', "needs low <= high"),
        ('["+", 5.0, 17.0]', '["+", "five", 17.0]', "needs two numbers"),
        ('= "worst"', '= "worse"', "unknown: 'worse'"),
        ("engine_overspeed = [12.0, 19.0]", "engine_overspeeed = [1.0, 2.0]", "unknown"),
        ("channels = [", "channel = [", "channels: is missing"),
        ("[differs.baffle_seal]", "[differs.baffle_seal", "signatures:"),
    ],
)
def test_a_bad_reference_is_named(tmp_path: Path, old: str, new: str, message: str):
    good = (DATA / "fmea" / "signatures.toml").read_text(encoding="utf-8")
    assert old in good
    path = tmp_path / "signatures.toml"
    path.write_text(good.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(InputError, match=message):
        read_signatures(path)

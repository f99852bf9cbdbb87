"""A flight as a G1000 log: laid out as the device does it, and read back as it was flown."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from jobs_support import CRACK, SHORT_PLAN

from core.channels import CHANNEL_NAMES
from core.errors import InputError
from core.exchange.g1000_writer import COLUMN_NAMES, HOME_DEG, SIDES, g1000_csv
from core.exchange.log_files import LOGS, read_log
from core.store.records import RunRecord
from core.twin.trajectory import STATE_NAMES, Pair, Trajectory

RECORD = RunRecord(
    "20261123T061500-k3x9q2wz", "2026-11-23T23:59:58.400000+00:00", "done", SHORT_PLAN, CRACK,
    code_version="0.1.0 (commit x, twin y)",
)  # fmt: skip


def rows_of(text: str) -> list[list[str]]:
    """Every line below the three of the head, as cells."""
    return [[cell.strip() for cell in line.split(",")] for line in text.splitlines()[3:]]


def test_it_is_laid_out_as_the_device_does_it(short_pair: Pair) -> None:
    lines = g1000_csv(RECORD, short_pair.faulted, side="faulted").split("\r\n")
    assert lines[0].startswith('#airframe_info, log_version="1.00", airframe_name="Cessna 172P"')
    assert lines[1].startswith("#yyy-mm-dd, hh:mm:ss,   hh:mm,")
    assert [name.strip() for name in lines[2].split(",")] == list(COLUMN_NAMES)
    assert len(COLUMN_NAMES) == len(set(COLUMN_NAMES)) == 64
    widths = {tuple(map(len, line.split(", "))) for line in lines[1:-1]}
    assert len(widths) == 1
    assert len(lines) - 4 == SHORT_PLAN.duration_s


@pytest.mark.skipif(not LOGS.is_dir(), reason="no real logs here")
def test_its_head_is_that_of_a_real_log(short_pair: Pair) -> None:
    real = (LOGS / "c172s-g1000-20110701.csv").read_text().splitlines()
    ours = g1000_csv(RECORD, short_pair.faulted, side="faulted").splitlines()
    assert ours[1:3] == real[1:3]


def test_the_flight_is_read_back_as_it_was_flown(short_pair: Pair, tmp_path: Path) -> None:
    for side in SIDES:
        flight = getattr(short_pair, side)
        path = tmp_path / "log.csv"
        path.write_text(g1000_csv(RECORD, flight, side=side), newline="")
        log = read_log(path)
        assert log.missing == ()
        assert (log.reading.simulated, log.reading.aircraft) == (True, "Cessna 172P")
        assert log.reading.converted == log.reading.dropped == log.reading.doubts == ()
        assert np.array_equal(log.time_s, np.arange(SHORT_PLAN.duration_s))
        for name in CHANNEL_NAMES:
            decimals = 1 if name in ("volt1", "volt2", "amp1", "amp2", "OAT", "AltMSL") else 2
            tolerance = 0.51 * (0.1 if name == "E1 RPM" else 10.0**-decimals)
            assert np.allclose(log.channel(name), flight.channel(name)[::50], 0.0, tolerance), name


def test_the_two_flights_of_a_run_are_two_systems(short_pair: Pair) -> None:
    heads = {
        side: g1000_csv(RECORD, getattr(short_pair, side), side=side).splitlines()[0]
        for side in SIDES
    }
    for side, head in heads.items():
        assert f'system_id="{RECORD.id}-{side}"' in head
        assert "mode=SIMULATED" in head


def test_position_and_speed_agree_with_each_other(short_pair: Pair) -> None:
    rows = rows_of(g1000_csv(RECORD, short_pair.mirror, side="mirror"))
    column = {name: [row[place] for row in rows] for place, name in enumerate(COLUMN_NAMES)}
    assert [row[:2] for row in rows[:3]] == [
        ["2026-11-23", "23:59:58"], ["2026-11-23", "23:59:59"], ["2026-11-24", "00:00:00"],
    ]  # fmt: skip
    first, last = float(column["Latitude"][0]), float(column["Latitude"][-1])
    assert first == pytest.approx(HOME_DEG[0], abs=1e-6)
    speed_kt = np.mean([float(value) for value in column["GndSpd"]])
    if SHORT_PLAN.heading_deg == 0.0:
        assert (last - first) * 3600.0 * 60.0 / (len(rows) - 1) == pytest.approx(speed_kt, abs=0.5)
    assert float(column["TAS"][5]) > float(column["IAS"][5])
    assert set(column["COM1"]) == {""}


@pytest.mark.parametrize("rate_hz", [0, 3, -1, 51, 1.5])
def test_an_impossible_rate_is_named(short_pair: Pair, rate_hz: int) -> None:
    with pytest.raises(InputError) as caught:
        g1000_csv(RECORD, short_pair.faulted, rate_hz, side="faulted")
    assert caught.value.field == "rate"


def test_a_higher_rate_tells_its_times_apart(short_pair: Pair, tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text(g1000_csv(RECORD, short_pair.faulted, 5, side="faulted"), newline="")
    log = read_log(path)
    assert len(log) == 5 * SHORT_PLAN.duration_s
    assert np.allclose(np.diff(log.time_s), 0.2)


@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 120), holes=st.booleans())
@settings(max_examples=30, deadline=None)
def test_whatever_was_flown_is_written_in_whole_lines(seed: int, n: int, holes: bool) -> None:
    rng = np.random.default_rng(seed)
    states = rng.normal(0.0, 1e4, (n, len(STATE_NAMES)))
    channels = rng.normal(0.0, 1e3, (n, len(CHANNEL_NAMES))).astype(np.float32)
    if holes:
        channels[rng.random(channels.shape) < 0.2] = np.nan
    flight = Trajectory(np.arange(n) * 0.02, states, channels)
    with np.errstate(invalid="ignore"):
        rows = rows_of(g1000_csv(RECORD, flight, 50, side="mirror"))
    assert len(rows) == n
    for row, values in zip(rows, channels, strict=True):
        cells = dict(zip(COLUMN_NAMES, row, strict=True))
        for name, value in zip(CHANNEL_NAMES, values, strict=True):
            assert (cells[name] == "") == bool(np.isnan(value))
            assert cells[name] == "" or float(cells[name]) == pytest.approx(value, abs=0.06)

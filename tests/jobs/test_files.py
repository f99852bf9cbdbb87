"""Flights in Parquet, and files written whole or not at all."""

import resource
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from core.channels import CHANNELS
from core.errors import StoreError
from core.jobs.files import (
    read_pair,
    read_trajectory,
    whole_file,
    write_pair,
    write_trajectory,
)
from core.twin.trajectory import STATE_NAMES, Pair, Trajectory


def assert_same(read: Trajectory, written: Trajectory) -> None:
    """Equal bit for bit, types included."""
    for name in ("time_s", "states", "channels"):
        ours, theirs = getattr(read, name), getattr(written, name)
        assert (ours.dtype, ours.shape) == (theirs.dtype, theirs.shape), name
        assert ours.tobytes() == np.ascontiguousarray(theirs).tobytes(), name


def test_a_pair_is_read_back_bit_for_bit(tmp_path: Path, short_pair: Pair) -> None:
    write_pair(tmp_path / "run.parquet", short_pair)
    pair = read_pair(tmp_path / "run.parquet")
    assert_same(pair.faulted, short_pair.faulted)
    assert_same(pair.mirror, short_pair.mirror)


def test_a_trajectory_keeps_odd_numbers(tmp_path: Path, short_pair: Pair) -> None:
    channels = short_pair.faulted.channels.copy()
    channels[:5, 0] = [np.nan, np.inf, -np.inf, -0.0, np.float32(1e-45)]
    odd = Trajectory(short_pair.faulted.time_s, short_pair.faulted.states, channels)
    write_trajectory(tmp_path / "odd.parquet", odd)
    assert_same(read_trajectory(tmp_path / "odd.parquet"), odd)


def test_what_is_read_can_be_changed(tmp_path: Path, short_pair: Pair) -> None:
    write_trajectory(tmp_path / "run.parquet", short_pair.mirror)
    flight = read_trajectory(tmp_path / "run.parquet")
    flight.time_s[0] = flight.states[0, 0] = flight.channels[0, 0] = 1.0


def test_the_same_flight_gives_the_same_bytes(tmp_path: Path, short_pair: Pair) -> None:
    write_pair(tmp_path / "a.parquet", short_pair)
    write_pair(tmp_path / "b.parquet", short_pair)
    assert (tmp_path / "a.parquet").read_bytes() == (tmp_path / "b.parquet").read_bytes()


def test_columns_carry_names_units_and_types(tmp_path: Path, short_pair: Pair) -> None:
    write_trajectory(tmp_path / "run.parquet", short_pair.faulted)
    schema = pq.read_schema(tmp_path / "run.parquet")
    assert schema.names == ["time_s", *STATE_NAMES, *(channel.name for channel in CHANNELS)]
    for channel in CHANNELS:
        column = schema.field(channel.name)
        assert column.metadata[b"unit"].decode() == channel.unit
        assert column.type == pa.float32()


def test_what_is_not_a_flight_is_refused_by_name(tmp_path: Path, short_pair: Pair) -> None:
    text, table, other = (tmp_path / name for name in ("text", "table", "trajectory"))
    text.write_text("time_s,volt1\n")
    pq.write_table(pa.table({"time_s": ["noon"]}), table)
    write_trajectory(other, short_pair.mirror)
    for path in (text, table, other, tmp_path / "missing", tmp_path):
        with pytest.raises(StoreError, match=str(path)):
            read_pair(path)


def test_an_interrupted_write_leaves_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "kept.txt"
    path.write_text("old")
    with pytest.raises(KeyboardInterrupt), whole_file(path) as temporary:
        temporary.write_text("half of the n")
        raise KeyboardInterrupt
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_disk_that_takes_no_more_leaves_the_old_file(tmp_path: Path, short_pair: Pair) -> None:
    path = tmp_path / "run.parquet"
    write_pair(path, short_pair)
    before = path.read_bytes()
    with _largest_file(len(before) // 2), pytest.raises(StoreError) as caught:
        write_pair(path, short_pair)
    assert str(tmp_path) in str(caught.value)
    assert "Nothing stored was changed" in str(caught.value)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


@contextmanager
def _largest_file(n_bytes: int) -> Iterator[None]:
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (n_bytes, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))

"""Flights in Parquet, and files written whole or not at all."""

import resource
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from core.channels import CHANNELS
from core.errors import StoreError
from core.files import check_seal, has_its_sum, read_json, sealed, whole_file, write_json, write_sum
from core.twin.flight_file import (
    read_channels,
    read_columns,
    read_pair,
    read_trajectory,
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


# -- files from anywhere, and files that have gone bad -------------------------------------------


def rewritten(path: Path, change: Callable[[pa.Table], pa.Table], **options: Any) -> Path:
    """The file with another table in it."""
    table = change(pq.read_table(path))
    pq.write_table(table, path, **{"compression": "zstd", **options})
    return path


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda t: t.append_column("x", pa.array(["x" * 2000] * len(t)).dictionary_encode()),
         "column 'x' that no flight has"),
        (lambda t: t.append_column("volt1", t["mirror.volt1"]), "'volt1' that no flight has"),
        (lambda t: t.append_column("time_s", t["time_s"]), "a column twice"),
        (lambda t: t.drop_columns(["mirror.E1 RPM"]), "no column 'mirror.E1 RPM'"),
        (lambda t: t.set_column(0, "time_s", t["time_s"].cast(pa.float32())),
         "has float in column 'time_s', which must be double"),
        (lambda t: t.set_column(0, "time_s", t["time_s"].cast(pa.string())),
         "has string in column 'time_s', which must be double"),
        (lambda t: t[:0], "has 0 samples"),
        (lambda t: pa.concat_tables([t] * 200), "has 400000 samples"),
    ],
)  # fmt: skip
def test_a_file_with_other_columns_types_or_rows_is_refused_by_name(
    tmp_path: Path, short_pair: Pair, change: Callable[[pa.Table], pa.Table], said: str
) -> None:
    path = tmp_path / "run.parquet"
    write_pair(path, short_pair)
    rewritten(path, change)
    asks: tuple[Callable[[], object], ...] = (
        lambda: read_pair(path),
        lambda: read_columns(path, ["time_s"]),
        lambda: read_channels(path, 0.0, 1.0),
    )
    for ask in asks:
        with pytest.raises(StoreError, match="is not a flight of this version") as caught:
            ask()
        assert said in str(caught.value)


def test_other_columns_are_not_even_read(tmp_path: Path, short_pair: Pair) -> None:
    """One value of 1 MB, numbered in every row, is 2.7 MB in the file and gigabytes in memory."""
    path = tmp_path / "run.parquet"
    write_pair(path, short_pair)
    numbers = pa.array(np.zeros(len(short_pair.faulted), np.int32))
    big = pa.DictionaryArray.from_arrays(numbers, pa.array(["x" * (1 << 20)]))
    rewritten(path, lambda table: table.append_column("big", big), store_schema=False)
    before = pa.total_allocated_bytes()
    with pytest.raises(StoreError, match="'big' that no flight has"):
        read_pair(path)
    assert pa.total_allocated_bytes() == before
    assert pa.default_memory_pool().max_memory() < 1 << 30


def test_a_footer_that_alone_fills_the_memory_is_not_parsed(
    tmp_path: Path, short_pair: Pair
) -> None:
    path = tmp_path / "run.parquet"
    write_pair(path, short_pair)
    rewritten(path, lambda table: table.replace_schema_metadata({"x": "x" * (3 << 20)}))
    with pytest.raises(StoreError, match="describes more than a flight has"):
        read_pair(path)


def test_a_file_that_was_read_and_written_elsewhere_is_still_a_flight(
    tmp_path: Path, short_pair: Pair
) -> None:
    path = tmp_path / "run.parquet"
    write_pair(path, short_pair)
    rewritten(path, lambda table: table.select(table.column_names[::-1]))
    assert_same(read_pair(path).faulted, short_pair.faulted)


def test_a_file_of_an_earlier_version_without_checksums_opens(
    tmp_path: Path, short_pair: Pair
) -> None:
    path = tmp_path / "run.parquet"
    write_pair(path, short_pair)
    plain = {"use_dictionary": False, "use_byte_stream_split": True, "write_page_checksum": False}
    rewritten(path, lambda table: table, **plain)
    assert_same(read_pair(path).mirror, short_pair.mirror)


def test_no_flipped_bit_reads_as_another_number(tmp_path: Path, short_pair: Pair) -> None:
    path = tmp_path / "run.parquet"
    write_pair(path, short_pair)
    content = path.read_bytes()
    footer = len(content) - 8 - int.from_bytes(content[-8:-4], "little")
    rng = np.random.default_rng(7)
    in_pages = rng.integers(4, footer, 60).tolist()
    said = set()
    for place in in_pages + rng.integers(footer, len(content), 120).tolist():
        flipped = bytearray(content)
        flipped[place] ^= 1 << int(rng.integers(8))
        path.write_bytes(flipped)
        try:
            pair = read_pair(path)
        except StoreError as error:  # anything else is a traceback
            said.add("checksum" if "(checksum); fly it again" in str(error) else "other")
        else:
            assert_same(pair.faulted, short_pair.faulted)
            assert_same(pair.mirror, short_pair.mirror)
        try:
            _, faulted, _ = read_channels(path, 10.0, 20.0)
        except StoreError:
            continue
        assert faulted.tobytes() == short_pair.faulted.channels[500:1001].tobytes()
    assert said == {"checksum", "other"}


def test_json_that_is_no_table_too_deep_or_too_large_is_damaged(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "run.json"
    for text in ("[" * 100_000, "[1]", '{"a": ', "\udcff"):
        path.write_text(text, encoding="utf-8", errors="surrogateescape")
        with pytest.raises(StoreError, match=r"run\.json is damaged"):
            read_json(path)
    monkeypatch.setattr("core.files.MAX_JSON", 10)
    path.write_text('{"a": "0123456789"}')
    with pytest.raises(StoreError, match="more than any that MirrorTwin writes"):
        read_json(path)


def test_a_seal_finds_what_was_changed(tmp_path: Path) -> None:
    path = tmp_path / "run.json"
    write_json(path, sealed({"top": "nominal", "probabilities": [0.1, 1e-12], "n": None}))
    check_seal(path, read_json(path))
    assert sealed(read_json(path)) == read_json(path)
    with pytest.raises(StoreError, match=r"damaged \(checksum\)"):
        check_seal(path, read_json(path) | {"probabilities": [0.3, 1e-12]})
    check_seal(path, {"top": "nominal"})  # of an earlier version


def test_a_sum_beside_a_file_finds_what_was_changed(tmp_path: Path) -> None:
    path = tmp_path / "run.rrd"
    assert not has_its_sum(path)
    path.write_bytes(b"RRF2 and so on")
    assert has_its_sum(path)  # of an earlier version
    write_sum(path)
    assert has_its_sum(path)
    path.write_bytes(b"RRF2 and so oN")
    assert not has_its_sum(path)
    path.unlink()
    assert not has_its_sum(path)

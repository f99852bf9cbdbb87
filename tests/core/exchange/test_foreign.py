"""Flights' files from anywhere: nothing in them fills the memory, and no value is no flight's."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from core.channels import CHANNEL_INDEX
from core.errors import InputError, StoreError
from core.exchange.foreign_flight import check_flight, check_pages
from core.twin import flight_file as files
from core.twin.flight_file import read_trajectory, write_pair, write_trajectory
from core.twin.trajectory import Pair, Trajectory


def test_what_mirrortwin_and_others_write_passes(tmp_path: Path, short_pair: Pair) -> None:
    path = tmp_path / "run.parquet"
    write_pair(path, short_pair)
    check_pages(path)
    table = pq.read_table(path)
    for options in ({}, {"data_page_version": "2.0"}, {"compression": "none"}):
        pq.write_table(table, path, row_group_size=500, data_page_size=1000, **options)
        check_pages(path)
    check_flight("run.parquet", short_pair.faulted)


def test_a_page_that_is_larger_than_the_footer_says_is_not_unpacked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The pages of a longer flight, under the footer of a shorter one."""
    path, longer = tmp_path / "run.parquet", tmp_path / "longer.parquet"
    plain = {"compression": "zstd", "use_dictionary": False, "column_encoding": "PLAIN"}
    n = 200_000
    zeros = np.zeros(n)

    def write(where: Path, rows: int) -> bytes:
        pq.write_table(pa.table({"time_s": zeros[:rows]}), where, data_page_size=1 << 30, **plain)
        return where.read_bytes()

    short, long = write(path, 300), write(longer, n)
    first = pq.read_metadata(path).row_group(0).column(0)
    other = pq.read_metadata(longer).row_group(0).column(0)
    # Of the short one's footer only the length of the pages is changed.
    footer = int.from_bytes(short[-8:-4], "little")
    start = first.data_page_offset
    assert other.data_page_offset == start == 4
    pages = long[start : start + other.total_compressed_size]
    foot = short[-8 - footer : -8]
    size = _varint(first.total_compressed_size * 2)
    assert foot.count(size) >= 1
    grown = foot.replace(size, _varint(len(pages) * 2))
    path.write_bytes(short[:start] + pages + grown + len(grown).to_bytes(4, "little") + b"PAR1")
    assert pq.read_metadata(path).row_group(0).column(0).total_uncompressed_size < 5000
    monkeypatch.setattr(files, "check_layout", lambda *_: None)  # it has one column only
    with pytest.raises(StoreError, match="more in its pages than a flight has"):
        check_pages(path)


def _varint(value: int) -> bytes:
    out = b""
    while value > 127:
        out, value = out + bytes([value & 127 | 128]), value >> 7
    return out + bytes([value])


def test_garbage_is_no_flight(tmp_path: Path, short_pair: Pair) -> None:
    path = tmp_path / "run.parquet"
    write_trajectory(path, short_pair.mirror)
    content = path.read_bytes()
    rng = np.random.default_rng(3)
    starts = [
        pq.read_metadata(path).row_group(0).column(place).data_page_offset for place in range(40)
    ]
    for start in starts:  # the headers themselves
        damaged = bytearray(content)
        damaged[start + int(rng.integers(20))] ^= 1 << int(rng.integers(8))
        path.write_bytes(damaged)
        try:
            check_pages(path, ("",))
            read_trajectory(path)
        except StoreError:
            continue
    for text in (b"", b"PAR1", b"PAR1 not at all PAR1"):
        path.write_bytes(text)
        with pytest.raises(StoreError, match=re.escape(str(path))):
            check_pages(path)


def changed(flight: Trajectory, part: str, place: tuple[int, ...], value: float) -> Trajectory:
    """The flight with one other value."""
    values = getattr(flight, part).copy()
    values[place] = value
    return replace(flight, **{part: values})


@pytest.mark.parametrize(
    ("part", "place", "value", "said"),
    [
        ("channels", (7, CHANNEL_INDEX["E1 RPM"]), 3e38, "3e+38 in E1 RPM"),
        ("channels", (7, CHANNEL_INDEX["OAT"]), np.nan, "not finite"),
        ("states", (7, 0), -1e300, "1e+300 in north_m"),
        ("states", (7, 0), np.inf, "not finite"),
        ("time_s", (0,), -1e308, "times outside 0 to 7200 s"),
        ("time_s", (-1,), 1e9, "times outside 0 to 7200 s"),
        ("time_s", (5,), np.nan, "times outside"),
        ("time_s", (5,), 0.0, "back in time"),
    ],
)
def test_what_no_flight_comes_near_is_refused(
    short_pair: Pair, part: str, place: tuple[int, ...], value: float, said: str
) -> None:
    with pytest.raises(InputError, match="run") as caught:
        check_flight("run.parquet", changed(short_pair.faulted, part, place, value))
    assert said in str(caught.value)


def test_a_single_sample_is_a_flight(short_pair: Pair) -> None:
    check_flight("run.parquet", short_pair.faulted[:1])

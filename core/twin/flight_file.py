"""Flights in Parquet files.

Channels are kept as the float32 and states as the float64 that they are, so what is read back
equals what was written, bit for bit; byte-stream split with zstd makes that cheap. The same
flight always gives the same bytes. Every page carries a checksum, which is verified when it is
read; files of earlier versions have none.

A file may come from anywhere: nothing of it is read before its columns, their types and its size
are those of a flight. Whether the values can be those of a flight: `core.exchange.foreign_flight`.
"""

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import pyarrow as pa  # type: ignore[import-untyped]  # pyarrow ships no types
import pyarrow.parquet as pq  # type: ignore[import-untyped]  # pyarrow ships no types

from core.channels import CHANNEL_NAMES, CHANNELS
from core.clock import DT_S
from core.errors import StoreError
from core.files import whole_file
from core.twin.plan import PLAN_RANGES
from core.twin.trajectory import STATE_NAMES, Pair, Trajectory

ROWS_TOGETHER = 30_000
"""Samples of a file that are read together: 10 min, so that a part of a long flight is quick."""

MAX_SAMPLES = round(PLAN_RANGES["duration_s"][1] / DT_S) + 1
"""The longest flight that can be planned."""

MAX_FOOTER = 4 << 20
"""The largest Parquet footer that is read [bytes]; a run of 2 h has some 0.3 MB."""

SIDES = ("faulted.", "mirror.")
"""What the columns of each flight of a pair begin with."""

_UNITS = {channel.name: channel.unit for channel in CHANNELS}


def write_trajectory(path: Path, trajectory: Trajectory) -> None:
    """Write one flight: columns ``time_s``, the states, the channels; raises `StoreError`."""
    _write_columns(path, trajectory.time_s, {"": trajectory})


def read_trajectory(path: Path) -> Trajectory:
    """Read what `write_trajectory` wrote; raises `StoreError` for anything else."""
    with opened(path, ("",)) as file:
        return _flight(path, file.read(list(column_types(("",)))), "")


def write_pair(path: Path, pair: Pair) -> None:
    """Write both flights of a pair side by side on their one time axis; raises `StoreError`.

    Columns: ``time_s``, then ``faulted.`` and ``mirror.`` followed by each state and channel.
    """
    _write_columns(path, pair.faulted.time_s, {"faulted.": pair.faulted, "mirror.": pair.mirror})


def read_pair(path: Path) -> Pair:
    """Read what `write_pair` wrote; raises `StoreError` for anything else."""
    with opened(path) as file:
        table = file.read(list(column_types(SIDES)))
        return Pair(*(_flight(path, table, side) for side in SIDES))


def read_columns(path: Path, names: Sequence[str]) -> dict[str, np.ndarray]:
    """Some columns (n,) of a flight's file, without reading the rest; raises `StoreError`."""
    with opened(path) as file:
        table = file.read(list(names))
    try:
        return {name: np.array(_values(table, name)) for name in names}
    except KeyError as error:
        raise StoreError(f"{path} is not a flight of this version: {error}") from error


def read_channels(
    path: Path, from_s: float, to_s: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time (n,) and the channels (n, 23) of both flights between two times, ends included.

    Reads little more of the file than that; raises `StoreError`.
    """
    names = [side + name for side in SIDES for name in CHANNEL_NAMES]
    with opened(path) as file:
        # The times themselves, not what the footer says of them: that has no checksum.
        time_s = np.array(_values(file.read(["time_s"]), "time_s"))
        sizes = [
            file.metadata.row_group(place).num_rows for place in range(file.metadata.num_row_groups)
        ]
        ends = np.cumsum(sizes)
        first, last = np.searchsorted(time_s, [from_s, np.nextafter(to_s, np.inf)])
        groups = np.flatnonzero((ends > first) & (ends - sizes < last))
        before = int((ends - sizes)[groups[0]]) if len(groups) else 0
        table = file.read_row_groups(groups.tolist(), names)
    try:
        rows = slice(first - before, last - before)
        faulted, mirror = (
            np.stack([_values(table, side + name)[rows] for name in CHANNEL_NAMES], axis=1)
            for side in SIDES
        )
    except (KeyError, TypeError, pa.ArrowException) as error:
        raise StoreError(f"{path} is not a flight of this version: {error}") from error
    return time_s[first:last], faulted, mirror


def _write_columns(path: Path, time_s: np.ndarray, flights: dict[str, Trajectory]) -> None:
    arrays = [_column(time_s, pa.float64())]
    fields = [pa.field("time_s", pa.float64(), nullable=False, metadata={"unit": "s"})]
    for prefix, flight in flights.items():
        for index, name in enumerate(STATE_NAMES):
            arrays.append(_column(flight.states[:, index], pa.float64()))
            fields.append(pa.field(prefix + name, pa.float64(), nullable=False))
        for index, name in enumerate(CHANNEL_NAMES):
            unit = {"unit": _UNITS[name]}
            arrays.append(_column(flight.channels[:, index], pa.float32()))
            fields.append(pa.field(prefix + name, pa.float32(), nullable=False, metadata=unit))
    table = pa.Table.from_arrays(arrays, schema=pa.schema(fields))
    with whole_file(path) as temporary:
        pq.write_table(
            table,
            temporary,
            compression="zstd",
            use_dictionary=False,
            use_byte_stream_split=True,
            row_group_size=ROWS_TOGETHER,
            write_page_checksum=True,
        )


def _column(values: np.ndarray, dtype: pa.DataType) -> pa.Array:
    # Not pa.array(): its first call imports pandas, which would cost the first run half a second;
    # for the same reason _values() does not go through to_numpy().
    data = np.ascontiguousarray(values, dtype=dtype.to_pandas_dtype())
    return pa.Array.from_buffers(dtype, len(data), [None, pa.py_buffer(data)])


def _values(table: pa.Table, name: str) -> np.ndarray:
    values: np.ndarray = np.from_dlpack(table.column(name).combine_chunks())
    return values


@contextmanager
def opened(path: Path, sides: tuple[str, ...] = SIDES) -> Iterator[pq.ParquetFile]:
    """A flight's file, once it is known to be one and of bounded size."""
    try:
        _check_footer(path)
        with pq.ParquetFile(path, memory_map=True, page_checksum_verification=True) as file:
            check_layout(path, file, sides)
            yield file
    except OSError as error:
        if "CRC checksum" in str(error):
            raise StoreError(f"{path} is damaged (checksum); fly it again") from error
        if error.errno is None:  # Arrow's word for what it cannot decode
            raise StoreError(f"{path} is damaged: {_first_line(error)}; fly it again") from error
        raise StoreError(f"cannot read {path}: {os.strerror(error.errno)}") from error
    except (pa.ArrowException, UnicodeDecodeError) as error:
        raise StoreError(f"{path} is not a flight, or damaged: {_first_line(error)}") from error


def _first_line(error: Exception) -> str:
    return str(error).partition("\n")[0][:200]


def _check_footer(path: Path) -> None:
    """Raise `StoreError` for a footer that alone would fill the memory, before it is parsed."""
    with path.open("rb") as file:
        size = file.seek(0, os.SEEK_END)
        file.seek(max(0, size - 8))
        footer = int.from_bytes(file.read(4), "little")
    if size >= 8 and MAX_FOOTER < footer < size:
        raise StoreError(f"{path} is not a flight: it describes more than a flight has")


def column_types(sides: tuple[str, ...] = SIDES) -> dict[str, pa.DataType]:
    """The columns of a flight's file: nothing else is one. ``sides``: ("",) for a single flight."""
    return {"time_s": pa.float64()} | {
        side + name: kind
        for side in sides
        for names, kind in ((STATE_NAMES, pa.float64()), (CHANNEL_NAMES, pa.float32()))
        for name in names
    }


def check_layout(path: Path, file: pq.ParquetFile, sides: tuple[str, ...]) -> None:
    """Raise `StoreError` unless columns, types, rows and announced sizes are those of a flight."""
    expected, schema = column_types(sides), file.schema_arrow

    def refuse(problem: str) -> NoReturn:
        raise StoreError(f"{path} is not a flight of this version: it {problem}")

    if missing := [name for name in expected if name not in schema.names]:
        refuse(f"has no column {missing[0]!r}{_and_more(missing)}")
    if odd := [name for name in schema.names if name not in expected]:
        refuse(f"has a column {odd[0]!r:.60} that no flight has{_and_more(odd)}")
    if len(schema.names) != len(expected) or len(file.schema) != len(expected):
        refuse("has a column twice")
    for name, kind in expected.items():
        if (found := schema.field(name).type) != kind:
            refuse(f"has {str(found)[:60]} in column {name!r}, which must be {kind}")
    n = file.metadata.num_rows
    if not 1 <= n <= MAX_SAMPLES:
        refuse(f"has {n} samples; a flight has 1 to {MAX_SAMPLES}")
    groups = [file.metadata.row_group(place) for place in range(file.metadata.num_row_groups)]
    if sum(group.num_rows for group in groups) != n or any(g.num_rows < 1 for g in groups):
        refuse("has other samples than it says")
    for group in groups:
        for place in range(group.num_columns):
            chunk = group.column(place)
            if chunk.total_uncompressed_size > most_bytes(group.num_rows):
                refuse(f"has {chunk.total_uncompressed_size} bytes in column "
                       f"{chunk.path_in_schema!r:.60} for {group.num_rows} samples")  # fmt: skip


def most_bytes(n: int) -> int:
    """The most that ``n`` values of a column can take: as they are and, at worst, numbered too."""
    return 2 * 8 * n + (16 << 10)


def _and_more(names: Sequence[str]) -> str:
    return f" (and {len(names) - 1} more)" if len(names) > 1 else ""


def _flight(path: Path, table: pa.Table, prefix: str) -> Trajectory:
    def columns(names: tuple[str, ...], dtype: type[np.floating[Any]]) -> np.ndarray:
        matrix = np.full((table.num_rows, len(names)), np.nan, dtype=dtype)
        for index, name in enumerate(names):
            matrix[:, index] = _values(table, prefix + name)
        return matrix

    try:
        return Trajectory(
            time_s=np.array(_values(table, "time_s"), dtype=np.float64),
            states=columns(STATE_NAMES, np.float64),
            channels=columns(CHANNEL_NAMES, np.float32),
        )
    except (KeyError, TypeError, pa.ArrowException) as error:
        raise StoreError(f"{path} is not a flight of this version: {error}") from error

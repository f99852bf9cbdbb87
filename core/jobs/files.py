"""Flights in Parquet files, and files that are written whole or not at all.

Channels are kept as the float32 and states as the float64 that they are, so what is read back
equals what was written, bit for bit; byte-stream split with zstd makes that cheap. The same
flight always gives the same bytes.
"""

import json
import os
import secrets
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa  # type: ignore[import-untyped]  # pyarrow ships no types
import pyarrow.parquet as pq  # type: ignore[import-untyped]  # pyarrow ships no types

from core.channels import CHANNEL_NAMES, CHANNELS
from core.errors import StoreError
from core.twin.trajectory import STATE_NAMES, Pair, Trajectory

ROWS_TOGETHER = 30_000
"""Samples of a file that are read together: 10 min, so that a part of a long flight is quick."""

_UNITS = {channel.name: channel.unit for channel in CHANNELS}


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Give a temporary name beside ``path`` to write to; it takes the name when all went well.

    What is at ``path`` stays untouched until the new file is complete and on the disk. Raises
    `StoreError` if the file system refuses.
    """
    temporary = path.with_name(f".{path.name}.{secrets.token_hex(4)}.tmp")
    try:
        yield temporary
        with temporary.open("rb") as file:
            os.fsync(file.fileno())
        temporary.replace(path)
    except OSError as error:
        raise write_error(path.parent, error) from error
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)


def write_error(folder: Path, error: OSError) -> StoreError:
    """The `StoreError` for a folder that cannot be written to: what is wrong and what to do."""
    reason = error.strerror or str(error)
    return StoreError(
        f"cannot write to {folder}: {reason}. Nothing stored was changed. "
        "Free space or allow writing there, or choose another folder and try again."
    )


def write_json(path: Path, values: dict[str, Any]) -> None:
    """Write ``values`` as readable JSON, whole or not at all; raises `StoreError`."""
    with whole_file(path) as temporary:
        temporary.write_text(json.dumps(values, indent=1, allow_nan=False), encoding="utf-8")


def read_json(path: Path) -> dict[str, Any]:
    """Read what `write_json` wrote; raises `StoreError` if it is not there or not JSON."""
    try:
        values: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise StoreError(f"cannot read {path}: {error.strerror}") from error
    except ValueError as error:
        raise StoreError(f"{path} is damaged: {error}") from error
    return values


def write_trajectory(path: Path, trajectory: Trajectory) -> None:
    """Write one flight: columns ``time_s``, the states, the 23 channels; raises `StoreError`."""
    _write_columns(path, trajectory.time_s, {"": trajectory})


def read_trajectory(path: Path) -> Trajectory:
    """Read what `write_trajectory` wrote; raises `StoreError` for anything else."""
    return _flight(path, _read_table(path), "")


def write_pair(path: Path, pair: Pair) -> None:
    """Write both flights of a pair side by side on their one time axis; raises `StoreError`.

    Columns: ``time_s``, then ``faulted.`` and ``mirror.`` followed by each state and channel.
    """
    _write_columns(path, pair.faulted.time_s, {"faulted.": pair.faulted, "mirror.": pair.mirror})


def read_pair(path: Path) -> Pair:
    """Read what `write_pair` wrote; raises `StoreError` for anything else."""
    table = _read_table(path)
    return Pair(_flight(path, table, "faulted."), _flight(path, table, "mirror."))


def read_columns(path: Path, names: Sequence[str]) -> dict[str, np.ndarray]:
    """Some columns (n,) of a flight's file, without reading the rest; raises `StoreError`."""
    table = _read_table(path, list(names))
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
    sides = ("faulted.", "mirror.")
    names = ["time_s", *(side + name for side in sides for name in CHANNEL_NAMES)]
    with _opened(path) as file:
        spans = [file.metadata.row_group(place).column(0).statistics for place in
                 range(file.metadata.num_row_groups)]  # fmt: skip
        groups = [
            place
            for place, span in enumerate(spans)
            if span is None or (span.max >= from_s and span.min <= to_s)
        ]
        table = file.read_row_groups(groups, names)
    try:
        time_s = np.array(_values(table, "time_s"))
        rows = slice(*np.searchsorted(time_s, [from_s, np.nextafter(to_s, np.inf)]))
        faulted, mirror = (
            np.stack([_values(table, side + name)[rows] for name in CHANNEL_NAMES], axis=1)
            for side in sides
        )
    except (KeyError, TypeError, pa.ArrowException) as error:
        raise StoreError(f"{path} is not a flight of this version: {error}") from error
    return time_s[rows], faulted, mirror


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
        )


def _column(values: np.ndarray, dtype: pa.DataType) -> pa.Array:
    # Not pa.array(): its first call imports pandas, which would cost the first run half a second;
    # for the same reason _values() does not go through to_numpy().
    data = np.ascontiguousarray(values, dtype=dtype.to_pandas_dtype())
    return pa.Array.from_buffers(dtype, len(data), [None, pa.py_buffer(data)])


def _values(table: pa.Table, name: str) -> np.ndarray:
    values: np.ndarray = np.from_dlpack(table.column(name).combine_chunks())
    return values


def _read_table(path: Path, columns: list[str] | None = None) -> pa.Table:
    with _opened(path) as file:
        return file.read(columns)


@contextmanager
def _opened(path: Path) -> Iterator[pq.ParquetFile]:
    try:
        with pq.ParquetFile(path, memory_map=True) as file:
            yield file
    except OSError as error:
        reason = os.strerror(error.errno) if error.errno else str(error)
        raise StoreError(f"cannot read {path}: {reason}") from error
    except pa.ArrowException as error:
        raise StoreError(f"{path} is not a flight: {error}") from error


def _flight(path: Path, table: pa.Table, prefix: str) -> Trajectory:
    def columns(names: tuple[str, ...], dtype: type[np.floating[Any]]) -> np.ndarray:
        matrix = np.empty((table.num_rows, len(names)), dtype=dtype)
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

"""A flight's file from anywhere: what it would take to read it, and whether it can be a flight.

A Parquet file says twice how large a page is: in its footer, which Arrow shows, and in the header
of the page, by which Arrow reserves memory. A file made to do harm says two things, and some
hundred bytes then become gigabytes. So the headers are looked at before anything is unpacked.
"""

import mmap
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from core.channels import CHANNELS
from core.errors import InputError, StoreError
from core.twin.flight_file import SIDES, most_bytes, opened
from core.twin.plan import PLAN_RANGES
from core.twin.trajectory import STATE_NAMES, Trajectory

_LONGEST_S = PLAN_RANGES["duration_s"][1]
_CHANNEL_LIMITS = np.array([100.0 * channel.full_scale for channel in CHANNELS])
"""A hundred times the span of its gauge: no flight comes near, broken or not."""

_STATE_LIMIT = 1e7
"""Metres flown, feet, rpm, degrees: no state of a flight of two hours comes near."""


def check_pages(path: Path, sides: tuple[str, ...] = SIDES) -> None:
    """Raise `StoreError` if this is no flight's file, or its pages hold more than it says.

    The memory that reading it takes is then bounded, whatever is in it. ``sides``: ("",) for a
    single flight.
    """
    try:
        with (
            opened(path, sides) as file,
            path.open("rb") as plain,
            mmap.mmap(plain.fileno(), 0, access=mmap.ACCESS_READ) as content,
        ):
            for place in range(file.metadata.num_row_groups):
                group = file.metadata.row_group(place)
                for column in range(group.num_columns):
                    _check_chunk(content, group.column(column), most_bytes(group.num_rows))
    except (IndexError, ValueError) as error:
        raise StoreError(f"{path} is not a flight, or damaged: {error}") from None


def _check_chunk(content: mmap.mmap, chunk: Any, most: int) -> None:
    start = chunk.data_page_offset
    if chunk.has_dictionary_page and 0 < chunk.dictionary_page_offset < start:
        start = chunk.dictionary_page_offset
    end = start + chunk.total_compressed_size
    if not 0 < start <= end <= len(content):
        raise ValueError("pages outside the file")
    unpacked = 0
    while start < end:
        after, uncompressed, compressed = _page_sizes(content, start)
        if uncompressed < 0 or compressed < 0:
            raise ValueError("a page of negative size")
        unpacked += uncompressed + after - start
        if unpacked > most:
            raise ValueError("more in its pages than a flight has")
        start = after + compressed


def _page_sizes(content: mmap.mmap, place: int) -> tuple[int, int, int]:
    """Where the page's header ends, and its size before and after compression."""
    reader = _Thrift(content, place)
    sizes = {2: -1, 3: -1}
    for field, kind in reader.fields():
        if field in sizes and kind in _INTEGERS:
            sizes[field] = reader.integer()
        else:
            reader.skip(kind)
    return reader.place, sizes[2], sizes[3]


_TRUE, _FALSE, _BYTE, _DOUBLE, _BINARY, _LIST, _SET, _STRUCT = 1, 2, 3, 7, 8, 9, 10, 12
_INTEGERS = (4, 5, 6)
_DEEPEST = 8


class _Thrift:
    """The compact protocol of Apache Thrift, as far as a Parquet page's header needs it.

    Arrow reads these headers but shows them to nobody. Raises `ValueError` or `IndexError`.
    """

    def __init__(self, content: mmap.mmap, place: int) -> None:
        """Read from ``place`` on."""
        self._content, self.place = content, place

    def fields(self) -> Iterator[tuple[int, int]]:
        """Number and kind of each field of a structure; read or skip each before the next."""
        field = 0
        while head := self._byte():
            field = field + (head >> 4) if head >> 4 else self.integer()
            yield field, head & 15

    def integer(self) -> int:
        """A number of any size."""
        value = self._varint()
        return (value >> 1) ^ -(value & 1)

    def skip(self, kind: int, depth: int = 0) -> None:
        """Pass over a value."""
        if depth > _DEEPEST:
            raise ValueError("a header too deep")
        if kind in (_TRUE, _FALSE):
            return
        if kind in _INTEGERS:
            self._varint()
        elif kind in (_BYTE, _DOUBLE):
            self.place += 1 if kind == _BYTE else 8
        elif kind == _BINARY:
            length = self._varint()  # moves the place, so first
            self.place += length
        elif kind in (_LIST, _SET):
            head = self._byte()
            n = self._varint() if head >> 4 == 15 else head >> 4
            for _ in range(n):
                if head & 15 in (_TRUE, _FALSE):
                    self.place += 1
                else:
                    self.skip(head & 15, depth + 1)
        elif kind == _STRUCT:
            for _, inner in self.fields():
                self.skip(inner, depth + 1)
        else:
            raise ValueError("no page's header")

    def _varint(self) -> int:
        value = shift = 0
        while True:
            byte = self._byte()
            value |= (byte & 127) << shift
            if byte < 128:
                return value
            shift += 7
            if shift > 63:
                raise ValueError("a number too long")

    def _byte(self) -> int:
        byte = self._content[self.place]
        self.place += 1
        return byte


def check_flight(name: str, flight: Trajectory) -> None:
    """Raise `InputError` about ``name`` unless every value can be that of a flight."""
    time_s = flight.time_s
    if not (np.isfinite(time_s).all() and time_s[0] >= 0.0 and time_s[-1] <= _LONGEST_S):
        raise InputError(name, f"has times outside 0 to {_LONGEST_S:g} s")
    if not np.all(np.diff(time_s) > 0.0):
        raise InputError(name, "runs back in time")
    for values, names, limits in (
        (flight.states, STATE_NAMES, np.full(len(STATE_NAMES), _STATE_LIMIT)),
        (flight.channels, tuple(channel.name for channel in CHANNELS), _CHANNEL_LIMITS),
    ):
        if not np.isfinite(values).all():
            raise InputError(name, "holds values that are not finite")
        odd = np.flatnonzero((np.abs(values) > limits).any(axis=0))
        if len(odd):
            worst = np.abs(values[:, odd[0]]).max()
            raise InputError(
                name, f"has {worst:.3g} in {names[odd[0]]}, which no flight comes near"
            )

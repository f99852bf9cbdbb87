"""Logs in any form, whole or spoilt: read as they were meant, or refused, never read as another."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from log_support import DEVICE, FROM_OURS, UNIT, LogText, truth

from core.channels import CHANNEL_NAMES
from core.errors import InputError
from core.exchange.log import Log
from core.exchange.log_files import read_log

ROWS = 12
SEPARATORS = ((",", "."), (", ", "."), (";", "."), (";", ","), ("\t", "."), ("\t", ","))
DATES = ("2014-10-29", "29/10/2014", "10/29/2014", "29.10.2014", "2014/10/29", "29-Oct-2014")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("logs")


@st.composite
def logs(draw: st.DrawFn) -> LogText:
    """Logs in any units, order, separators and dates that the reader understands."""
    separator, point = draw(st.sampled_from(SEPARATORS))
    changed = draw(st.lists(st.sampled_from(CHANNEL_NAMES), max_size=6, unique=True))
    return LogText(
        rows=ROWS,
        units={name: draw(st.sampled_from(list(FROM_OURS[UNIT[name]]))) for name in changed},
        units_at=draw(st.sampled_from(("above", "below", "in the names"))),
        order=tuple(draw(st.permutations(CHANNEL_NAMES))),
        separator=separator,
        point=point,
        newline=draw(st.sampled_from(("\n", "\r\n"))),
        date_cell=draw(st.sampled_from(DATES)),
        date_unit=draw(st.sampled_from(("#yyy-mm-dd", ""))),
    )


def assert_true(log: Log) -> None:
    """Whatever was read is the truth of its second, or its column is named in a doubt."""
    doubts = " ".join(log.reading.doubts)
    # Engine speed is in the same numbers in each of its units.
    seconds = np.round((log.channel("E1 RPM") - truth("E1 RPM", 0)) / 0.001).astype(int)
    for name in CHANNEL_NAMES:
        expected = [truth(name, second) for second in seconds.tolist()]
        same = np.allclose(log.channel(name), expected, 0.0, 2e-4)
        assert same or repr(name) in doubts or "states no units" in doubts, name
    moments = log.time_s - log.time_s[0]
    meant = (seconds - seconds[0]).astype(float)
    assert np.array_equal(moments, meant) or "its clock" in doubts


def read(folder: Path, text: str) -> Log | None:
    """The log, None where it was refused in one line that names the file."""
    path = folder / "log.csv"
    path.write_text(text, encoding="utf-8", newline="")
    try:
        return read_log(path)
    except InputError as error:
        assert error.problem.startswith("log.csv: ")
        assert "\n" not in error.problem
        return None


@given(text=logs())
@settings(max_examples=60, deadline=None)
def test_every_form_is_read_as_it_was_meant(folder: Path, text: LogText):
    log = read(folder, str(text))
    assert log is not None
    assert len(log) == ROWS
    assert log.reading.doubts == ()
    assert_true(log)
    converted = {each.column for each in log.reading.converted}
    others = {
        name
        for name, unit in text.units.items()
        if FROM_OURS[UNIT[name]][unit](123.4) != FROM_OURS[UNIT[name]][DEVICE[name]](123.4)
    }
    assert converted == others


@given(text=logs(), data=st.data())
@settings(max_examples=60, deadline=None)
def test_wherever_it_is_cut_only_whole_rows_are_read(
    folder: Path, text: LogText, data: st.DataObject
):
    whole = str(text)
    at = data.draw(st.integers(0, len(whole) - 1), label="cut")
    log = read(folder, whole[:at])
    lines_left = whole[:at].count(text.newline[-1:])
    n_rows = lines_left - len([line for line in text.head() if line])
    # Between the two characters of CRLF the row before is whole.
    n_rows += whole[:at].endswith("\r")
    assert (log is not None) == (n_rows > 0)
    if log is not None:
        assert len(log) == n_rows
        assert_true(log)


def _without(lines: list[str], k: int, _: LogText) -> None:
    del lines[k]


def _twice(lines: list[str], k: int, _: LogText) -> None:
    lines.insert(k, lines[k])


def _swapped(lines: list[str], k: int, _: LogText) -> None:
    j = min(k + 1, len(lines) - 1)
    lines[k], lines[j] = lines[j], lines[k]


def _cell_lost(lines: list[str], k: int, text: LogText) -> None:
    cells = lines[k].split(text.separator)
    del cells[len(cells) // 2]
    lines[k] = text.separator.join(cells)


def _cell_gained(lines: list[str], k: int, text: LogText) -> None:
    cells = lines[k].split(text.separator)
    lines[k] = text.separator.join([*cells[:4], *cells[3:]])


def _cell_blank(lines: list[str], k: int, text: LogText) -> None:
    cells = lines[k].split(text.separator)
    cells[-1] = ""
    lines[k] = text.separator.join(cells)


def _newline_lost(lines: list[str], k: int, _: LogText) -> None:
    if k + 1 < len(lines):
        lines[k] += lines.pop(k + 1)


def _emptied(lines: list[str], k: int, _: LogText) -> None:
    lines.insert(k, "")


def _quoted(lines: list[str], k: int, text: LogText) -> None:
    cells = lines[k].split(text.separator)
    lines[k] = text.separator.join([f'"{cell.strip()}"' for cell in cells])


def _quote_opened(lines: list[str], k: int, _: LogText) -> None:
    lines[k] = '"' + lines[k]


SPOILT: tuple[Callable[[list[str], int, LogText], None], ...] = (
    _without, _twice, _swapped, _cell_lost, _cell_gained, _cell_blank, _newline_lost, _emptied,
    _quoted, _quote_opened,
)  # fmt: skip


@given(text=logs(), spoil=st.sampled_from(SPOILT), data=st.data())
@settings(max_examples=120, deadline=None)
def test_one_spoilt_line_makes_no_other_flight(
    folder: Path,
    text: LogText,
    spoil: Callable[[list[str], int, LogText], None],
    data: st.DataObject,
):
    lines = str(text).split(text.newline)[:-1]
    spoil(lines, data.draw(st.integers(0, len(lines) - 1), label="line"), text)
    log = read(folder, text.newline.join([*lines, ""]))
    if log is not None:
        blank = np.isnan(log.channels)
        absent = [CHANNEL_NAMES.index(name) for name in log.missing]
        assert len(absent) <= 1 and np.delete(blank, absent, axis=1).sum() <= 1
        log.channels[blank] = np.array(
            [truth(CHANNEL_NAMES[k], row) for row, k in np.argwhere(blank)]
        )
        assert_true(log)


@given(text=logs(), unit=st.text(max_size=6), name=st.sampled_from(CHANNEL_NAMES))
@settings(max_examples=60, deadline=None)
def test_any_other_word_for_a_unit_is_refused_or_doubted(
    folder: Path, text: LogText, unit: str, name: str
):
    word = re.sub(r"[^\w °/^.]", "", unit)
    log = read(folder, str(LogText(units={name: word}, units_at=text.units_at, rows=ROWS)))
    if log is not None:
        said = repr(name) in " ".join(log.reading.doubts)
        known = name in {each.column for each in log.reading.converted}
        ours = np.allclose(log.channel(name), [truth(name, k) for k in range(ROWS)], 0.0, 2e-4)
        assert said or known or ours


@given(data=st.binary(max_size=400))
@settings(max_examples=60, deadline=None)
def test_anything_else_is_refused_in_a_line(folder: Path, data: bytes):
    path = folder / "any.csv"
    path.write_bytes(data)
    with pytest.raises(InputError, match=r"^logs: any\.csv: "):
        read_log(path)


@given(text=logs(), data=st.data())
@settings(max_examples=60, deadline=None)
def test_noise_in_the_characters_is_no_crash(folder: Path, text: LogText, data: st.DataObject):
    characters = list(str(text))
    for _ in range(data.draw(st.integers(1, 30))):
        at = data.draw(st.integers(0, len(characters) - 1))
        characters[at] = data.draw(st.sampled_from(',;"\t\n\r\0.-+eE0 9°#()[]\ufeff\u2028é'))
    log = read(folder, "".join(characters))
    if log is not None:
        assert np.isfinite(log.time_s).all()
        assert (np.diff(log.time_s) > 0.0).all()

"""Real logs: kinds of export, and what is wrong with some of them."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from log_support import AIRFRAME, DEVICE, FROM_OURS, UNIT, LogText, truth

from core.channels import CHANNEL_NAMES, CHANNELS
from core.errors import InputError
from core.exchange.log import Log
from core.exchange.log_files import LOGS, read_log, read_logs
from core.experiments.realism.cruise import cruising, describe, steady_stretches

REAL = pytest.mark.skipif(not LOGS.is_dir(), reason="no real logs beside this checkout")
OTHER_UNITS = [
    (name, unit)
    for name in ("E1 CHT2", "OAT", "E1 OilP", "E1 FFlow", "FQtyL", "AltMSL", "IAS", "VSpd", "volt1",
                 "amp2", "E1 RPM", "NormAc")
    for unit in list(FROM_OURS[UNIT[name]])[1:]
]  # fmt: skip


def read(folder: Path, text: LogText | str, name: str = "a.csv") -> Log:
    path = folder / name
    path.write_text(str(text), encoding="utf-8", newline="")
    return read_log(path)


def refusal(folder: Path, text: LogText | str, name: str = "a.csv") -> str:
    with pytest.raises(InputError) as caught:
        read(folder, text, name)
    assert caught.value.field == "logs"
    assert name in caught.value.problem
    return caught.value.problem


def assert_true(log: Log, seconds: list[int] | range) -> None:
    """Every channel of the log holds the truth at these seconds."""
    assert len(log) == len(seconds)
    for name in CHANNEL_NAMES:
        expected = [truth(name, second) for second in seconds]
        assert np.allclose(log.channel(name), expected, 0.0, 2e-4), name


def dropped(log: Log) -> dict[str, int]:
    return {each.reason: each.rows for each in log.reading.dropped}


def test_native_log_in_our_order(tmp_path: Path):
    log = read(tmp_path, LogText(40, order=CHANNEL_NAMES[::-1]))
    assert_true(log, range(40))
    assert log.channels.shape == (40, len(CHANNELS))
    assert log.time_s.tolist() == list(range(40))
    assert log.missing == ()
    reading = log.reading
    assert (reading.rows, reading.aircraft, reading.simulated) == (40, "Cessna 172S", False)
    assert reading.converted == reading.dropped == reading.doubts == ()


def test_export_without_a_clock_repeats_its_names_in_a_comment(tmp_path: Path):
    names = ", ".join(["AltAGL", *CHANNEL_NAMES, "volt1 Lag"])
    rows = [", ".join(["0.0", *(str(truth(n, s)) for n in CHANNEL_NAMES), "NaN"]) for s in range(5)]
    text = "\n".join([f"#{names}, number_events = 8", names, *rows, ""])
    log = read(tmp_path, text)
    assert log.time_s.tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]
    assert_true(log, range(5))
    said = " ".join(log.reading.doubts)
    assert "names no aircraft" in said and "no clock" in said and "states no units" in said
    # Standing on the ground rows are alike; without a clock that makes no copy of them.
    alike = "\n".join([names, *rows[:1] * 3, ""])
    assert len(read(tmp_path, alike)) == 3


def test_blank_cells_are_unknown_and_words_are_said(tmp_path: Path):
    text = LogText(6)
    lines = str(text).splitlines()
    cells = lines[5].split(",")
    cells[3:7] = ["   ", " - ", "NaN", " high"]
    log = read(tmp_path, "\n".join([*lines[:5], ",".join(cells), *lines[6:], ""]))
    blank = [name for name in CHANNEL_NAMES if np.isnan(log.channel(name)[2])]
    assert blank == list(CHANNEL_NAMES[:4])
    (doubt,) = log.reading.doubts
    assert doubt.startswith("column 'amp2' holds 1 cell that is no number ('high')")


def test_a_channel_may_be_missing_but_not_those_that_tell_cruise(tmp_path: Path):
    kept = tuple(name for name in CHANNEL_NAMES if name not in ("E1 EGT4", "amp2"))
    assert read(tmp_path, LogText(order=kept)).missing == ("amp2", "E1 EGT4")
    for name in ("IAS", "VSpd", "E1 RPM"):
        kept = tuple(each for each in CHANNEL_NAMES if each != name)
        assert f"has no column '{name}'" in refusal(tmp_path, LogText(order=kept))


def test_a_column_of_words_is_named(tmp_path: Path):
    text = str(LogText()).replace("105.0", "fast ")
    assert "column 'IAS' holds no numbers" in refusal(tmp_path, text)


# Units


@pytest.mark.parametrize("units_at", ["above", "below", "in the names"])
@pytest.mark.parametrize(("name", "unit"), OTHER_UNITS)
def test_other_units_are_converted_and_said(tmp_path: Path, name: str, unit: str, units_at: str):
    log = read(tmp_path, LogText(units={name: unit}, units_at=units_at))
    assert_true(log, range(20))
    same = FROM_OURS[UNIT[name]][unit](1234.5) == 1234.5
    assert [each.column for each in log.reading.converted] == ([] if same else [name])
    for each in log.reading.converted:
        assert each.to_unit == UNIT[name] and each.from_unit != each.to_unit


@pytest.mark.parametrize("units_at", ["above", "below", "in the names"])
@pytest.mark.parametrize(
    ("name", "unit"),
    [("E1 OilP", "furlongs"), ("E1 FFlow", "kg/h"), ("FQtyL", "lbs"), ("E1 CHT1", "deg"),
     ("E1 CHT1", "psi"), ("IAS", "mach"), ("AltMSL", "ft agl")],
)  # fmt: skip
def test_a_unit_that_is_not_known_is_refused_by_name(
    tmp_path: Path, name: str, unit: str, units_at: str
):
    said = refusal(tmp_path, LogText(units={name: unit}, units_at=units_at))
    assert f"column {name!r} is in {unit!r}" in said
    assert f"or {UNIT[name]}" in said or f"understood: {UNIT[name]}" in said


def test_units_that_none_knows_are_not_taken_for_ours(tmp_path: Path):
    strange = dict.fromkeys(CHANNEL_NAMES, "zz")
    for units_at in ("above", "below", "in the names"):
        said = refusal(tmp_path, LogText(units=strange, units_at=units_at))
        assert "column 'volt1' is in 'zz'" in said


def test_a_column_without_a_unit_is_a_doubt(tmp_path: Path):
    log = read(tmp_path, LogText(units={"E1 CHT1": ""}))
    assert log.reading.doubts == ("column 'E1 CHT1' states no unit: read as degF",)


def test_units_stated_twice_must_agree(tmp_path: Path):
    text = str(LogText()).replace("E1 CHT1", "E1 CHT1 (deg C)")
    assert "column 'E1 CHT1' is in 'deg C' and in 'deg F'" in refusal(tmp_path, text)


def test_a_units_line_that_does_not_fit_the_names_is_refused(tmp_path: Path):
    lines = str(LogText()).split("\n")
    lines[1] = lines[1].replace("hh:mm:ss, ", "")
    names = len(CHANNEL_NAMES) + 3
    assert f"{names - 1} units for {names} names" in refusal(tmp_path, "\n".join(lines))


def test_one_g_in_level_flight_is_brought_to_none_and_said(tmp_path: Path):
    def lifted(by: float) -> str:
        lines = str(LogText()).split("\n")
        place = 3 + CHANNEL_NAMES.index("NormAc")
        for number, line in enumerate(lines[3:-1], start=3):
            cells = line.split(", ")
            cells[place] = f"{float(cells[place]) + by:.6f}"
            lines[number] = ", ".join(cells)
        return "\n".join(lines)

    log = read(tmp_path, lifted(1.0))
    assert_true(log, range(20))
    (each,) = log.reading.converted
    assert (each.column, each.from_unit) == ("NormAc", "g, 1 in level flight")
    log = read(tmp_path, lifted(0.5))
    assert log.missing == ("NormAc",)
    assert "neither 0 nor 1" in log.reading.doubts[0]


# Dates and times


@pytest.mark.parametrize(
    ("cell", "unit"),
    [("2014-10-29", "#yyy-mm-dd"), ("29/10/2014", "#yyy-mm-dd"), ("10/29/2014", ""),
     ("29.10.2014", ""), ("05.06.2014", ""), ("29-10-2014", ""), ("2014/10/29", ""),
     ("20141029", ""), ("29-Oct-2014", ""), ("5 Jun 2014", ""), ("05/05/2014", ""),
     ("05/06/2014", "#dd/mm/yyy"), ("05/06/2014", "mm/dd/yyyy")],
)  # fmt: skip
def test_dates_are_understood(tmp_path: Path, cell: str, unit: str):
    clocks = tuple(f"10:00:{second:02d}" for second in (0, 1, 2, 3, 9, 10))
    log = read(tmp_path, LogText(6, date_cell=cell, date_unit=unit, clocks=clocks))
    assert log.time_s.tolist() == [0.0, 1.0, 2.0, 3.0, 9.0, 10.0]
    assert log.reading.doubts == ()


@pytest.mark.parametrize(
    ("cell", "said"),
    [("05/06/2014", "may be day or month first"), ("05-06-2014", "may be day or month first"),
     ("29/10/14", "two digits for the year"), ("yesterday", "is no date"),
     ("2014-13-29", "is no date"), ("31.02.2014", "is no date")],
)  # fmt: skip
def test_dates_that_may_mean_two_things_or_none_are_refused(tmp_path: Path, cell: str, said: str):
    problem = refusal(tmp_path, LogText(date_cell=cell))
    assert said in problem and repr(cell) in problem and "'Lcl Date'" in problem


def test_one_day_after_the_twelfth_decides_for_the_file(tmp_path: Path):
    lines = str(LogText(4, date_cell="12/11/2014")).split("\n")
    lines[5:7] = [line.replace("12/11", "13/11") for line in lines[5:7]]
    assert read(tmp_path, "\n".join(lines)).time_s[2] == 86400.0 + 2.0
    lines[6] = lines[6].replace("13/11", "11/13")
    assert "day first" in refusal(tmp_path, "\n".join(lines))


def test_midnight_and_the_clock_of_twelve_hours(tmp_path: Path):
    clocks = ("11:59:58 PM", "11:59:59 PM", "12:00:00 AM", "12:00:01 AM")
    lines = str(LogText(4, clocks=clocks)).split("\n")
    lines[5:7] = [line.replace("10-29", "10-30") for line in lines[5:7]]
    assert read(tmp_path, "\n".join(lines)).time_s.tolist() == [0.0, 1.0, 2.0, 3.0]


@pytest.mark.parametrize("clock", ["10:07", "noon", "25:00:00", "10:00:61"])
def test_a_time_that_is_none_is_refused(tmp_path: Path, clock: str):
    problem = refusal(tmp_path, LogText(4, clocks=(clock,) * 4))
    assert repr(clock) in problem and "'Lcl Time'" in problem


def test_some_unreadable_clocks_lie_between_their_neighbours_and_are_said(tmp_path: Path):
    clocks = ("", "10:00:01", "10:00:02", "??:??", "10:00:04", "10:00:05", "")
    log = read(tmp_path, LogText(7, clocks=clocks))
    assert log.time_s.tolist() == list(range(7))
    assert any("3 rows have no clock" in doubt for doubt in log.reading.doubts)


def clocked(folder: Path, *clocks: str, offsets: tuple[str, ...] | None = None) -> Log:
    return read(folder, LogText(len(clocks), clocks=clocks, offsets=offsets))


def test_a_repeated_second_is_kept_and_lies_within_its_second(tmp_path: Path):
    log = clocked(tmp_path, "10:00:01", "10:00:01", "10:00:02", "10:00:04", "10:00:50")
    assert log.time_s.tolist() == [0.0, 0.5, 1.0, 3.0, 49.0]
    assert_true(log, range(5))
    (doubt,) = log.reading.doubts
    assert doubt.startswith("1 row shares its second with the row before")


def test_only_copies_are_dropped(tmp_path: Path):
    lines = str(LogText(5)).split("\n")
    log = read(tmp_path, "\n".join([*lines[:5], lines[4], lines[4], *lines[5:]]))
    assert_true(log, range(5))
    assert dropped(log) == {"a copy of the row before": 2}


def test_five_rows_a_second_under_a_clock_of_whole_seconds(tmp_path: Path):
    log = clocked(tmp_path, *(f"10:00:{row // 5:02d}" for row in range(40)))
    assert np.allclose(np.diff(log.time_s), 0.2)


def test_a_clock_that_steps_back_by_a_second_makes_no_gap(tmp_path: Path):
    seconds = (52, 53, 52, 53, 54, 57)  # as in a real G3X log
    log = clocked(tmp_path, *(f"10:00:{second}" for second in seconds))
    assert log.time_s[0] == 0.0 and log.time_s[-1] == 5.0
    assert np.diff(log.time_s).min() > 0.0 and np.diff(log.time_s).max() <= 3.0
    assert any("steps back by up to 1 s" in doubt for doubt in log.reading.doubts)


def test_a_clock_that_is_set_back_leaves_a_gap_and_is_said(tmp_path: Path):
    log = clocked(tmp_path, "10:00:01", "10:00:02", "09:59:00", "09:59:01")
    assert np.diff(log.time_s).tolist() == [1.0, 60.0, 1.0]
    (doubt,) = log.reading.doubts
    assert "set back by 62 s after row 2" in doubt and "60 s" in doubt


def test_a_clock_that_jumps_ahead_is_said(tmp_path: Path):
    log = clocked(tmp_path, "10:00:01", "10:00:02", "15:00:02", "15:00:03")
    assert log.time_s.tolist() == [0.0, 1.0, 18001.0, 18002.0]
    (doubt,) = log.reading.doubts
    assert "18000 s after row 2" in doubt


def test_a_change_of_time_zone_is_no_jump(tmp_path: Path):
    clocks = ("11:34:58", "11:34:59", "16:35:00", "16:35:01", "11:35:02", "11:35:03")
    offsets = ("-05:00", "-05:00", "+00:00", "+00:00", "-05:00", "-05:00")
    log = clocked(tmp_path, *clocks, offsets=offsets)
    assert log.time_s.tolist() == [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]
    assert any("UTC offset changes 2 times" in doubt for doubt in log.reading.doubts)
    # An offset that is put right while the clock runs on is none either.
    clocks = tuple(f"11:34:{second}" for second in range(50, 56))
    assert clocked(tmp_path, *clocks, offsets=offsets).time_s.tolist() == [0, 1, 2, 3, 4, 5]


def test_a_clock_that_stands_still_does_not_stop_time(tmp_path: Path):
    seconds = [0, 1, 2, 3, *[4] * 30, 5, 6, 7]
    log = clocked(tmp_path, *(f"10:00:{second:02d}" for second in seconds))
    assert log.time_s[-1] == pytest.approx(36.0)
    assert np.diff(log.time_s).max() <= 1.01
    assert any("stands still" in doubt for doubt in log.reading.doubts)


def test_rows_out_of_order_are_refused(tmp_path: Path):
    lines = str(LogText(400)).splitlines()
    said = refusal(tmp_path, "\n".join([*lines[:3], *lines[:2:-1], ""]))
    assert "not in the order of time" in said


# Rows


@pytest.mark.parametrize("cut", [1, 4, 9, 60, 150, 230])
def test_a_last_row_that_is_cut_is_dropped(tmp_path: Path, cut: int):
    text = str(LogText(6))
    log = read(tmp_path, text[:-cut])
    assert_true(log, range(5))
    assert dropped(log) == {"cut off: no end of line after it": 1}


def test_rows_of_another_length_are_dropped_or_the_file_is_refused(tmp_path: Path):
    lines = str(LogText(6)).splitlines()
    short = lines[5].rpartition(",")[0]
    log = read(tmp_path, "\n".join([*lines[:5], short, *lines[6:], ""]))
    assert_true(log, [0, 1, 3, 4, 5])
    assert dropped(log) == {f"{len(CHANNEL_NAMES) + 2} fields, not {len(CHANNEL_NAMES) + 3}": 1}
    comma = "\n".join([*lines[:3], *(line.replace(".", ",") for line in lines[3:]), ""])
    said = refusal(tmp_path, comma)
    assert "49 fields" in said and "26 names" in said


def test_two_logs_in_one_file_are_refused(tmp_path: Path):
    said = refusal(tmp_path, str(LogText()) + str(LogText()))
    assert "second head at line 24" in said
    lines = str(LogText()).split("\n")
    said = refusal(tmp_path, "\n".join([*lines[:9], lines[1], *lines[9:]]))
    assert "second head at line 10" in said


def test_units_on_both_sides_of_the_names_must_agree(tmp_path: Path):
    lines = str(LogText(units={"E1 OilP": "bar"})).split("\n")
    assert_true(read(tmp_path, "\n".join([*lines[:3], lines[1], *lines[3:]])), range(20))
    other = lines[1].replace("bar", "psi")
    said = refusal(tmp_path, "\n".join([*lines[:3], other, *lines[3:]]))
    assert "column 'E1 OilP' is in 'bar' and in 'psi'" in said


def test_two_columns_of_one_name_are_refused(tmp_path: Path):
    said = refusal(tmp_path, LogText(order=(*CHANNEL_NAMES, "E1 CHT2")))
    assert "two columns named 'E1 CHT2'" in said


# Files


@pytest.mark.parametrize("name", ["a.csv", "a.CSV", "a.txt", "a.TXT", "a"])
@pytest.mark.parametrize(
    "text",
    [
        LogText(newline="\r\n"),
        LogText(separator=";"),
        LogText(separator=";", point=","),
        LogText(separator="\t", point=","),
        "\ufeff" + str(LogText()),
        str(LogText()) + "\x00" * 400,
    ],
    ids=["CRLF", "semicolons", "decimal commas", "tabs", "BOM", "NUL at the end"],
)
def test_whatever_it_is_called_and_however_it_is_separated(
    tmp_path: Path, text: LogText | str, name: str
):
    (tmp_path / name).write_text(str(text), encoding="utf-8", newline="")
    (log,), refused = read_logs(tmp_path)
    assert not refused
    assert_true(log, range(20))
    assert log.time_s.tolist() == list(range(20))


def test_commas_that_may_be_of_thousands_are_refused(tmp_path: Path):
    rows = ["105;10;2,400;50;60;70", "105;10;2,401;50;60;70", ""]
    said = refusal(tmp_path, "\n".join(["IAS;VSpd;E1 RPM;E1 OilP;volt1;amp1", *rows]))
    assert "'2,400'" in said and "thousands" in said
    mixed = str(LogText(separator=";", point=",")).replace("29,0", "29.0")
    text = mixed if mixed.count(".") > 2 else mixed.replace("105,", "105.")
    assert "decimal commas and decimal points" in refusal(tmp_path, text)


@pytest.mark.parametrize("encoding", ["utf-16", "cp1252"])
def test_other_encodings(tmp_path: Path, encoding: str):
    path = tmp_path / "a.csv"
    path.write_text(str(LogText(units={"E1 CHT1": "°C"})), encoding=encoding)
    assert_true(read_log(path), range(20))


JPI_SIX = "INDEX,DATE,TIME,E1,E2,E3,E4,E5,E6,C1,C2,C3,C4,C5,C6,OAT\n0,3/21/2025,13:14:56,6\n"
DYNON = '"Byte # in record";0;0;1\n"Mask";"0x00000080";"0x00000040";"0x0000003F"\n'
STRANGERS = {
    "empty.csv": ("", "is empty"),
    "jpi.csv": (JPI_SIX, "JPI engine monitor with 6 cylinders"),
    "dynon.csv": (DYNON, "raw data of a Dynon"),
    "shopping.csv": ("item,price\nbread,3\n", "no line with the names of G1000 columns"),
    "picture.png": ("\x89PNG\r\n\x1a\n\x00\x00\x00\rIHDR", "is not text"),
    "norows.csv": ("\n".join(LogText().head()) + "\n", "has no rows"),
}


def test_each_refusal_says_its_own_reason(tmp_path: Path):
    for name, (text, _) in STRANGERS.items():
        (tmp_path / name).write_text(text, encoding="latin-1", newline="")
    (tmp_path / "more").mkdir()
    with pytest.raises(InputError, match="nothing to read in"):
        read_logs(tmp_path)
    read(tmp_path, LogText(), "flight.CSV")
    logs, refused = read_logs(tmp_path)
    assert [log.name for log in logs] == ["flight.CSV"]
    assert set(refused) == {*STRANGERS, "more"}
    for name, (_, said) in STRANGERS.items():
        assert said in refused[name], refused[name]
    assert "folder" in refused["more"]
    assert len(set(refused.values())) == len(refused)
    with pytest.raises(InputError, match=r"no folder .*absent; give the folder .* --logs"):
        read_logs(tmp_path / "absent")
    with pytest.raises(InputError, match=r"is a file, not a folder"):
        read_logs(tmp_path / "flight.CSV")


# Aircraft


@pytest.mark.parametrize(
    ("airframe", "is_172"),
    [("Cessna 172S", True), ("Cessna 172P", True), ("C172 Skyhawk", True), ("C-172SP", True),
     ("Piper PA-28-181", False), ("Diamond DA42", False), ("Cessna 182T", False),
     ("Cessna 172RG", False), ("Cessna T1720", False)],
)  # fmt: skip
def test_the_aircraft_of_the_head_is_said(tmp_path: Path, airframe: str, is_172: bool):
    log = read(tmp_path, LogText(airframe=AIRFRAME.replace("Cessna 172S", airframe)))
    assert log.reading.aircraft == airframe
    why = log.reading.not_a_172
    assert (why is None) == is_172
    assert is_172 or airframe in str(why)


@pytest.mark.parametrize("column", ["E1 MAP", "E1 CHT5", "E1 Torq", "E2 RPM", "E1 CoolT"])
def test_the_columns_of_another_engine_are_said(tmp_path: Path, column: str):
    text = str(LogText(airframe="#airframe_info, ")).replace("UTCOfst", column)
    assert column in str(read(tmp_path, text).reading.not_a_172)


def test_an_aircraft_without_a_name_is_no_172_where_channels_lack(tmp_path: Path):
    text = LogText(airframe="")
    log = read(tmp_path, text)
    assert log.reading.aircraft is None and log.reading.not_a_172 is None
    assert any("names no aircraft" in doubt for doubt in log.reading.doubts)
    kept = tuple(name for name in CHANNEL_NAMES if name != "E1 CHT3")
    assert "E1 CHT3" in str(read(tmp_path, replace(text, order=kept)).reading.not_a_172)


def test_a_simulated_flight_is_recognised(tmp_path: Path):
    simulated = AIRFRAME.replace("NORMAL", "SIMULATED")
    log = read(tmp_path, LogText(airframe=simulated))
    assert log.reading.simulated and log.reading.not_a_172 is None
    demo = read(tmp_path, LogText(airframe=AIRFRAME.replace("NORMAL", "DEMO"))).reading
    assert not demo.simulated and "mode is 'DEMO'" in demo.doubts[0]


# Cruise, on logs as they are read


def test_cruise_is_found_and_a_gap_ends_a_stretch(tmp_path: Path):
    log = read(tmp_path, LogText(40))
    assert cruising(log).all()
    (stretch,) = steady_stretches(log)
    assert stretch == slice(5, 35)  # eleven seconds must be seen around each
    late = log.time_s + np.where(np.arange(40) >= 20, 30.0, 0.0)
    assert steady_stretches(Log("i", late, log.channels)) == [slice(5, 20), slice(20, 35)]


def test_white_noise_is_measured_through_a_trend():
    rng = np.random.default_rng(5)
    seconds = np.arange(4000.0)
    channels = np.tile(seconds[:, None] * 0.01, (1, len(CHANNELS))) + rng.normal(
        0.0, 0.3, (4000, len(CHANNELS))
    )
    channels[:, CHANNEL_NAMES.index("IAS")] += 100.0
    channels[:, CHANNEL_NAMES.index("E1 RPM")] += 2300.0
    found = describe([Log("trend", seconds, channels)])
    assert found.white_sd == pytest.approx(np.full(len(CHANNELS), 0.3), rel=0.08)
    assert found.steady_seconds > 3900


# Real logs


@REAL
def test_the_real_logs_give_the_figures_known_of_them():
    """Figures of the first log in ``../shared/facts/real_noise.csv`` (kgfk1), by the same rules."""
    log = read_log(LOGS / "c172s-g1000-20110701.csv")
    found = describe([log])
    assert abs(found.seconds - 1419) <= 2
    assert abs(found.steady_seconds - 503) <= 5
    for name, mean, white_sd in (
        ("E1 RPM", 2354.0, 1.755), ("E1 EGT2", 1403.0, 0.2421), ("E1 OilP", 72.06, 0.2663),
        ("IAS", 102.6, 0.2239), ("amp1", 0.4007, 0.06053), ("volt1", 28.08, 0.02536),
    ):  # fmt: skip
        k = CHANNEL_NAMES.index(name)
        assert found.mean[k] == pytest.approx(mean, rel=1e-3), name
        assert found.white_sd[k] == pytest.approx(white_sd, rel=0.05), name


@REAL
def test_of_the_real_logs_only_copies_and_cut_rows_are_dropped():
    logs, refused = read_logs(LOGS)
    assert set(refused) == {"dynon-d180-decimal-comma.csv", "jpi-edm930-six-cylinders.csv"}
    for log in logs:
        path = LOGS / log.name
        lines = path.read_bytes().decode(errors="replace").split("\n")
        native = lines[0].startswith("#airframe_info")
        below = [line for line in lines[3 if native else 2 :] if line]
        cut = not path.read_bytes().endswith(b"\n")
        copies = sum(a == b for a, b in pairwise(below)) if native else 0
        assert len(log) == len(below) - cut - copies, log.name
        assert sum(dropped(log).values()) == cut + copies, log.name
        assert np.diff(log.time_s).min() > 0.0, log.name
        if native:
            assert log.reading.aircraft == (None if "g3x" in log.name else "Cessna 172S")
        assert abs(np.nanmedian(log.channel("NormAc"))) < 0.2, log.name
        assert (log.reading.not_a_172 is None) == log.name.startswith("c172"), log.name


@REAL
def test_the_real_clock_that_jumps_by_five_hours():
    log = read_log(LOGS / "g3x-clock-jumps.csv")
    steps = np.diff(log.time_s)
    assert np.sort(steps)[-2:].tolist() == [3.0, 2110.0]
    assert log.time_s[-1] == 5113.0
    said = " ".join(log.reading.doubts)
    assert "UTC offset changes 4 times" in said and "2110 s" in said and "steps back" in said
    assert [each.column for each in log.reading.converted] == ["NormAc"]
    assert DEVICE["NormAc"] == "G"

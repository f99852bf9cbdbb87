"""Real logs: two kinds of export, and what is wrong with some of them."""

from pathlib import Path

import numpy as np
import pytest

from core.channels import CHANNEL_NAMES, CHANNELS
from core.errors import InputError
from core.experiments.cruise import cruising, describe, steady_stretches
from core.experiments.g1000 import LOGS, Log, read_log, read_logs

NATIVE_HEADER = (
    '#airframe_info, log_version="1.00", airframe_name="Cessna 172S"\n'
    "#yyy-mm-dd, hh:mm:ss,   hh:mm,  ident, degrees\n"
)


def level_values(name: str, second: int) -> str:
    """A steady cruise, told apart from channel to channel by its decimals."""
    values = {"IAS": 105.0, "VSpd": 10.0, "E1 RPM": 2400.0, "AltMSL": 3000.5, "NormAc": -0.02}
    return f"{values.get(name, 40.0 + CHANNEL_NAMES.index(name)) + 0.001 * second:.3f}"


def native(
    path: Path,
    rows: int = 40,
    drop: tuple[str, ...] = (),
    clocks: list[str] | None = None,
) -> Path:
    """A log as the G1000 writes it: comment, units, padded names; cells padded too."""
    names = [name for name in reversed(CHANNEL_NAMES) if name not in drop]
    lines = ["  Lcl Date, Lcl Time, UTCOfst, AtvWpt, " + ", ".join(f"{n:>8}" for n in names)]
    for second in range(rows):
        clock = clocks[second] if clocks else f"10:{second // 60:02d}:{second % 60:02d}"
        cells = [f"{level_values(name, second):>9}" for name in names]
        lines.append(f"2014-10-29, {clock},  -05:00,       ," + ",".join(cells))
    path.write_text(NATIVE_HEADER + "\n".join(lines) + "\n")
    return path


def test_native_log_in_our_order(tmp_path: Path):
    log = read_log(native(tmp_path / "a.csv"))
    assert len(log) == 40
    assert log.channels.shape == (40, len(CHANNELS))
    assert log.channel("IAS")[7] == pytest.approx(105.007)
    assert log.channel("E1 CHT3")[0] == pytest.approx(40.0 + CHANNEL_NAMES.index("E1 CHT3"))
    assert log.time_s.tolist() == list(range(40))
    assert log.missing == ()


def test_export_without_a_clock_repeats_its_names_in_a_comment(tmp_path: Path):
    names = ["AltAGL", *CHANNEL_NAMES, "volt1 Lag"]
    rows = [
        ", ".join(["0.0", *(level_values(n, s) for n in CHANNEL_NAMES), "NaN"]) for s in range(5)
    ]
    header = ", ".join(names)
    path = tmp_path / "b.csv"
    path.write_text("\n".join([f"#{header}, number_events = 8", header, *rows]))
    log = read_log(path)
    assert log.time_s.tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]
    assert log.channel("volt1")[4] == pytest.approx(40.004)


def test_blank_cells_are_unknown_and_a_cut_last_row_is_no_harm(tmp_path: Path):
    path = native(tmp_path / "c.csv", rows=6)
    lines = path.read_text().splitlines()
    cells = lines[5].split(",")
    cells[4:7] = ["   ", " - ", "NaN"]
    lines[5] = ",".join(cells)
    path.write_text("\n".join(lines)[:-60])
    log = read_log(path)
    blank = [name for name in CHANNEL_NAMES if np.isnan(log.channel(name)[2])]
    assert sorted(blank) == sorted(CHANNEL_NAMES[:-4:-1])
    assert len(log) == 6


def test_seconds_logged_twice_count_once_and_gaps_stay_gaps(tmp_path: Path):
    clocks = ["10:00:01", "10:00:01", "10:00:02", "10:00:04", "10:00:50", "09:59:00", "09:59:01"]
    log = read_log(native(tmp_path / "d.csv", rows=7, clocks=clocks))
    assert np.diff(log.time_s).tolist() == [1.0, 2.0, 46.0, 60.0, 1.0]


def test_a_channel_may_be_missing_but_not_those_that_tell_cruise(tmp_path: Path):
    log = read_log(native(tmp_path / "e.csv", drop=("E1 EGT4", "amp2")))
    assert log.missing == ("amp2", "E1 EGT4")
    for name in ("IAS", "VSpd", "E1 RPM"):
        path = native(tmp_path / "f.csv", drop=(name,))
        with pytest.raises(InputError, match=rf"logs: f\.csv has no column '{name}'"):
            read_log(path)


def test_a_column_of_words_is_named(tmp_path: Path):
    path = native(tmp_path / "g.csv")
    path.write_text(path.read_text().replace("105.0", "fast "))
    with pytest.raises(InputError, match=r"g\.csv: column 'IAS' holds no numbers"):
        read_log(path)


def test_what_is_no_log_is_said_so(tmp_path: Path):
    (tmp_path / "shopping.csv").write_text("item,price\nbread,3\n")
    with pytest.raises(InputError, match=r"nothing to read .* shopping\.csv has no line with the"):
        read_logs(tmp_path)
    native(tmp_path / "flight.CSV")
    logs, refused = read_logs(tmp_path)
    assert [log.name for log in logs] == ["flight.CSV"]
    assert list(refused) == ["shopping.csv"]
    with pytest.raises(InputError, match=r"no folder .*absent; give the folder .* --logs"):
        read_logs(tmp_path / "absent")


def test_cruise_is_found_and_a_gap_ends_a_stretch(tmp_path: Path):
    log = read_log(native(tmp_path / "h.csv"))
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


@pytest.mark.skipif(not LOGS.is_dir(), reason="no real logs beside this checkout")
def test_the_real_logs_give_the_figures_known_of_them():
    """Figures of the first log in ``../shared/facts/real_noise.csv`` (kgfk1), by the same rules."""
    logs, refused = read_logs(LOGS)
    assert not refused
    (log,) = (log for log in logs if "20110701" in log.name)
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

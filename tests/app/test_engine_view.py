"""The engine view, the marks and the units: what the browser is told to draw, and in what."""

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scripts import answers

from app.figures.engine_view import SCALES, gauge_spec
from app.figures.marks import limit_marks, named_marks, track, verdict_marks
from app.figures.sensors import tile_specs
from app.pages.fly.cursor_tools import UNIT_CHOICES
from app.theme import DIVERGING
from core.channels import CHANNELS, CYLINDERS, N_CHANNELS, channel, cht_name, egt_name
from core.cylinders import LAYOUT
from core.diagnosis.diagnosis import Diagnosis, Evidence
from core.fmea.catalogue import class_ids
from core.fmea.fault import Fault
from core.twin.events import FlightEvent, flight_events
from core.twin.trajectory import STATE_NAMES, Trajectory
from core.units import OTHER_UNITS, QUANTITIES

FAULT = Fault("engine_failure", 0.8, 60.0)
RIGHT = class_ids().index("engine_failure")


class TestGauges:
    def test_a_reading_has_the_status_that_its_limits_give_it(self) -> None:
        readings = [
            ("E1 CHT2", 320.0, "normal"),
            ("E1 CHT2", 450.0, "caution"),
            ("E1 CHT2", 501.0, "limit"),
            ("E1 CHT2", 80.0, "quiet"),
            ("E1 EGT1", 800.0, "caution"),
            ("E1 OilP", 20.0, "limit"),
            ("E1 OilP", 40.0, "caution"),
            ("E1 OilP", 75.0, "normal"),
            ("E1 OilP", 120.0, "limit"),
            ("E1 OilT", 246.0, "limit"),
            ("E1 RPM", 1500.0, "quiet"),
            ("E1 RPM", 2701.0, "limit"),
            ("volt1", 24.0, "limit"),
            ("amp1", -10.0, "caution"),
        ]
        calls = [[gauge_spec(channel(name)), value] for name, value, _ in readings]
        assert answers("kit/gauge.js", "statusOf", calls) == [status for *_, status in readings]

    def test_every_cylinder_and_system_of_the_engine_has_one(self) -> None:
        for cylinder in CYLINDERS:
            assert {egt_name(cylinder), cht_name(cylinder)} <= SCALES.keys()
        shown = {logged.name for logged in CHANNELS if logged.subsystem != "flight"}
        assert shown == SCALES.keys()
        assert gauge_spec(channel("IAS")) is None

    def test_each_is_drawn_where_the_engine_has_it(self) -> None:
        specs = {logged.name: gauge_spec(logged) or {} for logged in CHANNELS}
        for cylinder, place in LAYOUT.items():
            kinds = {egt_name(cylinder): "EGT", cht_name(cylinder): "CHT"}
            for name, kind in kinds.items():
                spec = specs[name]
                assert (spec["form"], spec["title"], spec["cylinder"]) == (
                    "cylinder",
                    kind,
                    cylinder,
                )
                assert spec["place"] == {"side": place.side, "row": place.row}
            assert specs[egt_name(cylinder)]["order"] < specs[cht_name(cylinder)]["order"]
        assert specs["E1 RPM"]["form"] == "dial"
        beside = sorted(
            (spec["order"], spec["title"]) for spec in specs.values() if spec.get("form") == "bar"
        )
        assert list(dict.fromkeys(title for _, title in beside)) == ["Oil", "Fuel", "Electrical"]

    @pytest.mark.parametrize("name", SCALES)
    def test_bands_follow_each_other_and_the_limits_are_on_the_scale(self, name: str) -> None:
        spec = gauge_spec(channel(name))
        assert spec is not None
        bands = spec["bands"]
        assert all(one["to"] == other["from"] for one, other in pairwise(bands))
        assert (bands[0]["from"], bands[-1]["to"]) == (spec["low"], spec["high"])
        assert all(spec["low"] < limit < spec["high"] for limit in spec["red"])


class TestUnits:
    @pytest.mark.parametrize(
        ("unit", "logged", "shown"),
        [
            ("degF", 212.0, 100.0),
            ("degF", 32.0, 0.0),
            ("ft", 10_000.0, 3048.0),
            ("kt", 100.0, 185.2),
            ("psi", 14.5038, 1.0),
            ("gal", 1.0, 3.78541),
            ("gph", 10.0, 37.8541),
            ("fpm", 196.85, 1.0),
        ],
    )
    def test_readings_are_converted(self, unit: str, logged: float, shown: float) -> None:
        assert OTHER_UNITS[unit].value(logged) == pytest.approx(shown, rel=1e-4, abs=1e-9)

    def test_a_difference_has_no_offset(self) -> None:
        assert OTHER_UNITS["degF"].difference(9.0) == pytest.approx(5.0)

    def test_coarser_units_get_more_digits(self) -> None:
        extra = {unit: other.extra_decimals for unit, other in OTHER_UNITS.items()}
        assert extra == {"degF": 0, "ft": 0, "fpm": 2, "kt": 0, "psi": 1, "gal": 0, "gph": 0}

    def test_each_unit_belongs_to_a_channel_and_each_quantity_can_be_chosen(self) -> None:
        assert {logged.unit for logged in CHANNELS} >= OTHER_UNITS.keys()
        assert tuple(UNIT_CHOICES) == QUANTITIES

    def test_the_browser_is_told_of_each_conversion(self) -> None:
        for spec, logged in zip(tile_specs(), CHANNELS, strict=True):
            other = OTHER_UNITS.get(logged.unit)
            assert (spec["other"] or {}).get("factor") == (other and other.factor)


def diagnosis(wrong: tuple[int, ...], *evidence: Evidence) -> Diagnosis:
    """Windows every 5 s that are right but for some; those have another class in the lead."""
    over_time = np.full((40, 20), 0.001, dtype=np.float32)
    over_time[:, RIGHT] = 0.9
    over_time[list(wrong), (RIGHT + 1) % 20] = 0.95
    time_s = 30.0 + 5.0 * np.arange(40)
    return Diagnosis(class_ids(), time_s, over_time, over_time[-1], evidence, 61.0, "cnn", "lab")


def evidence(name: str, onset_s: float) -> Evidence:
    return Evidence(name, onset_s, onset_s + 9, -5.0, "psi", "-", 9.0, onset_s)


class TestMarks:
    def test_the_first_evidence_is_the_earliest_and_named(self) -> None:
        found = diagnosis((), evidence("E1 CHT1", 70.0), evidence("E1 OilP", 62.0))
        marks = {mark["kind"]: mark for mark in verdict_marks(found, FAULT)}
        assert marks["evidence"]["time_s"] == 62.0
        assert "Oil pressure" in marks["evidence"]["label"]

    def test_a_right_answer_counts_only_once_it_stays(self) -> None:
        # Windows 6 to 8 end at 60, 65 and 70 s; a slip at 80 s spoils what came before.
        found = diagnosis((6, 7, 10))
        (named,) = named_marks(found.classes, found.time_s, found.probabilities_over_time, FAULT)
        assert named["time_s"] == 85.0

    def test_no_answer_and_no_fault_give_no_mark(self) -> None:
        never = diagnosis(tuple(range(40)))
        assert verdict_marks(never, FAULT) == []
        assert verdict_marks(diagnosis(()), Fault("nominal", 0.0, 0.0)) == []
        assert named_marks(class_ids(), np.empty(0), np.empty((0, 20)), FAULT) == []

    def test_limits_exceeded_are_marked_on_their_channel_for_as_long(self) -> None:
        n = 1000
        channels = np.full((n, N_CHANNELS), 70.0, dtype=np.float32)
        index = [logged.name for logged in CHANNELS].index("E1 OilP")
        channels[200:400, index] = 20.0
        flight = Trajectory(np.arange(n) / 50.0, np.zeros((n, len(STATE_NAMES))), channels)
        mark = next(m for m in limit_marks(flight_events(flight)) if m["channel"] == "E1 OilP")
        assert (mark["time_s"], mark["end_s"]) == (4.0, 7.98)
        assert mark["label"] == "Oil pressure below 25 psi"

    def test_of_endless_crossings_the_longest_are_kept_in_order(self) -> None:
        events = [FlightEvent("IAS", t, t + 1 + t / 1e4, 160.0, 158.0, "kt") for t in range(500)]
        marks = limit_marks([*events, FlightEvent("stall", 600.0, 900.0, 20.0, 16.0, "deg")])
        times = [mark["time_s"] for mark in marks]
        assert times == sorted(times)
        assert len(marks) == 200
        assert marks[-1]["label"] == "Stall"

    def test_the_track_holds_the_leaders_of_each_window(self) -> None:
        found = diagnosis((0,))
        names = dict.fromkeys(found.classes, "?") | {"engine_failure": "Engine failure"}
        sent: dict[str, Any] = track(
            "r", names, found.time_s, found.probabilities_over_time, {"engine_failure": "#123456"}
        )
        assert sent["classes"][RIGHT] == {"name": "Engine failure", "colour": "#123456"}
        assert [place for place, _ in sent["leaders"][0]][:2] == [(RIGHT + 1) % 20, RIGHT]
        assert sent["leaders"][1][0] == (RIGHT, 0.9)
        assert len(sent["leaders"]) == len(sent["time_s"]) == 40


SIMULATED = {
    "protanopia": [
        [0.152286, 1.052583, -0.204868],
        [0.114503, 0.786281, 0.099216],
        [-0.003882, -0.048116, 1.051998],
    ],
    "deuteranopia": [
        [0.367322, 0.860646, -0.227968],
        [0.280085, 0.672501, 0.047413],
        [-0.011820, 0.042940, 0.968881],
    ],
    "tritanopia": [
        [1.255528, -0.076749, -0.178779],
        [-0.078411, 0.930809, 0.147602],
        [0.004733, 0.691367, 0.303900],
    ],
}
"""Machado, Oliveira and Fernandes 2009, severity 1, on linear RGB."""


def lab(colour: str, sight: str) -> np.ndarray:
    """CIELAB of a colour as somebody of that sight has it."""
    shares = np.array([int(colour[at : at + 2], 16) for at in (1, 3, 5)]) / 255.0
    linear = np.where(shares <= 0.04045, shares / 12.92, ((shares + 0.055) / 1.055) ** 2.4)
    seen = np.clip(np.array(SIMULATED[sight]) @ linear, 0.0, 1.0)
    to_xyz = np.array(
        [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
    )
    xyz = to_xyz @ seen / np.array([0.9505, 1.0, 1.089])
    f = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16.0 / 116.0)
    return np.array([116.0 * f[1] - 16.0, 500.0 * (f[0] - f[1]), 200.0 * (f[1] - f[2])])


@pytest.mark.parametrize("sight", SIMULATED)
def test_the_heat_strip_tells_above_from_below_in_every_sight(sight: str) -> None:
    colours = dict(DIVERGING)
    for below, above in ((0.0, 1.0), (0.25, 0.75)):
        apart = float(np.linalg.norm(lab(colours[below], sight) - lab(colours[above], sight)))
        assert apart > 40.0

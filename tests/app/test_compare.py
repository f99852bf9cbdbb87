"""The page Compare: addresses, what differs, figures true to the runs."""

import json
from base64 import b64decode
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import plotly.graph_objects as go
import pytest
from dash._utils import to_json

from app.figures.comparison import (
    MAX_COMPARED,
    PATH_STATES,
    channels_figure,
    framed,
    side_figure,
    track_figure,
    values_of,
)
from app.figures.paths_3d import RISES, described, paths_figure, separations
from app.kit.addresses import compare_path
from app.kit.words import short_titles
from app.pages.compare import page as compare
from app.pages.compare.callbacks import _all_flown
from app.pages.registry import read_address
from app.pages.runs.page import row_of
from core.diagnosis.predict import load_diagnoser
from core.experiments.paper.fig7 import KEY_CHANNELS
from core.experiments.registry import COMPARED
from core.fmea.fault import Fault
from core.report.case.case import open_case
from core.report.grounded import grounded_template
from core.store.labels import Label, delete
from core.store.store import RunStore
from core.twin.actions import SetFault
from core.twin.flight import fly_pair
from core.twin.plan import Plan
from core.units import distance_words

PLAN = Plan(duration_s=120.0, seed=5)


def sent(component: object) -> str:
    """What goes to the browser, as readable JSON."""
    return json.dumps(json.loads(to_json(component)), ensure_ascii=False, separators=(",", ":"))


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunStore]:
    """Two finished runs, a failure and a nominal flight, and one that never flew."""
    store = RunStore(tmp_path_factory.mktemp("store"))
    for fault in (Fault("nominal"), Fault("engine_failure", 0.8, 30.0)):
        run_id = store.create(PLAN, fault).id
        pair = fly_pair(PLAN, fault)
        store.save_pair(run_id, pair)
        diagnosis = load_diagnoser().diagnose(pair)
        store.save_result(run_id, diagnosis, grounded_template(open_case(diagnosis)))
    store.create(replace(PLAN, seed=6), Fault("baffle_seal"))
    yield store
    store.close()


@pytest.fixture
def ids(store: RunStore) -> list[str]:
    """The finished runs, the nominal one first."""
    done = [record for record in store.records() if record.status == "done"]
    return [record.id for record in reversed(done)]


def test_each_run_says_whether_its_diagnosis_was_right(store: RunStore, ids: list[str]) -> None:
    page = sent(compare.layout(ids, None, store))
    assert page.count('"data-right":"true"') == 2
    assert page.count('" right"') == 2


def test_addresses(store: RunStore, ids: list[str]) -> None:
    assert read_address("/compare", store).kind == "compare"
    assert read_address(compare_path(ids), store).run_ids == tuple(ids)
    twice = read_address(compare_path([*ids, ids[0]]), store)
    assert twice.run_ids == tuple(ids)
    for name in COMPARED:
        assert read_address(f"/compare/{name}", store).item == name
    for bad in ("nonsense", f"{ids[0]},nonsense", "20261123T061500-k3x9q2wz"):
        assert read_address(f"/compare/{bad}", store).kind == "missing"
    too_many = ",".join(f"20261123T061500-k3x9q2w{letter}" for letter in "abcdefg")
    assert f"At most {MAX_COMPARED}" in read_address(f"/compare/{too_many}", store).problem


def test_only_what_differs_is_listed(store: RunStore, ids: list[str]) -> None:
    rows = dict(compare.differences([store.get(run_id) for run_id in ids]))
    assert rows["Fault"] == ["Nominal", "Engine failure"]
    assert "Altitude" not in rows
    assert "Seed" not in rows
    assert rows["Severity"] == ["–", "0.8"]


def test_a_live_flight_has_the_fault_that_was_injected(store: RunStore, ids: list[str]) -> None:
    preset = compare.presets()["fig6"]
    begun = SetFault(47.0, "baffle_crack", 0.6)
    live = store.create(PLAN, Fault("nominal"), [begun])
    store.save_pair(live.id, store.load_pair(ids[0])[:100])
    rows = dict(compare.differences([store.get(ids[0]), live]))
    assert rows["Fault"] == ["Nominal", "Baffle crack"]
    assert rows["Onset"] == ["–", "0:47"]
    (drawn,) = _all_flown([live.id], ["E1 RPM"], store)
    assert (drawn.label, drawn.onset_s) == ("Baffle crack", 47.0)
    assert row_of(live, Label())["fault"] == "Baffle crack"
    acted = store.create(preset.plan, preset.faults[0], [begun])
    assert acted.id not in [run.id for run in compare.preset_runs(preset, store) if run]
    delete(store, [live.id, acted.id])


def test_settings_are_told_with_units(store: RunStore) -> None:
    low, high = (
        store.create(Plan(altitude_ft=altitude_ft, speed_kt=100.0), Fault("nominal"))
        for altitude_ft in (4000.0, 6000.0)
    )
    assert compare.differences([low, high]) == [("Altitude", ["4,000 ft", "6,000 ft"])]


def test_a_preset_takes_stored_runs_and_says_what_is_missing(store: RunStore) -> None:
    preset = compare.presets()["fig6"]
    assert compare.preset_runs(preset, store) == [None] * 6
    assert "Fly 6" in sent(compare.layout((), "fig6", store))
    record = store.create(preset.plan, preset.faults[1])
    found = compare.preset_runs(preset, store)
    assert [each.id if each else None for each in found] == [None, record.id, *[None] * 4]
    assert "5 of its 6 flights" in sent(compare.layout((), "fig6", store))
    store.update(record.id, status="failed", error="no")
    assert compare.preset_runs(preset, store) == [None] * 6


def test_a_run_that_has_not_landed_is_waited_for(store: RunStore, ids: list[str]) -> None:
    waiting = next(record.id for record in store.records() if record.status == "queued")
    page = sent(compare.layout([ids[0], waiting], None, store))
    assert '"disabled":false' in page
    assert "flying or queued" in page
    assert '"disabled":true' in sent(compare.layout(ids, None, store))


def test_channels_are_drawn_as_flown(store: RunStore, ids: list[str]) -> None:
    runs = _all_flown(ids, KEY_CHANNELS, store)
    pair = store.load_pair(ids[1])
    assert np.array_equal(values_of(runs[1], runs[0], "E1 RPM", "residual"), pair.residual[:, 9])
    assert not values_of(runs[0], runs[0], "E1 RPM", "difference").any()
    for kind in ("reading", "residual", "difference"):
        figure = go.Figure(channels_figure(runs, KEY_CHANNELS, kind))
        assert len(figure.data) == len(ids) * len(KEY_CHANNELS)
        assert "rpm" in figure.layout.yaxis.title.text
        assert len({(line.line.color, line.line.dash) for line in figure.data}) == len(ids)


def test_paths_are_drawn_in_feet_and_nautical_miles(store: RunStore, ids: list[str]) -> None:
    runs = _all_flown(ids, PATH_STATES, store)
    assert [run.label for run in runs] == ["Nominal", "Engine failure"]
    for figure in (side_figure(runs, against_mirror=True), track_figure(runs)):
        axes = go.Figure(figure).layout
        assert "nm" in axes.xaxis.title.text
    flown_nm = side_figure(runs, against_mirror=False)["data"][0]["x"]
    assert flown_nm["dtype"] == "f4"


def test_paths_in_space_are_where_they_were_flown_and_drawn_to_one_scale(
    store: RunStore, ids: list[str]
) -> None:
    runs = _all_flown(ids, PATH_STATES, store)
    pair = store.load_pair(ids[1])
    for rise in RISES:
        figure = paths_figure(runs, rise)
        scene = go.Figure(figure).layout.scene
        lines = [
            {name: np.frombuffer(b64decode(line[name]["bdata"]), np.float32) for name in "xyz"}
            for line in figure["data"]
        ]
        named = dict(zip([line["name"] for line in figure["data"]], lines, strict=True))
        assert {"Mirror of Nominal", "Engine failure, to its mirror"} <= named.keys()
        path = next(
            line
            for line, trace in zip(lines, figure["data"], strict=True)
            if trace["name"] == "Engine failure" and trace["mode"] == "lines"
        )
        assert path["z"][-1] == pytest.approx(pair.faulted.state("altitude_ft")[-1], abs=0.01)
        assert 1852 * path["y"][-1] == pytest.approx(pair.faulted.state("north_m")[-1], abs=0.5)
        # Metres a unit of the drawn box: the same along all axes, but for how heights are drawn.
        ratio = [scene.aspectratio[name] for name in "xyz"]
        spans = [np.diff(scene[f"{name}axis"].range).item() for name in "xyz"]
        scales = np.array([1852.0, 1852.0, 0.3048]) * spans / ratio
        assert scales * [1, 1, rise] == pytest.approx(np.full(3, scales[0]))
        for name in "xyz":
            low, high = scene[f"{name}axis"].range
            assert all(low < np.nanmin(line[name]) for line in lines)
            assert all(np.nanmax(line[name]) < high for line in lines)


def test_how_far_a_flight_came_from_its_mirror_is_said_in_words(
    store: RunStore, ids: list[str]
) -> None:
    runs = _all_flown(ids, PATH_STATES, store)
    nominal, failed = separations(runs)
    assert (nominal.label, nominal.distance_m) == ("Nominal", 0.0)
    pair = store.load_pair(ids[1])
    row = round(failed.time_s * 50)
    north, east, up = (
        (pair.faulted.state(name) - pair.mirror.state(name))[row] for name in PATH_STATES
    )
    expected_m = float(np.sqrt(north**2 + east**2 + (0.3048 * up) ** 2))
    assert failed.distance_m == pytest.approx(expected_m, abs=0.01)
    words = described(runs)
    assert f"Engine failure, {distance_words(expected_m)} at 2:00" in words
    assert words.endswith("Nominal, none.")
    assert described(runs[:1]).startswith("1 flight path in space")
    elsewhere = [runs[0], replace(runs[1], mirror=runs[1].faulted)]
    drawn = [line["name"] for line in paths_figure(elsewhere)["data"]]
    assert "Engine failure, to its mirror" not in drawn, "it had another mirror than the one shown"


def test_one_wild_line_does_not_flatten_the_others() -> None:
    calm, lively, wild = np.linspace(0.0, 3.0, 50), -np.linspace(0.0, 9.0, 50), np.full(50, -900.0)
    low, high = framed([calm, lively, wild], 1.0)
    assert -12.0 < low < -9.0
    assert 3.0 < high < 6.0
    assert framed([wild], 1.0)[0] < -900.0
    assert framed([np.zeros(5)], 1.0) == [-0.5, 0.5]


def test_some_columns_are_read_as_stored(store: RunStore, ids: list[str], tmp_path: Path) -> None:
    pair = store.load_pair(ids[1])
    columns = store.load_columns(ids[1], ["time_s", "faulted.E1 OilT", "mirror.altitude_ft"])
    assert np.array_equal(columns["time_s"], pair.faulted.time_s)
    assert np.array_equal(columns["faulted.E1 OilT"], pair.faulted.channel("E1 OilT"))
    assert np.array_equal(columns["mirror.altitude_ft"], pair.mirror.state("altitude_ft"))


def test_runs_of_one_mode_are_told_apart_by_name(store: RunStore) -> None:
    ids = [record.id for record in store.records() if record.status == "done"]
    (again,) = (store.get(run_id) for run_id in ids if store.get(run_id).fault.mode != "nominal")
    milder = replace(again, id="20261123T061500-aaaaaaaa", fault=replace(again.fault, severity=0.3))
    twin = replace(again, id="20261123T061500-bbbbbbbb", plan=replace(PLAN, seed=9))
    assert short_titles([again]) == ["Engine failure"]
    assert short_titles([again, milder]) == [
        "Engine failure, severity 0.80",
        "Engine failure, severity 0.30",
    ]
    assert short_titles([again, twin])[1] == "Engine failure, severity 0.80, seed 9"
    assert sent(compare._table([again, milder])).count("severity 0.30") == 1

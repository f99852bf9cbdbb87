"""The catalogue's pages: every mode has one, nothing on it is unlabelled, figures are true."""

import json

import numpy as np
import plotly.graph_objects as go
import pytest
from dash._utils import to_json

from app.figures.growth import growth_figure
from app.figures.residuals import NOISE_SIGMA
from app.figures.signature import COLUMNS, expected_text, strength
from app.pages.faults import mode_page as fault_page
from app.pages.faults import page as faults
from app.pages.registry import read_address
from core.channels import CHANNEL_INDEX
from core.experiments.signs.growth import GROWTH_SEVERITIES, Growth, fly_growth
from core.experiments.stored import StoredResult, load_result
from core.fmea.catalogue import catalogue
from core.knowledge.knowledge import knowledge
from core.knowledge.search import search
from core.store.store import RunStore


def sent(component: object) -> str:
    """What goes to the browser, as readable JSON."""
    return json.dumps(json.loads(to_json(component)), ensure_ascii=False, separators=(",", ":"))


@pytest.fixture(scope="module")
def crack() -> Growth:
    return fly_growth("baffle_crack")


@pytest.mark.parametrize("mode", catalogue())
def test_every_mode_has_a_page_that_says_all_that_is_written(mode: str) -> None:
    page = sent(fault_page.mode_layout(mode, load_result("signs")))
    written = knowledge()[mode]
    steps = [step.text for step in written.chain]
    tells = [item.tell for item in written.look_alikes]
    for text in (written.mechanism, written.summary, *written.actions, *steps, *tells):
        assert json.dumps(text, ensure_ascii=False)[1:-1] in page
    for item in written.look_alikes:
        assert faults.fault_path(item.mode) in page


def test_without_the_sign_matrix_a_page_says_which_command_makes_it() -> None:
    page = sent(fault_page.mode_layout("baffle_seal", StoredResult("signs", None)))
    assert fault_page.SIGNS_COMMAND in page
    assert "Twin 0.3" not in page


def test_the_matrix_has_a_row_a_mode_and_a_cell_a_channel() -> None:
    page = sent(faults.matrix(list(knowledge())))
    assert page.count('"scope":"row"') == len(catalogue())
    assert page.count('"className":"sig') >= len(catalogue()) * len(COLUMNS)


def test_expected_shifts_are_told_with_sign_and_unit() -> None:
    seal = knowledge()["baffle_seal"].signature(1)
    assert expected_text(seal["E1 CHT1"], "E1 CHT1") == "+8 to +24 °F"
    assert expected_text(seal["E1 OilP"], "E1 OilP") == "−0.3 to −1.2 psi"
    assert strength(seal["E1 CHT1"], "E1 CHT1") > strength(seal["E1 OilP"], "E1 OilP")


def test_a_crack_grows_with_severity_and_moves_its_cylinder_most(crack: Growth) -> None:
    index = crack.moved(NOISE_SIGMA, 6)[0]
    assert index == CHANNEL_INDEX["E1 CHT1"]
    ends = [crack.residuals[severity][-1, index] for severity in GROWTH_SEVERITIES]
    assert 0.0 < ends[0] < ends[1] < ends[2]
    before = crack.time_s < 60.0
    assert np.all(crack.severest[before] == 0.0)


def test_nothing_moves_in_nominal_flight() -> None:
    assert fly_growth("nominal").moved(NOISE_SIGMA, 6) == []


def test_a_growth_chart_is_a_valid_figure_with_a_line_a_severity(crack: Growth) -> None:
    figure = go.Figure(growth_figure(crack, CHANNEL_INDEX["E1 CHT1"]))
    assert [trace.name for trace in figure.data] == ["severity 0.3", "severity 0.6", "severity 1"]
    assert len({trace.line.dash for trace in figure.data}) == 3
    assert "°F" in figure.data[0].hovertemplate


def test_a_search_without_hits_offers_a_way_on() -> None:
    assert faults.hit_list("  ", []) is None
    page = sent(faults.hit_list("<script>x</script>", search("qqqqqq")))
    assert "No match for" in page
    assert faults.fault_path("rocker_cover_leak") in sent(
        faults.hit_list("oil", search("gasket weeps oil"))
    )


@pytest.mark.parametrize(
    ("path", "kind", "mode"),
    [
        ("/faults", "faults", None),
        ("/faults/", "faults", None),
        ("/faults/baffle_seal", "faults", "baffle_seal"),
        ("/faults/nonsense", "missing", None),
        ("/faults/a/b", "missing", None),
        ("/fly/baffle_seal", "fly", "baffle_seal"),
        ("/fly/nonsense", "missing", None),
        ("/fly", "missing", None),
    ],
)
def test_addresses_of_modes(
    path: str, kind: str, mode: str | None, tmp_path_factory: pytest.TempPathFactory
) -> None:
    store = RunStore(tmp_path_factory.mktemp("store"))
    address = read_address(path, store)
    assert (address.kind, address.item) == (kind, mode)
    assert bool(address.problem) == (kind == "missing")
    store.close()


def test_a_damaged_result_is_told_and_a_missing_one_is_not_an_error(tmp_path) -> None:
    (tmp_path / "signs.json").write_text("{")
    assert "damaged" in load_result("signs", tmp_path).problem
    assert load_result("fig6", tmp_path) == StoredResult("fig6", None)

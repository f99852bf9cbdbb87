"""The page Results: every exhibit shows what is there, and teaches where nothing is."""

import json
from pathlib import Path

import numpy as np
import plotly.graph_objects as go
import pytest
from dash._utils import to_json

from app.cli import main
from app.figures.scores import beside_paper, confusion_figure
from app.pages.results import page as results
from app.pages.results.measures import MEASURES
from app.pages.results.model_card import card_line, model_parts
from core.experiments.paper.published import paper_tables
from core.experiments.registry import EXPERIMENTS, RUNNABLE, Experiment
from core.experiments.stored import ONSET_KNOWN, load_result, model_cards
from core.knowledge.knowledge import tell_apart


def sent(component: object) -> str:
    """What goes to the browser, as readable JSON."""
    return json.dumps(json.loads(to_json(component)), ensure_ascii=False, separators=(",", ":"))


@pytest.fixture
def shelf(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of results of the test's own."""
    monkeypatch.setattr(results, "load_result", lambda name: load_result(name, tmp_path))
    return tmp_path


def write(folder: Path, name: str, **content: object) -> None:
    (folder / f"{name}.json").write_text(json.dumps(content))


@pytest.mark.parametrize("name", [None, *EXPERIMENTS])
def test_every_page_is_laid_out_from_the_shipped_results(name: str | None) -> None:
    page = sent(results.layout(name))
    assert "written by another version" not in page
    assert "NaN" not in page


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_without_results_a_page_says_which_command_makes_them(name: str, shelf: Path) -> None:
    exhibit = EXPERIMENTS[name]
    if exhibit.kind != "model":
        assert exhibit.command in sent(results.layout(name))
    assert all(
        item.command in sent(results.layout(None)) for item in map(EXPERIMENTS.get, ["table1"])
    )


@pytest.mark.parametrize("exhibit", EXPERIMENTS.values(), ids=EXPERIMENTS)
def test_every_command_exists(exhibit: Experiment) -> None:
    _, command, *options = exhibit.command.split()
    if command == "experiment":
        assert options[0] in RUNNABLE
    else:
        with pytest.raises(SystemExit) as end:
            main([command, *options, "--help"])
        assert end.value.code == 0


def test_the_papers_scores_stand_where_ours_are_missing(shelf: Path) -> None:
    page = sent(results.layout("table1"))
    assert f"{paper_tables()['table1'][0]['macro_f1']:.3f}" in page
    assert '"ours"' not in page


def test_a_half_filled_table_shows_what_is_there(shelf: Path) -> None:
    rows = [
        {"scheme": "A", "macro_f1": 0.91234, "macro_f1_sd": 0.004, "paper_macro_f1": 0.961},
        {"scheme": "B", "macro_f1": None, "macro_f1_sd": None, "paper_macro_f1": 0.915},
    ]
    write(shelf, "table1-lab", rows=rows, settings={"conditions": "lab"})
    page = sent(results.layout("table1"))
    assert "0.912 ± 0.004" in page
    assert "0.961" in page
    assert "1 of 2 rows not run yet" in page
    assert "0.912" in sent(results.layout(None))


def test_field_scores_are_told_apart_from_the_papers(shelf: Path) -> None:
    row = {"scheme": "1", "macro_f1": 0.5, "paper_macro_f1": 0.945}
    for conditions in ("lab", "field"):
        settings = {"conditions": conditions}
        write(
            shelf, f"table4-{conditions}", rows=[row], settings=settings, chosen_on_validation="1"
        )
    page = sent(results.layout("table4"))
    assert page.count("The paper reports lab results only") == 1
    assert "validation flights chose 1 step ahead: macro-F1 0.500, paper 0.945" in page.replace(
        "Validation", "validation"
    )


@pytest.mark.parametrize("text", ["{", "[]", '{"rows": [{}]}', '{"rows": 3}', "{}"])
@pytest.mark.parametrize("name", ["table1-lab", "fig6", "signs", "speed"])
def test_damaged_results_are_told_and_nothing_breaks(text: str, name: str, shelf: Path) -> None:
    (shelf / f"{name}.json").write_text(text)
    results.layout(None)
    page = sent(results.layout(name.removesuffix("-lab")))
    assert "Traceback" not in page


def test_measures_of_table_6_stand_beside_the_papers(shelf: Path) -> None:
    paper = {"ccc": 0.95, "sec": 0.973, "dc": 0.976, "hr": 0.054}
    row = {"writer": "with_fmea", "grounded": True, "ccc": 0.9, "sec": 0.8, "dc": 1.0, "hr": 0.0}
    write(shelf, "table6-lab", rows=[{**row, "sd": dict.fromkeys(paper, 0.01), "paper": paper}])
    page = sent(results.layout("table6"))
    assert "Model with FMEA, grounded" in page
    assert "0.900 ± 0.010" in page
    assert "0.973" in page
    assert all(name in MEASURES for name in paper)


def test_scores_and_confusions_are_valid_figures() -> None:
    rows = [
        {"scheme": "A", "macro_f1": 0.9, "paper_macro_f1": 0.96},
        {"scheme": "B", "macro_f1": None, "paper_macro_f1": 0.91},
    ]
    figure = go.Figure(beside_paper(rows, "macro_f1", "Macro-F1"))
    assert list(figure.data[2].x) == [0.9, None]
    (card, *_) = model_cards()
    counts = card["scores"]["test_windows"]["confusion"]
    matrix = go.Figure(confusion_figure(card["classes"], counts))
    right, wrong = matrix.data
    assert sum(value is not None for row in right.z for value in row) == len(counts)
    mistakes = sum(1 for i, row in enumerate(counts) for j, n in enumerate(row) if n and i != j)
    assert sum(value is not None for row in wrong.z for value in row) == mistakes


def test_mistakes_between_look_alikes_say_what_tells_the_two_apart() -> None:
    (card, *_) = model_cards()
    classes = card["classes"]
    counts = [[0] * len(classes) for _ in classes]
    plug, crack, seal = map(classes.index, ("baffle_plug", "baffle_crack", "engine_seal_loose"))
    counts[plug][crack] = 3
    counts[plug][plug] = 5
    counts[seal][crack] = 1  # no one takes these for alike
    windows = {**card["scores"]["test_windows"], "confusion": counts, "mistakes": []}
    made = {**card, "scores": {**card["scores"], "test_windows": windows}}
    text = sent(model_parts(made))
    assert "4 windows are classified wrongly, 3 of them (75.0 %) as a look-alike" in text
    tell = tell_apart("baffle_plug", "baffle_crack")
    assert tell is not None
    assert text.count(tell) == 1
    assert tell_apart("engine_seal_loose", "baffle_crack") is None
    assert tell_apart("baffle_crack", "baffle_plug") is not None


def test_a_model_without_mistakes_says_so() -> None:
    (card, *_) = model_cards()
    counts = np.eye(len(card["classes"]), dtype=int).tolist()
    windows = {**card["scores"]["test_windows"], "confusion": counts, "mistakes": []}
    made = {**card, "scores": {**card["scores"], "test_windows": windows}}
    text = sent(model_parts(made))
    assert "No window was classified wrongly." in text


def test_of_field_no_value_of_the_paper_is_claimed(shelf: Path) -> None:
    rows = [{"scheme": "Raw states", "macro_f1": 0.5, "paper_macro_f1": 0.914}]
    for conditions in ("lab", "field"):
        settings = {"conditions": conditions}
        write(shelf, f"table1-{conditions}", conditions=conditions, rows=rows, settings=settings)
    page = sent(results.layout(None))
    assert "lab: best macro-F1 0.500 (Raw states, paper 0.914)" in page
    assert "field: best macro-F1 0.500 (Raw states)" in page


def test_a_field_score_with_the_onset_known_says_so(shelf: Path) -> None:
    placed = "windows of 30 s that tile the 120 s after each test fault first shows; read once"
    rows = [{"scheme": "A", "macro_f1": 0.5, "paper_macro_f1": 0.9}]
    for conditions in ("lab", "field"):
        settings = {"conditions": conditions, "scored_on": placed}
        write(shelf, f"table1-{conditions}", conditions=conditions, rows=rows, settings=settings)
    overview, page = sent(results.layout(None)), sent(results.layout("table1"))
    assert "field: best macro-F1 0.500 (A), with the onset known" in overview
    assert "lab: best macro-F1 0.500 (A, paper 0.900)" in overview
    assert page.count(ONSET_KNOWN) == 1 and page.count("placed by the true onset") == 1
    # Remade from end to end, it is the score of what is shipped.
    settings = {"conditions": "field", "scored_on": "whole flights, as the app diagnoses them"}
    write(shelf, "table1-field", conditions="field", rows=rows, settings=settings)
    assert ONSET_KNOWN not in sent(results.layout("table1"))


def test_the_shipped_field_models_say_how_they_were_scored() -> None:
    cards = {card["name"]: card for card in model_cards()}
    assert card_line(cards["cnn-paired-field"]).endswith(f"their windows, {ONSET_KNOWN}")
    assert ONSET_KNOWN not in card_line(cards["cnn-paired-lab"])
    page = sent(results.layout("model"))
    n_field = sum(card["conditions"] == "field" for card in cards.values())
    assert page.count(ONSET_KNOWN) == page.count("placed by the true onset") == n_field
    assert "the lab's, with the onset known" in sent(results.layout(None))
    remade = {**cards["cnn-paired-field"], "scored_on": "whole flights, as the app diagnoses them"}
    assert ONSET_KNOWN not in card_line(remade)

"""Tables 1 to 5 on little data: the path, the form, and what a second call does not do again."""

import json
import shutil
from pathlib import Path

import pytest

from core.diagnosis.classifiers import CLASSIFIERS
from core.diagnosis.diagnosis import Diagnosis
from core.diagnosis.features import FEATURE_MODES
from core.diagnosis.predict import Diagnoser
from core.diagnosis.settings import TrainingSettings
from core.diagnosis.training import train
from core.errors import InputError
from core.experiments.models import delay, fresh, unknown
from core.experiments.paper import table1, table2, table3, table4, table5
from core.experiments.paper import trainings as cells
from core.experiments.paper.published import paper_tables
from core.experiments.results import Result
from core.fmea.catalogue import class_ids
from core.model_card import load_model
from core.residual.controls import controls
from core.residual.surrogate import Surrogate
from core.residual.surrogate_training import CHOSEN_HORIZON
from core.twin.plan import Plan
from core.twin.trajectory import Pair


def quiet(share: float) -> None:
    """Progress that nobody watches."""


@pytest.fixture(scope="module")
def data(dataset, tmp_path_factory) -> Path:
    """The made-up data set in a folder where cells may be trained."""
    folder = tmp_path_factory.mktemp("tables")
    (folder / "runs").symlink_to(dataset / "runs")
    shutil.copy(dataset / "manifest.json", folder)
    return folder


@pytest.fixture(scope="module")
def first(data) -> Result:
    """Table 1, all of its cells trained."""
    return table1.run(True, quiet, data=data)


@pytest.mark.slow
def test_table1_stands_beside_the_paper(first):
    content = json.loads(json.dumps(first.to_dict(), allow_nan=False))
    assert first.name == "table1-lab"
    assert (content["conditions"], content["settings"]["quick"]) == ("lab", True)
    assert [row["scheme"] for row in content["rows"]] == [
        row["scheme"] for row in paper_tables()["table1"]
    ]
    for row, paper in zip(content["rows"], paper_tables()["table1"], strict=True):
        assert row["paper_macro_f1"] == paper["macro_f1"]
        assert 0.0 <= row["macro_f1"] <= 1.0
        (run,) = row["runs"]
        assert run["seed"] == 0
        assert run["macro_f1"] == row["macro_f1"]
        assert list(run["per_class_f1"]) == list(class_ids())
        assert sum(map(sum, run["confusion"])) == run["test_windows"] == 20
        assert {"training_s", "device", "code"} <= set(run)


@pytest.mark.slow
def test_what_was_trained_is_not_trained_again(first, data, monkeypatch):
    monkeypatch.setattr(cells, "train", lambda *args, **options: pytest.fail("trained again"))
    again = table1.run(True, quiet, data=data)
    assert again.findings["rows"] == first.findings["rows"]


@pytest.mark.slow
def test_tables_share_cells_and_leave_the_rest_null(first, data):
    of_first = {row["scheme"]: row["macro_f1"] for row in first.findings["rows"]}
    second, third, fourth = (
        {row["scheme"]: row for row in result.findings["rows"]}
        for result in (
            table.run(True, quiet, data=data, minutes=0) for table in (table2, table3, table4)
        )
    )
    assert len(second) == 24
    assert {row["scheme"] for row in paper_tables()["table2"]} <= set(second)
    run = {scheme for scheme, row in second.items() if row["macro_f1"] is not None}
    assert run == {f"{title} + 1D-CNN" for title in table2.TITLES.values()}
    assert second["Paired-mirror residuals + ResNet"]["runs"] == []
    assert second["Raw states + 1D-CNN"]["macro_f1"] == of_first["Raw states"]
    assert set(third) == {row["scheme"] for row in paper_tables()["table3"]}
    assert third["Residuals only (baseline)"]["macro_f1"] is None
    assert third["States only (surrogate)"]["macro_f1"] == of_first["Raw states"]
    assert list(fourth) == [row["scheme"] for row in paper_tables()["table4"]]
    surrogate = of_first["GRU surrogate prediction residuals"]
    chosen = fourth[table4.HORIZONS[CHOSEN_HORIZON["lab"]]]
    assert chosen["macro_f1"] == surrogate
    assert chosen["mae"] > 0.0
    assert fourth["3"]["macro_f1"] is fourth["3"]["mae"] is None


@pytest.mark.slow
def test_ranges_need_every_cell(data):
    result = table2.run(True, quiet, data=data, minutes=0)
    assert result.findings["ranges"]["ratio"] is None
    assert result.findings["paper_ranges"]["ratio"] == 5.1


def test_data_of_other_conditions_is_refused(data):
    with pytest.raises(InputError, match=r"conditions: .* was flown in lab"):
        table1.run(True, quiet, data=data, conditions="field", minutes=0)


@pytest.mark.slow
@pytest.mark.parametrize("classifier", sorted(CLASSIFIERS.keys() - {"cnn"}))
def test_every_classifier_learns_by_the_same_interface(dataset, tmp_path, classifier):
    settings = TrainingSettings(classifier=classifier, epochs=2, batch=8, draws=2)
    card = train(dataset, tmp_path, settings, work_dir=tmp_path, whole_runs=False)
    assert card["classifier"] == classifier
    assert card["scores"]["test_windows"]["n"] > 0
    assert card["calibration"]["temperature"] > 0.0
    if not CLASSIFIERS[classifier].keeps_weights:
        assert card["scores"]["test_windows"]["macro_f1"] > 0.2  # chance is 0.05
        assert card["weights_sha256"] is None


@pytest.mark.slow
def test_table5_measures_every_way():
    result = table5.run(True, quiet)
    rows = {row["scheme"]: row for row in result.findings["rows"]}
    assert list(rows) == [mode.title for mode in FEATURE_MODES.values()]
    mirror, surrogate, differencing, _raw = rows.values()
    assert mirror["mirror_ms"] > 0.5 * result.findings["bare_run_ms"]
    assert surrogate["mirror_ms"] is None
    assert surrogate["features_ms"] > 5 * differencing["features_ms"]
    for row in rows.values():
        parts = [row[name] or 0.0 for name in ("mirror_ms", "features_ms", "cnn_ms")]
        assert row["total_ms"] == pytest.approx(sum(parts), rel=0.2)
        assert row["bare_runs"] == pytest.approx(
            row["total_ms"] / result.findings["bare_run_ms"], rel=0.3
        )


def test_a_fault_is_named_once_the_right_answer_stays(make_pair, untrained):
    told = untrained.diagnose(make_pair(200.0)).to_dict()
    times = told["over_time"]["time_s"]
    right = [time_s in (75.0, 80.0) or time_s >= 95.0 for time_s in times]
    told["over_time"]["probabilities"] = [[1.0, 0.0] if hit else [0.0, 1.0] for hit in right]
    told["probabilities"] = {"a": 1.0, "b": 0.0}
    diagnosis = Diagnosis.from_dict(told)
    assert delay.named_after(diagnosis, "a", 60.0) == 35.0
    assert delay.named_after(diagnosis, "b", 60.0) is None
    assert delay.named_after(diagnosis, "a", 110.0) == 0.0


@pytest.fixture
def few(monkeypatch):
    """Two fresh flights instead of hundreds."""
    runs = [run for run in fresh.fresh_runs(1, (0.6,)) if run.fault.mode in class_ids()[:2]]
    for module in (delay, unknown):
        monkeypatch.setattr(module, "fresh_runs", lambda *args: runs)


@pytest.mark.slow
def test_delay_and_unknown_tell_of_every_model(few):
    models = set(fresh.shipped())
    for module in (delay, unknown):
        result = module.run(True, quiet)
        rows = json.loads(json.dumps(result.to_dict(), allow_nan=False))["rows"]
        assert {row["residual"] for row in rows} == models
    groups = {row["group"]: row for row in rows if row["residual"] == "paired"}
    assert groups["known"]["runs"] == 2
    assert groups["stuck sensor"]["runs"] == len(unknown.STUCK)
    assert 0.0 <= groups["two faults at once"]["separation_auroc"] <= 1.0


def test_fresh_flights_are_in_no_data_set(shipped_card):
    learnt = set().union(*map(set, shipped_card["data"]["seeds"].values()))
    assert learnt.isdisjoint(run.plan.seed for run in fresh.fresh_runs(3))


@pytest.mark.slow
def test_a_surrogate_diagnosis_needs_no_mirror_and_streams_alike(first, data, make_pair):
    horizon = CHOSEN_HORIZON["lab"]
    surrogate = Surrogate.from_card(*load_model(data / "surrogates" / f"h{horizon}", "gru-lab"))
    cell = data / "cells" / f"surrogate-both-cnn-s0-h{horizon}"
    model = load_model(cell, "cnn-surrogate-lab")
    diagnoser = Diagnoser.from_card(*model, surrogate)
    pair, plan = make_pair(70.0, ("E1 CHT1", 60.0, 35.0, 70.0)), Plan(duration_s=70.0)
    alone = Pair(pair.faulted, pair.faulted)
    whole = diagnoser.diagnose(alone, plan)
    assert whole.to_dict() == diagnoser.diagnose(pair, plan).to_dict()
    known = surrogate.residual(pair.faulted.channels, controls(plan, 0, len(pair.faulted)))
    assert diagnoser.diagnose(pair, residual=known).probabilities == pytest.approx(
        whole.probabilities, abs=1e-4
    )
    stream = diagnoser.stream(plan)
    for start in range(0, 3500, 333):
        stream.push(alone[start : start + 333])
    streamed = stream.finish()
    assert streamed.probabilities == pytest.approx(whole.probabilities, abs=1e-4)
    assert [item.channel for item in streamed.evidence] == [item.channel for item in whole.evidence]
    with pytest.raises(InputError, match="plan"):
        diagnoser.stream()

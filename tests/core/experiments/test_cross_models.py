"""The cross test of lab and field models, on made-up data sets and a network of chance."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest

from core.channels import CHANNEL_INDEX, CHANNEL_NAMES
from core.errors import InputError
from core.experiments.models import cross
from core.fmea.catalogue import class_ids


def quiet(share: float) -> None:
    """Progress that nobody watches."""


@pytest.fixture
def asked(monkeypatch, untrained):
    """The untrained network, of the catalogue's classes, answers for every model."""
    model = replace(untrained, classes=class_ids())
    monkeypatch.setattr(cross, "RESIDUALS", ("paired",))
    monkeypatch.setattr(
        cross, "load_diagnoser", lambda residual, conditions: replace(model, conditions=conditions)
    )


def field_copy(dataset, folder, change):
    """``dataset`` as lab and, each run changed, as field, under ``folder``."""
    for conditions in cross.CONDITIONS:
        shutil.copytree(dataset, folder / conditions)
    manifest = folder / "field" / "manifest.json"
    told = json.loads(manifest.read_text())
    told["spec"]["conditions"] = "field"
    manifest.write_text(json.dumps(told))
    for path in (folder / "field" / "runs").iterdir():
        np.save(path, change(np.load(path)))
    return folder


def test_where_field_is_as_lab_nothing_is_won_back(asked, dataset, tmp_path):
    result = cross.run(False, quiet, data=field_copy(dataset, tmp_path, lambda channels: channels))
    content = json.loads(json.dumps(result.to_dict(), allow_nan=False))
    assert [(row["trained"], row["tested"]) for row in content["rows"]] == [
        ("lab", "lab"), ("lab", "field"), ("field", "lab"), ("field", "field"),
    ]  # fmt: skip
    assert len({row["macro_f1"] for row in content["rows"]}) == 1
    assert [told["channel"] for told in content["channels"]] == 2 * list(CHANNEL_NAMES)
    assert {told["gain"] for told in content["channels"]} == {0.0}


def test_a_channel_that_is_troubled_in_field_is_the_one_that_strays(asked, dataset, tmp_path):
    egt2 = CHANNEL_INDEX["E1 EGT2"]

    def troubled(channels):
        channels[1, :, egt2] += np.linspace(-100.0, 100.0, channels.shape[1], dtype=np.float32)
        return channels

    result = cross.run(False, quiet, data=field_copy(dataset, tmp_path, troubled))
    for told in result.findings["channels"]:
        strayed = told["healthy_sd_field"] > told["healthy_sd_lab"] + 1.0
        assert strayed == (told["channel"] == "E1 EGT2")


def test_other_flights_are_refused(asked, dataset, tmp_path):
    folder = field_copy(dataset, tmp_path, lambda channels: channels)
    manifest = folder / "field" / "manifest.json"
    told = json.loads(manifest.read_text())
    told["runs"] = [run for run in told["runs"] if run["mode"] != "nominal"]
    manifest.write_text(json.dumps(told))
    with pytest.raises(InputError, match="do not hold the same flights"):
        cross.run(False, quiet, data=folder)

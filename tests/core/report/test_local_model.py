"""A real llama.cpp server with a real, very small model, held to the truth by the grounding."""

import pytest
from report_samples import diagnosis, evidence

from core.errors import InputError
from core.report.case.case import open_case
from core.report.grounded import Done, write_grounded
from core.report.write.endpoint import Endpoint, WriterError
from core.report.write.local_model import GGUF, local_model, model_file, start_local_model
from core.report.write.writers import ModelWriter

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(model_file({}) is None, reason="the local-llm extra is not installed"),
]
CASE = open_case(
    diagnosis(
        {"baffle_crack": 0.9, "baffle_rivet": 0.08, "cylinder_crack": 0.02},
        [evidence("E1 CHT3", 18.34, 70.0, 180.0), evidence("E1 CHT1", 1.2, 95.0, 180.0)],
    )
)


@pytest.mark.timeout(600)
def test_the_worst_writer_leaves_a_true_and_complete_report() -> None:
    """Issue 5: CCC at least 0.95, SEC 0.98, DC 1, HR at most 0.02 after grounding."""
    with local_model() as endpoint:
        *events, done = write_grounded(CASE, ModelWriter(endpoint))
        stranger = Endpoint(endpoint.url, endpoint.model, "guessed", endpoint.limits)
        with pytest.raises(WriterError, match="rejected the API key"):
            list(stranger.stream([{"role": "user", "content": "hello"}], 5))
    assert isinstance(done, Done)
    report = done.report
    assert any(item.origin == "writer" for item in report.sentences), report.notes
    assert report.final.ccc >= 0.95
    assert report.final.sec >= 0.98
    assert report.final.dc == 1.0
    assert report.final.hr <= 0.02
    assert events


def test_the_server_ends_with_its_owner() -> None:
    model = start_local_model()
    model.close()
    assert model.process.poll() is not None
    with pytest.raises(WriterError, match="cannot be reached"):
        list(model.endpoint.stream([{"role": "user", "content": "hello"}], 5))


def test_a_model_that_is_not_there_is_refused_by_name() -> None:
    with pytest.raises(InputError) as refusal:
        model_file({GGUF: "/nowhere/model.gguf"})
    assert refusal.value.field == GGUF

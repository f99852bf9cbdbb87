"""Reports to take away: they name the run, say "simulated", load nothing and escape everything."""

import json
import re
from dataclasses import replace
from typing import Any

import pytest
import typst
from hostile import chat_server, says
from report_samples import diagnosis, evidence

from core.diagnosis.outcome import Outcome, injected_faults
from core.fmea.fault import Fault
from core.report.case.case import open_case
from core.report.check.metrics import CHECKED, HOW_CHECKED
from core.report.files import pdf
from core.report.files.export import SHADED, Exported, evidence_figure, to_html, to_markdown
from core.report.files.pdf import to_pdf
from core.report.grounded import Done, grounded_template, write_grounded
from core.report.write.endpoint import Endpoint
from core.report.write.writers import ModelWriter
from core.twin.flight import fly_pair
from core.twin.plan import Plan

GIVEN = diagnosis(
    {"baffle_crack": 0.9, "baffle_rivet": 0.08, "cylinder_crack": 0.02},
    [evidence("E1 CHT3", 18.34, 70.0, 180.0)],
)
IDENTITY = {"Run": "20261123T061500-k3x9q2ab", "Version": "MirrorTwin 0.1.0"}


def exported() -> Exported:
    return Exported(IDENTITY, GIVEN, grounded_template(open_case(GIVEN)))


@pytest.mark.parametrize("write", [to_markdown, to_html])
def test_a_file_says_what_it_is(write: object) -> None:
    text = write(exported())  # type: ignore[operator]
    assert "Simulated flight" in text
    for part in ("k3x9q2ab", "MirrorTwin 0.1.0", "cnn-paired-lab", "template"):
        assert part in text
    for title in ("Conclusion", "Mechanism", "Evidence cross-check", "Maintenance"):
        assert title in text


@pytest.mark.parametrize("write", [to_markdown, to_html])
def test_the_head_says_what_was_injected_and_the_foot_how_it_was_checked(write: object) -> None:
    fault = Fault("engine_failure", 0.8, 60.0)
    outcome = Outcome(injected_faults(fault), "baffle_crack")
    text = write(replace(exported(), outcome=outcome))  # type: ignore[operator]
    head, _, foot = text.partition("Maintenance")
    assert "Injected: Engine failure. Diagnosed: Baffle crack. ✗ wrong" in head
    assert CHECKED not in head and "1.00" not in head
    for part in (CHECKED, HOW_CHECKED, "Causal chain coverage (CCC)", "Hallucination rate (HR)"):
        assert part in foot
    assert "Injected" not in write(exported())  # type: ignore[operator]


def test_on_paper_both_are_said_too(monkeypatch: pytest.MonkeyPatch) -> None:
    given: list[dict[str, Any]] = []
    compile_page = typst.compile

    def compiled(page: bytes, **options: Any) -> Any:
        given.append(json.loads(options["sys_inputs"]["data"]))
        return compile_page(page, **options)

    monkeypatch.setattr(pdf.typst, "compile", compiled)
    outcome = Outcome(injected_faults(Fault("engine_failure", 0.8, 60.0)), "baffle_crack")
    assert to_pdf(replace(exported(), outcome=outcome)).startswith(b"%PDF-1.")
    (data,) = given
    assert data["outcome"] == "Injected: Engine failure. Diagnosed: Baffle crack. ✗ wrong"
    assert "CCC" not in str(data["about"])
    assert data["checks"][0] == ["Causal chain coverage (CCC)", "1.00 (1 is best)"]
    assert SHADED in data["legend"]


def test_shaded_is_the_interval_of_the_evidence() -> None:
    pair = fly_pair(Plan.sampled(3), Fault("baffle_crack", 0.8, 60.0))
    (shape,) = evidence_figure(pair, GIVEN).layout.shapes
    assert (shape.x0, shape.x1) == (70.0, 180.0)
    assert shape.opacity == 1.0, "the band is pale already"
    (item,) = GIVEN.evidence
    svg = pdf._svg(pair, item)
    ((left, width),) = re.findall(r'<rect x="([\d.]+)".*? width="([\d.]+)"', svg)
    ticks = re.findall(r'<text x="([\d.]+)"[^>]*>(\d+:\d\d)<', svg)
    marks = {said: float(at) for at, said in ticks}
    scale = (marks["3:00"] - marks["0:00"]) / 180.0
    assert float(left) == pytest.approx(marks["0:00"] + 70.0 * scale, abs=0.2)
    assert float(left) + float(width) == pytest.approx(marks["3:00"], abs=0.2)
    assert SHADED in to_html(replace(exported(), pair=pair))


def test_the_page_has_the_table_and_the_lists() -> None:
    page = to_html(exported())
    assert "<td>CHT 3</td>" in page
    assert "<strong>Baffle rivet</strong>" in page
    assert page.count("<h2>") == 5


def test_struck_sentences_are_shown_with_their_reason() -> None:
    with chat_server(says({}, default="The <b>alternator</b> failed. CHT 3 rose.")) as server:
        *_, done = write_grounded(open_case(GIVEN), ModelWriter(Endpoint(server.url, "m")))
    assert isinstance(done, Done)
    given = Exported(IDENTITY, GIVEN, done.report)
    page = to_html(given)
    assert "<del>The &lt;b&gt;alternator&lt;/b&gt; failed.</del>" in page
    assert "<b>" not in page
    assert r"~~The \<b\>alternator\</b\> failed.~~" in to_markdown(given)


def test_hostile_names_stay_text() -> None:
    name = "<script>alert(1)</script>[x](javascript:alert(2))"
    given = replace(GIVEN, model=name)
    identity = {"Run": name}
    page = to_html(Exported(identity, given, grounded_template(open_case(given))))
    assert "<script" not in page
    assert "href" not in page


def test_the_page_carries_its_plots_and_loads_nothing() -> None:
    pair = fly_pair(Plan.sampled(3), Fault("baffle_crack", 0.8, 60.0))
    page = to_html(replace(exported(), pair=pair))
    markup = re.sub(r"<script[^>]*>.*?</script>", "", page, flags=re.DOTALL)
    assert "Plotly.newPlot" in page
    assert not re.search(r"(?:src|href)=", markup)
    assert not re.search(r"<script[^>]*\bsrc=", page)


def test_the_pdf_has_pages_and_reads_nothing_as_markup() -> None:
    pair = fly_pair(Plan.sampled(3), Fault("baffle_crack", 0.8, 60.0))
    hostile = {"Run": '#panic("no") $x$ <label> @ref *b* "quote" \\', "Version": "MirrorTwin"}
    given = Exported(hostile, GIVEN, grounded_template(open_case(GIVEN)), pair)
    page = to_pdf(given)
    assert page.startswith(b"%PDF-1.")
    assert page.rstrip().endswith(b"%%EOF")
    assert to_pdf(replace(given, pair=None)).startswith(b"%PDF-1.")
    assert len(to_pdf(replace(given, pair=None))) < len(page)

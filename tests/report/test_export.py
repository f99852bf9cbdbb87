"""Reports to take away: they name the run, say "simulated", load nothing and escape everything."""

import re
from dataclasses import replace

import pytest
from hostile import chat_server, says
from report_samples import diagnosis, evidence

from core.fmea.fault import Fault
from core.report.case import open_case
from core.report.endpoint import Endpoint
from core.report.export import Exported, to_html, to_markdown
from core.report.grounded import Done, grounded_template, write_grounded
from core.report.pdf import to_pdf
from core.report.writers import ModelWriter
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
    for part in ("k3x9q2ab", "MirrorTwin 0.1.0", "cnn-paired-lab", "template", "CCC 1.00"):
        assert part in text
    for title in ("Conclusion", "Mechanism", "Evidence cross-check", "Maintenance"):
        assert title in text


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

"""Reports cut into sentences: the same however the text arrives."""

import random
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from report_samples import diagnosis, ideal_evidence

from core.report.case.case import open_case
from core.report.grounded import grounded_template
from core.report.sentences import MAX_LINE_CHARS, Sentence, SentenceSplitter, sentences


def plain(markdown: str) -> list[str]:
    return [item.plain for item in sentences(markdown)]


@pytest.mark.parametrize(
    ("markdown", "expected"),
    [
        ("One. Two.", ["One.", "Two."]),
        ("**Seen.** At No. 3. (CHT +1.5 °F)", ["Seen.", "At No. 3.", "(CHT +1.5 °F)"]),
        ("1. Look e.g. here. Then there.", ["Look e.g. here.", "Then there."]),
        ("It fell by 1.5 psi. 2 heads warmed.", ["It fell by 1.5 psi.", "2 heads warmed."]),
        ("## Conclusion\n\nDone", ["Conclusion", "Done"]),
        ("| A | B |\n| --- | --- |\n| 1. X | 2 |", ["| A | B |", "| 1. X | 2 |"]),
        ("really?! Yes", ["really?!", "Yes"]),
    ],
)  # fmt: skip
def test_by_hand(markdown: str, expected: list[str]) -> None:
    assert plain(markdown) == expected


def in_pieces(text: str, cuts: list[int]) -> list[Sentence]:
    splitter, found = SentenceSplitter(), []
    edges = [0, *sorted(cut % (len(text) + 1) for cut in cuts), len(text)]
    for start, end in pairwise(edges):
        found += splitter.push(text[start:end])
    return found + splitter.finish()


@settings(deadline=None)
@given(st.lists(st.integers(0, 100_000), max_size=60))
def test_however_it_streams_the_sentences_are_the_same(cuts: list[int]) -> None:
    report = grounded_template(
        open_case(diagnosis({"baffle_seal": 0.8}, ideal_evidence("baffle_seal", 1)))
    )
    assert in_pieces(report.markdown, cuts) == sentences(report.markdown)


@settings(deadline=None)
@given(st.text(alphabet=" .!?|#*-1aA\n()", max_size=200), st.lists(st.integers(0, 500), max_size=9))
def test_any_text_survives_being_cut(text: str, cuts: list[int]) -> None:
    whole, pieces = sentences(text), in_pieces(text, cuts)
    assert "".join(item.plain for item in pieces).replace(" ", "") == "".join(
        item.plain for item in whole
    ).replace(" ", "")


def test_a_sentence_is_given_as_soon_as_the_next_begins() -> None:
    splitter = SentenceSplitter()
    assert splitter.push("CHT 3 rose.") == []
    assert [item.text for item in splitter.push(" It")] == ["CHT 3 rose."]


def test_an_endless_line_is_cut() -> None:
    rng = random.Random(1)
    splitter = SentenceSplitter()
    given = [splitter.push("word " * rng.randint(1, 400)) for _ in range(100)]
    assert max(len(item.text) for found in given for item in found) <= MAX_LINE_CHARS

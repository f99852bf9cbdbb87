"""Free-text search over the knowledge base."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from core.knowledge.search import search


@pytest.mark.parametrize(
    ("query", "mode"),
    [
        ("blue stain at the flange", "intake_gasket_leak"),
        ("vernatherm", "oil_cooler_maintenance"),
        ("morning sickness", "engine_run_rough"),
        ("rivets sheared in steps", "baffle_rivet"),
        ("vernathrem", "oil_cooler_maintenance"),
        ("a light shows hairlines", "baffle_crack"),
    ],
)
def test_finds_the_passage(query: str, mode: str) -> None:
    assert search(query)[0].mode == mode


def test_gives_no_more_than_asked() -> None:
    assert len(search("oil", limit=3)) == 3


@settings(deadline=None)
@given(st.text(max_size=60))
def test_any_text_is_a_query(query: str) -> None:
    assert len(search(query)) <= 8


@pytest.mark.parametrize("query", ["", "?!", '"', "NEAR(", "oil AND", "a* OR", "text:oil", "-oil"])
def test_nothing_in_a_query_is_an_operator(query: str) -> None:
    search(query)

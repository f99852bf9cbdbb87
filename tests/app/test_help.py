"""Words and tour: checked on load, and every one that a page uses is there."""

import json
from pathlib import Path

import pytest
from dash._utils import to_json

from app.kit import tour
from app.kit.glossary import glossary, read_glossary, tour_stops
from app.kit.terms import term
from app.pages.help import page as help
from core.errors import InputError


def sent(component: object) -> str:
    return json.dumps(json.loads(to_json(component)), ensure_ascii=False)


def test_every_word_is_on_the_page_and_in_its_tooltip() -> None:
    page = sent(help.layout())
    for entry in glossary().values():
        assert f'"word-{entry.id}"' in page
        assert entry.text in json.loads(sent(term(entry.id)))["props"]["data-meaning"]
    assert '"tabIndex": 0' in sent(term("mirror", "the mirror"))
    with pytest.raises(KeyError):
        term("gremlin")


def test_words_of_one_group_stand_together() -> None:
    groups = [entry.group for entry in glossary().values()]
    assert len(set(groups)) == sum(
        group != before for group, before in zip(groups, [None, *groups], strict=False)
    )


def test_the_invitation_carries_the_tour() -> None:
    carried = json.loads(json.loads(sent(tour.invitation()))["props"]["data-stops"])
    assert [stop["title"] for stop in carried] == [stop.title for stop in tour_stops()]
    assert 5 <= len(carried) <= 6


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ('[cht]\nname = "CHT"', "cht"),
        ('[cht]\ngroup = "a"\nname = "CHT"\ntext = "b"\nnote = "c"', "cht"),
        ('[cht]\ngroup = "a"\nname = "CHT"\ntext = ""', "empty"),
        ("[cht", "words"),
    ],
)
def test_a_bad_glossary_is_refused_by_name(tmp_path: Path, text: str, problem: str) -> None:
    path = tmp_path / "words.toml"
    path.write_text(text)
    with pytest.raises(InputError, match=problem):
        read_glossary(path)

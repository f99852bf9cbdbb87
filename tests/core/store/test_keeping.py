"""What is written on runs, and runs thrown away and had back."""

import sqlite3
from datetime import timedelta

import pytest
from hypothesis import given
from hypothesis import strategies as st
from jobs_support import CRACK, SHORT_PLAN

from core.errors import InputError, StoreError
from core.store.labels import (
    MAX_NOTE,
    MAX_TAG,
    MAX_TAGS,
    Label,
    discard,
    discarded,
    empty,
    label_of,
    labels,
    read_tags,
    restore,
    write_label,
)
from core.store.store import RunStore
from core.twin.trajectory import Pair

MARKUP = '<img src=x onerror="alert(1)">'


def test_what_is_written_on_a_run_stays(store: RunStore) -> None:
    one, other = (store.create(SHORT_PLAN, CRACK).id for _ in range(2))
    label = Label(("shop floor", MARKUP), "line 1\nline 2 'quoted'; DROP TABLE runs")
    write_label(store, one, label)
    assert labels(RunStore(store.root)) == {one: label}
    assert label_of(store, other) == Label()
    write_label(store, one, Label())
    assert label_of(store, one) == Label()
    with pytest.raises(StoreError, match="no run"):
        write_label(store, "nonsense", label)


@pytest.mark.parametrize(
    ("tags", "note", "field"),
    [
        (("x" * (MAX_TAG + 1),), "", "tags"),
        (("a,b",), "", "tags"),
        (("",), "", "tags"),
        (("a\x00b",), "", "tags"),
        (tuple(map(str, range(MAX_TAGS + 1))), "", "tags"),
        ((), "x" * (MAX_NOTE + 1), "note"),
        ((), "bell \x07", "note"),
    ],
)
def test_what_cannot_be_written_is_named(tags: tuple[str, ...], note: str, field: str) -> None:
    with pytest.raises(InputError) as caught:
        Label(tags, note)
    assert caught.value.field == field


@given(st.text(max_size=200))
def test_whatever_is_typed_becomes_tags_or_a_clear_error(text: str) -> None:
    tags = read_tags(text)
    assert read_tags(", ".join(tags)) == tags
    try:
        assert Label(tags).tags == tags
    except InputError as error:
        assert len(tags) > MAX_TAGS or max(map(len, tags)) > MAX_TAG, error


def test_a_run_thrown_away_is_gone_and_comes_back_whole(store: RunStore, short_pair: Pair) -> None:
    kept, thrown = (store.create(SHORT_PLAN, CRACK).id for _ in range(2))
    for run_id in (kept, thrown):
        store.save_pair(run_id, short_pair)
        store.update(run_id, status="done")
    before = store.get(thrown)
    write_label(store, thrown, Label(("kept",), "a note"))
    discard(store, [thrown])
    assert [record.id for record in store.records()] == [kept]
    for ask in (store.get, store.load_pair, store.load_result, store.recording_path):
        with pytest.raises(StoreError, match="no run"):
            ask(thrown)
    assert discarded(store) == [thrown]
    assert empty(store) == []
    assert restore(RunStore(store.root), [thrown, kept, "nonsense"]) == [thrown]
    assert store.get(thrown) == before
    assert label_of(store, thrown) == Label(("kept",), "a note")
    assert store.load_pair(thrown).residual.tobytes() == short_pair.residual.tobytes()


def test_after_a_day_it_is_gone_for_good(store: RunStore, short_pair: Pair) -> None:
    run_id = store.create(SHORT_PLAN, CRACK).id
    store.save_pair(run_id, short_pair)
    store.update(run_id, status="done")
    discard(store, [run_id])
    assert empty(store, timedelta(0)) == [run_id]
    assert restore(store, [run_id]) == []
    assert list((store.root / "runs").iterdir()) == []


def test_a_run_in_the_air_is_not_thrown_away(store: RunStore) -> None:
    done, flying = (store.create(SHORT_PLAN, CRACK).id for _ in range(2))
    store.update(done, status="done")
    with pytest.raises(InputError, match=rf"{flying} is still being flown"):
        discard(store, [done, flying])
    assert discarded(store) == []


def test_a_store_of_the_last_version_opens_with_all_its_runs(store: RunStore) -> None:
    run_id = store.create(SHORT_PLAN, CRACK).id
    store.close()
    with sqlite3.connect(store.root / "index.sqlite") as index:
        index.executescript("DROP TABLE labels; PRAGMA user_version = 1;")
    index.close()
    upgraded = RunStore(store.root)
    assert [record.id for record in upgraded.records()] == [run_id]
    write_label(upgraded, run_id, Label(("old",)))
    assert label_of(upgraded, run_id).tags == ("old",)


def test_what_is_written_on_a_run_and_cannot_be_read_hides_no_other(store: RunStore) -> None:
    good, *bad = (store.create(SHORT_PLAN, CRACK).id for _ in range(4))
    write_label(store, good, Label(("kept",)))
    for run_id, tags in zip(bad, ("not JSON", "[1]", "{"), strict=True):
        with store.index.writing() as index:
            index.execute("INSERT INTO labels (run, tags) VALUES (?, ?)", (run_id, tags))
    assert labels(store) == {good: Label(("kept",))}

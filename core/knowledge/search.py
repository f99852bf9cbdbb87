"""Free-text search over the knowledge base: SQLite's full-text index, in memory, no service.

SQLite ranks by BM25 and stems English words; it comes with Python.
"""

import difflib
import re
import sqlite3
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from threading import Lock

from core.knowledge.knowledge import ModeKnowledge, knowledge
from core.knowledge.lexicon import lexicon

_WORD = re.compile(r"\w+")
_lock = Lock()


@dataclass(frozen=True, slots=True)
class Hit:
    """One passage that matches: of which mode, in which ``field`` of its entry, and its text."""

    mode: str
    field: str
    text: str


def search(query: str, limit: int = 8) -> list[Hit]:
    """The passages nearest to ``query``, best first; words that nobody wrote are corrected.

    Any text is a valid query: nothing in it is an operator.
    """
    asked = _WORD.findall(query.casefold())
    # "On" and "the" are everywhere, and would outweigh the one word that matters.
    telling = [word for word in asked if word not in lexicon().plain] or asked
    words = [_corrected(word) for word in telling]
    if not words:
        return []
    match = " OR ".join(f'"{word}"' for word in words)
    statement = (
        "SELECT mode, field, text FROM passages WHERE passages MATCH ? ORDER BY rank LIMIT ?"
    )
    with _lock:
        rows = _index().execute(statement, (match, limit)).fetchall()
    return [Hit(*row) for row in rows]


@cache
def _index() -> sqlite3.Connection:
    index = sqlite3.connect(":memory:", check_same_thread=False)
    index.execute(
        "CREATE VIRTUAL TABLE passages USING fts5"
        "(mode UNINDEXED, field UNINDEXED, name, text, tokenize='porter unicode61')"
    )
    index.executemany(
        "INSERT INTO passages VALUES (?, ?, ?, ?)",
        [
            (mode.id, field, mode.name, text)
            for mode in knowledge().values()
            for field, text in _passages(mode)
        ],
    )
    return index


def _passages(mode: ModeKnowledge) -> Iterator[tuple[str, str]]:
    yield "summary", mode.summary
    yield "mechanism", mode.mechanism
    yield "ata", mode.ata
    yield "records", mode.records
    yield from (("chain", step.text) for step in mode.chain)
    yield from (("look-alike", item.tell) for item in mode.look_alikes)
    yield from (("action", action) for action in mode.actions)


@cache
def _written_words() -> tuple[str, ...]:
    texts = [
        text
        for mode in knowledge().values()
        for text in (mode.name, *(t for _, t in _passages(mode)))
    ]
    return tuple(sorted({word for text in texts for word in _WORD.findall(text.casefold())}))


def _corrected(word: str) -> str:
    """A word as somebody wrote it, if it is one or two letters away from that."""
    known = _written_words()
    if word in known or len(word) < 5:
        return word
    close = difflib.get_close_matches(word, known, n=1, cutoff=0.8)
    return close[0] if close else word

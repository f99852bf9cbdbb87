"""The lexicon by which sentences are read: words for moves, for modes, and plain words.

Data in ``assets/data/report``: patterns in ``words.toml``, and in ``plain_words.txt`` the words
that claim nothing about an engine. Every other word of a sentence must have a source in the
evidence or the knowledge base, so that an invented part is an unknown word.
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from threading import Lock
from typing import Any

import snowballstemmer

from core.errors import InputError
from core.files import read_toml
from core.fmea.catalogue import catalogue
from core.paths import DATA

Pattern = re.Pattern[str]

_WORD = re.compile(r"[a-z]+(?:'[a-z]+)?")
_PREFIXED = re.compile(r"^(?:un|re|non|pre|mis)")
_NO_PART = re.compile(r"(?:ly|wards?|ous|able|ible|ful|less|ness|ability|ibility|ence)$")
"""Endings of words that name no part: adverbs, adjectives and the most abstract of nouns."""

_COMPARED = re.compile(r"(?:([b-df-hj-np-tv-z])\1)?(?:er|est)$")
_INFLECTED = re.compile(r"(?:s|ed|ing|ly)$")
COVERED = 0.5
"""A text states a sentence in other words if it has this share of the sentence's terms."""

_one_word_at_a_time = Lock()
"""A stemmer keeps the word it works on in itself, and reports are checked on several threads."""

_TABLES = {
    "moves": ("up", "down", "still"),
    "mood": ("expected", "contrast"),
    "ranking": ("rival",),
    "unlogged": ("names",),
    "actions": ("verbs",),
}


@dataclass(frozen=True, slots=True)
class Lexicon:
    """Compiled patterns and the stems of the plain words; see ``words.toml`` for their meaning."""

    up: Pattern
    down: Pattern
    still: Pattern
    expected: Pattern
    contrast: Pattern
    rival: Pattern
    unlogged: Pattern
    action: Pattern
    modes: Mapping[str, Pattern]
    plain: frozenset[str]

    def is_plain(self, word: str) -> bool:
        """Whether a lower-case word is plain, as it stands or but for an ending or a prefix."""
        if word in self.plain:
            return True
        if _INFLECTED.search(word) and _stem(word) in self.plain:
            return True
        if _NO_PART.search(word) and len(word) > 5:
            return True
        root = _PREFIXED.sub("", word)
        return root != word and len(root) > 3 and self.is_plain(root)


@cache
def lexicon() -> Lexicon:
    """The lexicon of the installation; raises `InputError` on a bad file."""
    return read_lexicon(DATA / "report")


def read_lexicon(folder: Path) -> Lexicon:
    """Read and check ``words.toml`` and ``plain_words.txt``; raises `InputError` by file."""
    tables = read_toml(folder / "words.toml", "words.toml")
    words = {
        f"{table}.{name}": _whole_word(f"{table}.{name}", tables.get(table, {}).get(name))
        for table, names in _TABLES.items()
        for name in names
    }
    return Lexicon(
        up=words["moves.up"],
        down=words["moves.down"],
        still=words["moves.still"],
        expected=words["mood.expected"],
        contrast=words["mood.contrast"],
        rival=words["ranking.rival"],
        unlogged=words["unlogged.names"],
        action=words["actions.verbs"],
        modes=_mode_patterns(tables.get("modes", {})),
        plain=frozenset(
            form
            for word in _words(_plain_words(folder / "plain_words.txt"))
            for form in (word, _stem(word))
        ),
    )


def stems(text: str) -> list[str]:
    """The stems of the words of a text, in order (Snowball English); numbers are left out."""
    return [_stem(word) for word in _words(text)]


def terms(text: str) -> frozenset[str]:
    """The stems of those words of a text that are not plain."""
    return frozenset(_stem(word) for word in _words(text) if not lexicon().is_plain(word))


def known_terms(said: frozenset[str], known: frozenset[str]) -> frozenset[str]:
    """Those stems of ``said`` that are ``known``, comparatives included ("thinner" by "thin")."""
    return frozenset(item for item in said if item in known or _COMPARED.sub(r"\1", item) in known)


def is_covered(telling: frozenset[str], said: frozenset[str]) -> bool:
    """Whether a text with the stems ``said`` states a sentence with the terms ``telling``."""
    return len(telling & said) >= COVERED * len(telling)


def _words(text: str) -> list[str]:
    return _WORD.findall(text.lower().replace("’", "'"))


@cache
def _stem(word: str) -> str:
    with _one_word_at_a_time:
        stemmed: str = _stemmer().stemWord(word.removesuffix("'s"))
    return stemmed


@cache
def _stemmer() -> Any:
    return snowballstemmer.stemmer("english")


def _plain_words(path: Path) -> str:
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(path.name, f"cannot be read: {error}") from None
    return " ".join(line for line in lines if not line.startswith("#"))


def _whole_word(where: str, pattern: Any) -> Pattern:
    if not isinstance(pattern, str) or not pattern:
        raise InputError(where, "must be a regular expression")
    try:
        return re.compile(rf"(?<![\w-])(?:{pattern})(?![\w-])", re.IGNORECASE)
    except re.error as error:
        raise InputError(where, f"is not a regular expression: {error}") from None


def _mode_patterns(table: Mapping[str, Any]) -> Mapping[str, Pattern]:
    for mode_id in table:
        if mode_id not in catalogue():
            raise InputError(f"modes.{mode_id}", "is not in the catalogue")
    return {
        mode.id: _whole_word(
            f"modes.{mode.id}", _alternatives([re.escape(mode.name), table.get(mode.id)])
        )
        for mode in catalogue().values()
    }


def _alternatives(patterns: Iterable[Any]) -> str:
    return "|".join(str(pattern) for pattern in patterns if pattern)

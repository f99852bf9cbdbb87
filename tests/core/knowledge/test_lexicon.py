"""Stems are the same whoever asks at the same time."""

import sys
from concurrent.futures import ThreadPoolExecutor

from core.knowledge import lexicon

WORDS = [
    f"{stem}{ending}"
    for stem in ("cylind", "compress", "temperat", "crack", "govern", "vibrat", "detonat", "leak")
    for ending in ("er", "ion", "ure", "ing", "ed", "ors", "ationally", "iness", "ful", "ability")
]


def test_threads_do_not_spoil_each_others_words() -> None:
    stem = lexicon._stem.__wrapped__  # without its memory, which would hide all but the first race
    alone = [stem(word) for word in WORDS]
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-5)
    try:
        with ThreadPoolExecutor(4) as pool:
            together = list(pool.map(lambda _: [stem(word) for word in WORDS], range(12)))
    finally:
        sys.setswitchinterval(interval)
    assert all(stems == alone for stems in together)

"""The paper's own numbers, read from ``assets/data/paper/tables.toml``."""

from collections.abc import Iterable, Mapping
from functools import cache
from typing import Any

from core.files import read_toml
from core.paths import DATA

PAPER = DATA / "paper" / "tables.toml"

Row = Mapping[str, Any]


@cache
def paper_tables() -> Mapping[str, Any]:
    """The whole file; raises `InputError` if it cannot be read."""
    return read_toml(PAPER, "paper")


def beside_paper(
    table: str, rows: Iterable[Row], measures: tuple[str, ...]
) -> list[dict[str, Any]]:
    """Rows with ``paper_NAME`` after each of the measures NAME; null where the paper has none."""
    reported = {row["scheme"]: row for row in paper_tables()[table]}
    return [
        {
            **row,
            **{f"paper_{name}": reported.get(row["scheme"], {}).get(name) for name in measures},
        }
        for row in rows
    ]

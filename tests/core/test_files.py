"""Files that people read too."""

import json
import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from core.experiments.paper.table6 import WRITES
from core.files import read_json, readable_json, write_json
from core.paths import ROOT
from core.provenance import TWIN_SOURCES

SCALARS = (
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False)
)
VALUES = st.recursive(
    SCALARS | st.text(max_size=5),
    lambda inner: (
        st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=3), inner, max_size=4)
    ),
    max_leaves=20,
)


def test_a_row_is_a_line() -> None:
    row = {"scheme": "paired", "f1": 0.97, "seeds": [1, 2]}
    text = readable_json({"rows": [[1, 2.5], [3, 4]], "table": [{"a": 1, "b": "x"}], "row": row})
    assert text.splitlines() == [
        "{", ' "rows": [', "  [1, 2.5],", "  [3, 4]", " ],", ' "table": [',
        '  {"a": 1, "b": "x"}', " ],", ' "row": {', '  "scheme": "paired",', '  "f1": 0.97,',
        '  "seeds": [1, 2]', " }", "}",
    ]  # fmt: skip


@given(st.dictionaries(st.text(max_size=3), VALUES, max_size=4))
def test_what_is_readable_is_the_same_json(values: dict[str, object]) -> None:
    assert json.loads(readable_json(values)) == values


def test_what_is_not_finite_is_not_written(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="JSON"):
        write_json(tmp_path / "x.json", {"a": [math.nan]})
    write_json(tmp_path / "x.json", {"a": [1.0]})
    assert read_json(tmp_path / "x.json") == {"a": [1.0]}


@pytest.mark.parametrize("pattern", [*TWIN_SOURCES, *WRITES])
def test_what_a_fingerprint_covers_is_there(pattern: str) -> None:
    assert any(ROOT.glob(pattern))

"""``diagnose DIR`` and ``report DIR`` read flights from anywhere: what is none is refused."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from app.cli import main
from core.fmea.fault import Fault
from core.twin.flight import fly_pair
from core.twin.flight_file import write_trajectory
from core.twin.plan import Plan
from core.twin.trajectory import Pair


@pytest.fixture(scope="module")
def pair() -> Pair:
    """Two flights of 40 s."""
    return fly_pair(Plan(duration_s=40.0, seed=5), Fault("baffle_crack", 0.8, 10.0))


@pytest.fixture
def folder(pair: Pair, tmp_path: Path) -> Path:
    """What simulate writes, but for what nobody reads."""
    write_trajectory(tmp_path / "faulted.parquet", pair.faulted)
    write_trajectory(tmp_path / "mirror.parquet", pair.mirror)
    return tmp_path


def change(path: Path, changed: Callable[[pa.Table], pa.Table]) -> None:
    """Put another table in the place of a file's."""
    pq.write_table(changed(pq.read_table(path)), path, compression="zstd")


def put(name: str, row: int, value: float) -> Callable[[pa.Table], pa.Table]:
    """Another value in one place."""

    def changed(table: pa.Table) -> pa.Table:
        column = table[name].to_numpy().copy()
        column[row] = value
        field = table.schema.field(name)
        place = table.column_names.index(name)
        return table.set_column(place, field, pa.array(column, field.type))

    return changed


def big(table: pa.Table) -> pa.Table:
    """One more column: a value of 1 MB, numbered in each row."""
    numbers = pa.array(np.zeros(len(table), np.int32))
    return table.append_column(
        "big", pa.DictionaryArray.from_arrays(numbers, pa.array(["x" * (1 << 20)]))
    )


@pytest.mark.parametrize("command", [["diagnose"], ["report", "--format", "json"]])
@pytest.mark.parametrize(
    ("changed", "status", "said"),
    [
        (big, 1, "has a column 'big' that no flight has"),
        (lambda table: table.drop_columns(["OAT"]), 1, "has no column 'OAT'"),
        (put("E1 RPM", 7, 3e38), 2, "has 3e+38 in E1 RPM, which no flight comes near"),
        (put("E1 RPM", 7, float("nan")), 2, "holds values that are not finite"),
        (put("time_s", 0, -1e308), 2, "has times outside 0 to 7200 s"),
        (lambda table: table[:-1], 2, "they are not of one flight"),
        (put("time_s", -1, 500.0), 2, "have different times: they are not of one flight"),
    ],
)
def test_what_is_no_flight_is_one_clear_line(
    folder: Path,
    capsys: pytest.CaptureFixture[str],
    command: list[str],
    changed: Callable[[pa.Table], pa.Table],
    status: int,
    said: str,
) -> None:
    change(folder / "mirror.parquet", changed)
    assert main([*command, str(folder)]) == status
    told = capsys.readouterr().err
    assert said in told
    assert told.count("\n") == 1


def test_a_flipped_bit_is_named(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = folder / "faulted.parquet"
    content = bytearray(path.read_bytes())
    content[len(content) // 3] ^= 4
    path.write_bytes(content)
    assert main(["diagnose", str(folder)]) == 1
    assert "faulted.parquet is damaged (checksum); fly it again" in capsys.readouterr().err


@pytest.mark.parametrize(
    "text", ["[" * 100_000, '{"plan": {', '{"plan": 5}', '{"plan": {"seed": "\\ud800"}}', "[]"]
)
def test_a_plan_that_cannot_be_read_is_said_and_not_guessed(
    folder: Path, capsys: pytest.CaptureFixture[str], text: str
) -> None:
    (folder / "run.json").write_text(text)
    assert main(["diagnose", str(folder)]) == 2
    told = capsys.readouterr().err
    assert told.startswith("mirrortwin: ") and told.count("\n") == 1

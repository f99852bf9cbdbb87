"""What the maps say of the house is so."""

import subprocess
import sys
from pathlib import Path

import pytest
from file_map import MAP, ROOT, mapped

REMEDY = "python tests/support/file_map.py"


def test_the_map_names_every_file() -> None:
    text = MAP.read_text(encoding="utf-8")
    assert mapped(text) == text, f"make it again: {REMEDY}"


@pytest.mark.parametrize("name", ["ARCHITECTURE.md", "ADDING.md", "README.md"])
def test_the_paths_that_are_named_exist(name: str) -> None:
    words = (ROOT / name).read_text(encoding="utf-8").replace("`", " ").split()
    named = {word.strip(",.:;()") for word in words if word.startswith(("core/", "app/", "tests/"))}
    assert [
        path
        for path in sorted(named)
        if "NAME" not in path and not any(ROOT.glob(path.rstrip("/")))
    ] == []


@pytest.mark.slow
def test_the_floors_hold_and_an_import_upwards_breaks_them(tmp_path: Path) -> None:
    """The contracts are no decoration: the command fails once a file of the twin imports jobs."""
    lint = [str(Path(sys.executable).with_name("lint-imports")), "--no-cache"]
    for folder in ("core", "app"):
        (tmp_path / folder).symlink_to(ROOT / folder)
    (tmp_path / "pyproject.toml").symlink_to(ROOT / "pyproject.toml")
    environment = {"PYTHONPATH": str(tmp_path), "PATH": ""}
    held = subprocess.run(lint, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert held.returncode == 0, held.stdout
    (tmp_path / "core").unlink()
    subprocess.run(["cp", "-r", ROOT / "core", tmp_path / "core"], check=True)
    (tmp_path / "core" / "twin" / "climber.py").write_text("import core.jobs.engine\n")
    broken = subprocess.run(lint, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert broken.returncode == 1
    assert "core.twin.climber -> core.jobs.engine" in broken.stdout

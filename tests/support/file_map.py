"""The map of files in ``ARCHITECTURE.md``, made from what each module says it is.

``python tests/support/file_map.py`` writes it anew between its two marks.
"""

import ast
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
MAP = ROOT / "ARCHITECTURE.md"
BEGIN, END = "<!-- map: begin -->\n", "<!-- map: end -->\n"


def _first_line(path: Path) -> str:
    said = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
    return " ".join(said.partition("\n\n")[0].split()).rstrip(".")


def file_map() -> str:
    """One line a file, room by room."""
    lines: list[str] = []
    for top in ("core", "app"):
        folders = sorted({path.parent for path in (ROOT / top).rglob("*.py")})
        for folder in folders:
            modules = [path for path in sorted(folder.glob("*.py")) if path.name != "__init__.py"]
            if not modules:
                continue
            lines += ["", f"### {folder.relative_to(ROOT).as_posix()}", ""]
            lines += [f"- `{path.stem}` {_first_line(path)}" for path in modules]
    return "\n".join(lines).strip() + "\n"


def mapped(text: str) -> str:
    """The text of ``ARCHITECTURE.md`` with the map as it should be."""
    before, _, rest = text.partition(BEGIN)
    _, _, after = rest.partition(END)
    return before + BEGIN + file_map() + END + after


if __name__ == "__main__":
    MAP.write_text(mapped(MAP.read_text(encoding="utf-8")), encoding="utf-8")

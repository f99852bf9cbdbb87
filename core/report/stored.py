"""Reports that earlier versions stored: rows of the table were Markdown, its head among them."""

import re
from collections.abc import Iterable
from typing import Any

_CELL = re.compile(r"(?<!\\)\|")
_ESCAPE = re.compile(r"\\([\\`*_{}\[\]<>#|~])")
_HEAD = "| Channel | Interval | Shift | Size | Verdict |"


def upgraded(sentences: Iterable[dict[str, Any]]) -> list[dict[str, Any]]:
    """Stored sentences as `GroundedSentence.to_dict` writes them today."""
    return [
        {**item, "checked": _with_cells(item["checked"])}
        if item["origin"] == "template" and item["kept"] and item["checked"]["kind"] == "row"
        else item
        for item in sentences
        if item["checked"]["text"] != _HEAD
    ]


def _with_cells(checked: dict[str, Any]) -> dict[str, Any]:
    if checked.get("cells"):
        return checked
    cells = _CELL.split(checked["text"].strip().strip("|"))
    return {**checked, "cells": [_ESCAPE.sub(r"\1", cell.strip()) for cell in cells], "runs": []}

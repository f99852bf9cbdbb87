"""The JSON schema of a reply, and a reader of its sentences while they stream.

A model that is constrained to a list of short sentences cannot write headings, tables or preambles,
which would be struck. An endpoint without schemas answers in plain text, which is read as it is.
"""

import json
from typing import Any

RESPONSE_FORMAT: dict[str, Any] = {
    "type": "json_schema",
    "json_schema": {
        "name": "section",
        "strict": True,
        "schema": {
            "type": "object",
            "properties": {"sentences": {"type": "array", "items": {"type": "string"}}},
            "required": ["sentences"],
            "additionalProperties": False,
        },
    },
}
"""What goes into a request as ``response_format``."""


class SentenceReader:
    r"""Reader of a reply in pieces of any size: of JSON it gives the sentences, else the text.

    >>> reader = SentenceReader()
    >>> [reader.push(piece) for piece in ('{"sentences": ["CHT 3 ro', 'se.", "It \\u0066ell."]}')]
    ['CHT 3 ro', 'se. It fell.']
    """

    def __init__(self) -> None:
        """Start before the first piece."""
        self._is_json: bool | None = None
        self._in_list = False
        self._in_string = False
        self._escape = ""
        self._said = False

    def push(self, piece: str) -> str:
        """The text that the next piece adds."""
        if self._is_json is None and piece.strip():
            self._is_json = piece.lstrip().startswith("{")
        return "".join(map(self._take, piece)) if self._is_json else piece

    def _take(self, character: str) -> str:
        if not self._in_string:
            return self._outside(character)
        if self._escape or character == "\\":
            return self._escaped(character)
        if character == '"':
            self._in_string = False
            return ""
        return character if self._in_list else ""

    def _outside(self, character: str) -> str:
        if character == "[":
            self._in_list = True
        elif character == "]":
            self._in_list = False
        elif character == '"':
            self._in_string = True
            if self._in_list:
                gap, self._said = " " if self._said else "", True
                return gap
        return ""

    def _escaped(self, character: str) -> str:
        self._escape += character
        if len(self._escape) < (6 if self._escape.startswith("\\u") else 2):
            return ""
        escape, self._escape = self._escape, ""
        try:
            text = str(json.loads(f'"{escape}"'))
        except ValueError:
            return ""
        # A line break would end the sentence's line; half of a surrogate pair is no character.
        return text.replace("\n", " ") if text.isprintable() or text.isspace() else ""

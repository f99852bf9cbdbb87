"""Signatures in miniature: which way each mode moves each channel, a row a mode."""

from dash import html

from app.figures.chain import ARROWS, WORDS
from app.kit.attributes import attributes
from core.channels import channel, cht_name, egt_name, unit_label
from core.cylinders import CYLINDERS
from core.knowledge.knowledge import ExpectedShift, ModeKnowledge

COLUMNS: tuple[str, ...] = (
    *(cht_name(cylinder) for cylinder in CYLINDERS),
    *(egt_name(cylinder) for cylinder in CYLINDERS),
    "E1 OilT", "E1 OilP", "E1 RPM", "E1 FFlow", "IAS", "AltMSL",
)  # fmt: skip
"""The channels in which failure modes differ; the rest hardly move."""

HEADS: dict[str, str] = {
    "E1 OilT": "Oil °F", "E1 OilP": "Oil psi", "E1 RPM": "RPM", "E1 FFlow": "Fuel",
    "IAS": "IAS", "AltMSL": "Alt",
}  # fmt: skip

STRONG_SIGMA = 30.0
"""A shift of this size shows in full colour."""


def head(name: str) -> str:
    """The head of a column: short, because there are many."""
    return HEADS.get(name, channel(name).label)


def cells(mode: ModeKnowledge) -> list[html.Td]:
    """A cell a column: the sign, tinted by how far the channel goes; empty where it holds."""
    signature = mode.signature(mode.usual_cylinder or CYLINDERS[0])
    return [_cell(name, signature.get(name)) for name in COLUMNS]


def expected_text(expected: ExpectedShift, name: str) -> str:
    """The expected shift with its unit, mild to severe.

    >>> expected_text(ExpectedShift("E1 OilP", "-", -1.2, -0.3), "E1 OilP")
    '−0.3 to −1.2 psi'
    """
    unit = unit_label(channel(name).unit)
    if expected.low == expected.high:
        return f"{signed(expected.low)} {unit}"
    return f"{signed(expected.mild)} to {signed(expected.severe)} {unit}"


def signed(value: float) -> str:
    """A shift as printed: its sign always, a true minus, no more digits than it needs.

    >>> signed(12.0), signed(-0.34), signed(0.0)
    ('+12', '−0.34', '0')
    """
    return f"{value:+,.4g}".replace("-", "−") if value else "0"


def strength(expected: ExpectedShift, name: str) -> int:
    """How far a severe fault takes the channel: 1 to 3, by decades of its own noise."""
    logged = channel(name)
    sigma = abs(expected.severe) / logged.sigma
    if sigma >= STRONG_SIGMA:
        return 3
    return 2 if sigma >= STRONG_SIGMA / 10.0 else 1


def _cell(name: str, expected: ExpectedShift | None) -> html.Td:
    if expected is None or expected.sign == "0":
        return html.Td("", className="sig")
    text = f"{channel(name).label} {WORDS[expected.sign]}, {expected_text(expected, name)}"
    return html.Td(
        [ARROWS[expected.sign], html.Span(text, className="visually-hidden")],
        className=f"sig sig-{strength(expected, name)}",
        title=text,
        **attributes(data_sign=expected.sign, data_name=head(name)),
    )

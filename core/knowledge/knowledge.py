"""The FMEA knowledge base: mechanism, causal chain, look-alikes and actions of every mode.

Paper section 5.2 asks for exactly this structure behind the report. The text is data, in
``assets/data/fmea/knowledge.toml``; ids, names and ratings come from the catalogue, which alone
holds them. Everything is checked on load, so that a `ModeKnowledge` can be relied on.

A channel of the knowledge base is either logged (``"E1 OilT"``) or a group of probes as
seen from the affected cylinder (``"CHT target"``, ``"EGT others"``); `resolve` turns either into
channel names. The groups are those of `core.cylinders.GROUPS`.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal, get_args

from core.channels import CHANNEL_INDEX, cht_name, egt_name
from core.cylinders import CYLINDERS, GROUPS
from core.errors import InputError
from core.files import read_toml
from core.fmea.catalogue import Mode, catalogue
from core.paths import DATA

Sign = Literal["+", "-", "0", "~"]
"""Expected residual: rises, falls, stays put, or conditional (passing, oscillating)."""

SIGNS: tuple[Sign, ...] = get_args(Sign)

_FIXED_GROUPS = frozenset(
    name for name, group in GROUPS.items() if len({frozenset(group(c)) for c in CYLINDERS}) == 1
)
"""Groups that are the same cylinders whichever one is hit."""

_PROBES: dict[str, Callable[[int], str]] = {"CHT": cht_name, "EGT": egt_name}


def resolve(channel: str, cylinder: int) -> tuple[str, ...]:
    """The channel names meant by ``channel`` when ``cylinder`` is hit, in cylinder order.

    >>> resolve("CHT mate", 2)
    ('E1 CHT4',)

    Raises `InputError` for anything but a channel or a known group.
    """
    if channel in CHANNEL_INDEX:
        return (channel,)
    probe, _, group = channel.partition(" ")
    if probe not in _PROBES or group not in GROUPS:
        groups = ", ".join(GROUPS)
        raise InputError(
            "channel",
            f"{channel!r} is neither a channel nor CHT or EGT with one of {groups}",
        )
    return tuple(_PROBES[probe](member) for member in sorted(GROUPS[group](cylinder)))


def depends_on_cylinder(channel: str) -> bool:
    """Whether a channel or group means other probes when another cylinder is hit."""
    return channel not in CHANNEL_INDEX and channel.partition(" ")[2] not in _FIXED_GROUPS


@dataclass(frozen=True, slots=True)
class ChannelSign:
    """A channel or group and the way it should move."""

    channel: str
    sign: Sign


@dataclass(frozen=True, slots=True)
class ExpectedShift:
    """A channel or group, the way it should move and how far.

    ``low`` to ``high`` is the settled residual in the channel's unit over severities 0.3 to 1; for
    sign "0" it is the trace that is still normal.
    """

    channel: str
    sign: Sign
    low: float
    high: float

    @property
    def mild(self) -> float:
        """The end of the range nearer to zero, signed: severity 0.3 for a sustained shift."""
        return min(self.low, self.high, key=abs)

    @property
    def severe(self) -> float:
        """The end of the range farther from zero, signed: severity 1 for a sustained shift."""
        return max(self.low, self.high, key=abs)


@dataclass(frozen=True, slots=True)
class ChainStep:
    """One step from defect to sensor. ``channels`` is empty where no sensor can see it."""

    text: str
    channels: tuple[ChannelSign, ...]

    def predictions(self, cylinder: int) -> dict[str, Sign]:
        """Sign by channel name, for the given cylinder."""
        return {
            name: item.sign for item in self.channels for name in resolve(item.channel, cylinder)
        }


@dataclass(frozen=True, slots=True)
class LookAlike:
    """Another mode that looks similar, what tells it apart, and the channels to read for that."""

    mode: str
    tell: str
    channels: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class ModeKnowledge:
    """All that is known of one failure mode; see the head of ``knowledge.toml`` for the fields.

    ``severity``, ``occurrence`` and ``detection`` are FMEA ratings 1-10. ``usual_cylinder`` is
    None for whole-engine modes; ``cylinder_share`` is the share of located records by cylinder.
    """

    id: str
    name: str
    summary: str
    mechanism: str
    chain: tuple[ChainStep, ...]
    channels: tuple[ExpectedShift, ...]
    look_alikes: tuple[LookAlike, ...]
    actions: tuple[str, ...]
    severity: int
    occurrence: int
    detection: int
    ata: str
    records: str
    usual_cylinder: int | None
    cylinder_share: tuple[float, ...]

    @property
    def rpn(self) -> int:
        """Risk priority number: severity times occurrence times detection."""
        return self.severity * self.occurrence * self.detection

    @property
    def names_cylinder(self) -> bool:
        """Whether the signature differs from cylinder to cylinder, so that one can be named."""
        return any(depends_on_cylinder(item.channel) for item in self.channels)

    def signature(self, cylinder: int) -> dict[str, ExpectedShift]:
        """Expected shift by channel name when ``cylinder`` is hit; channels not said are absent."""
        return {name: item for item in self.channels for name in resolve(item.channel, cylinder)}


@cache
def knowledge() -> Mapping[str, ModeKnowledge]:
    """The knowledge base by mode id, in class order; raises `InputError` on a bad file."""
    return read_knowledge(DATA / "fmea" / "knowledge.toml")


def tell_apart(one: str, other: str) -> str | None:
    """What tells two modes apart by the knowledge base; None where it does not call them alike."""
    for mode, alike in ((one, other), (other, one)):
        for item in knowledge()[mode].look_alikes:
            if item.mode == alike:
                return item.tell
    return None


def read_knowledge(path: Path) -> Mapping[str, ModeKnowledge]:
    """Read and validate a knowledge file; raises `InputError` naming mode and field."""
    tables = read_toml(path, "knowledge")
    modes = catalogue()
    for mode_id in modes:
        if mode_id not in tables:
            raise InputError(mode_id, f"is in the catalogue but missing from {path.name}")
    for mode_id in tables:
        if mode_id not in modes:
            raise InputError(mode_id, f"is in {path.name} but not in the catalogue")
    return MappingProxyType(
        {mode_id: _Entry(mode_id, tables[mode_id]).read(mode) for mode_id, mode in modes.items()}
    )


class _Entry:
    """One table of the file on its way to a `ModeKnowledge`; ``where`` names it in errors."""

    FIELDS = frozenset(
        ("summary", "mechanism", "ata", "records", "channels", "chain", "look_alikes", "actions")
    )

    def __init__(self, where: str, table: Any) -> None:
        self.where = where
        if not isinstance(table, dict):
            raise InputError(where, "must be a table")
        self.table: dict[str, Any] = table
        for name in table:
            if name not in self.FIELDS:
                raise InputError(f"{where}.{name}", f"is not one of {sorted(self.FIELDS)}")

    def read(self, mode: Mode) -> ModeKnowledge:
        channels = self._channels()
        entry = ModeKnowledge(
            id=mode.id,
            name=mode.name,
            summary=self._text("summary"),
            mechanism=self._text("mechanism"),
            chain=tuple(
                self._step(f"chain[{index}]", step)
                for index, step in enumerate(self._list("chain"), start=1)
            ),
            channels=channels,
            look_alikes=tuple(
                self._look_alike(f"look_alikes[{index}]", item)
                for index, item in enumerate(self._list("look_alikes"), start=1)
            ),
            actions=tuple(
                _text(f"{self.where}.actions[{index}]", action)
                for index, action in enumerate(self._list("actions"), start=1)
            ),
            severity=mode.severity_rating,
            occurrence=mode.occurrence,
            detection=mode.detection,
            ata=self._text("ata"),
            records=self._text("records"),
            usual_cylinder=None if mode.whole_engine else mode.cylinder,
            cylinder_share=mode.prior,
        )
        for cylinder in CYLINDERS:
            self._check_consistency(entry, cylinder)
        return entry

    def _check_consistency(self, entry: ModeKnowledge, cylinder: int) -> None:
        """Each channel is said once, and the chain says no more and nothing else."""
        named = [name for item in entry.channels for name in resolve(item.channel, cylinder)]
        twice = {name for name in named if named.count(name) > 1}
        if twice:
            raise InputError(f"{self.where}.channels", f"{sorted(twice)} is covered twice")
        signature = entry.signature(cylinder)
        for index, step in enumerate(entry.chain, start=1):
            for name, sign in step.predictions(cylinder).items():
                if name not in signature or signature[name].sign != sign:
                    raise InputError(
                        f"{self.where}.chain[{index}]",
                        f"predicts {sign} for {name}, which channels does not",
                    )

    def _text(self, name: str) -> str:
        return _text(f"{self.where}.{name}", self.table.get(name))

    def _list(self, name: str) -> list[Any]:
        items = self.table.get(name)
        if not isinstance(items, list) or not items:
            raise InputError(f"{self.where}.{name}", "must be a list with at least one entry")
        return items

    def _channels(self) -> tuple[ExpectedShift, ...]:
        table = self.table.get("channels")
        if not isinstance(table, dict) or not table:
            raise InputError(f"{self.where}.channels", "must be a table of channels")
        return tuple(
            _expected_shift(f"{self.where}.channels.{name}", name, value)
            for name, value in table.items()
        )

    def _step(self, name: str, step: Any) -> ChainStep:
        where = f"{self.where}.{name}"
        _require_fields(where, step, {"step", "signs"})
        if not isinstance(step["signs"], list):
            raise InputError(f"{where}.signs", "must be a list such as ['+ CHT target']")
        return ChainStep(
            text=_text(f"{where}.step", step["step"]),
            channels=tuple(_channel_sign(f"{where}.signs", item) for item in step["signs"]),
        )

    def _look_alike(self, name: str, item: Any) -> LookAlike:
        where = f"{self.where}.{name}"
        _require_fields(where, item, {"mode", "tell", "channels"})
        if item["mode"] not in catalogue() or item["mode"] == self.where:
            raise InputError(f"{where}.mode", f"{item['mode']!r} is not another mode")
        if not isinstance(item["channels"], list) or not item["channels"]:
            raise InputError(f"{where}.channels", "must list at least one channel")
        return LookAlike(
            mode=item["mode"],
            tell=_text(f"{where}.tell", item["tell"]),
            channels=tuple(_channel(f"{where}.channels", channel) for channel in item["channels"]),
        )


def _require_fields(where: str, table: Any, names: set[str]) -> None:
    if not isinstance(table, dict) or set(table) != names:
        raise InputError(where, f"must have exactly {', '.join(sorted(names))}")


def _text(where: str, value: Any) -> str:
    """A line of text; reports are Markdown without raw HTML, so ``<`` is refused here."""
    if not isinstance(value, str) or not value.strip():
        raise InputError(where, "must be text")
    if "<" in value or "\n" in value:
        raise InputError(where, "must be one line without '<'")
    return value.strip()


def _channel(where: str, value: Any) -> str:
    if not isinstance(value, str):
        raise InputError(where, f"must be a channel, got {value!r}")
    try:
        resolve(value, CYLINDERS[0])
    except InputError as error:
        raise InputError(where, error.problem) from None
    return value


def _channel_sign(where: str, value: Any) -> ChannelSign:
    sign, _, channel = value.partition(" ") if isinstance(value, str) else ("", "", "")
    if sign not in SIGNS:
        raise InputError(where, f"must look like '+ CHT target', got {value!r}")
    return ChannelSign(_channel(where, channel), sign)


def _expected_shift(where: str, channel: str, value: Any) -> ExpectedShift:
    match value:
        case [str(sign), int() | float() as low, int() | float() as high] if sign in SIGNS:
            pass
        case _:
            raise InputError(where, f"must be [sign, from, to], got {value!r}")
    fits = {"+": 0.0 < low <= high, "-": low <= high < 0.0, "0": low <= 0.0 <= high}
    if not (math.isfinite(low) and math.isfinite(high) and fits.get(sign, low <= high)):
        raise InputError(where, f"{low} to {high} does not fit the sign {sign!r}")
    return ExpectedShift(_channel(where, channel), sign, float(low), float(high))

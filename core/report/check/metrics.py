"""The four measures of a report (paper section 6.7).

The paper names them and gives results (Table 6), but no formulas. These are computed over the
sentences of a report, checked or vouched for:

- CCC, causal chain coverage: the share of the causal steps of the verdict that the report states,
  quoted or with at least half of a step's technical words, in sentences in which nothing is false.
- SEC, sensor evidence consistency: of all that is claimed about sensors (moved, which way, how far,
  when, kept still, expected of a mode), the share that agrees with evidence and knowledge. A report
  that claims nothing although channels moved has none.
- DC, diagnostic consistency: of all that is claimed about the verdict (the mode, probabilities,
  lead, cylinder), the share that agrees with the diagnosis; 0 where the verdict is never stated.
- HR, hallucination rate: of the sentences that claim anything, the share that is contradicted or
  that nothing supports.

A caution that the paper's own table calls for: such measures favour a writer that quotes. They say
how far a report agrees with what it was given, not whether the diagnosis behind it is true, nor
whether it reads well.
"""

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass

from core.report.case.case import Case
from core.report.check.checker import CheckedSentence

CHECKED = "How this report was checked"
HOW_CHECKED = (
    "These measure how far the text agrees with the evidence that it cites and with the FMEA "
    "knowledge, not whether the diagnosis is true."
)
MEASURES: Mapping[str, tuple[str, str]] = {
    "ccc": ("Causal chain coverage (CCC)", "1 is best"),
    "sec": ("Sensor evidence consistency (SEC)", "1 is best"),
    "dc": ("Diagnostic consistency (DC)", "1 is best"),
    "hr": ("Hallucination rate (HR)", "0 is best"),
}
"""The measures of a report in full, each with its best value."""


@dataclass(frozen=True, slots=True)
class Metrics:
    """The four measures, each 0-1; good is 1 for the first three and 0 for ``hr``."""

    ccc: float
    sec: float
    dc: float
    hr: float

    def to_dict(self) -> dict[str, float]:
        """Plain JSON-ready values, rounded to four decimals."""
        return {name: round(value, 4) for name, value in asdict(self).items()}


PAPER: dict[str, Metrics] = {
    "template": Metrics(ccc=0.950, sec=0.973, dc=0.976, hr=0.054),
    "with_fmea": Metrics(ccc=0.706, sec=0.910, dc=0.940, hr=0.122),
    "no_fmea": Metrics(ccc=0.343, sec=0.908, dc=0.939, hr=0.152),
}
"""Table 6 of the paper: means over its runs, DeepSeek-Chat as the writer of the last two."""


def measure(case: Case, sentences: Iterable[CheckedSentence]) -> Metrics:
    """The measures of a report on ``case``, made of these sentences."""
    said = [item for item in sentences if item.kind != "heading"]
    claiming = [item for item in said if item.verdict != "plain"]
    steps = {step for item in said for step in item.steps}
    sensors = sum(item.about_sensors for item in said)
    verdicts = sum(item.about_verdict for item in said)
    concluded = any(item.concludes for item in said)
    silent = 0.0 if case.evidence else 1.0
    return Metrics(
        ccc=len(steps) / len(case.top.mode.chain),
        sec=sum(item.sensors_right for item in said) / sensors if sensors else silent,
        dc=sum(item.verdict_right for item in said) / verdicts if concluded else 0.0,
        hr=sum(item.struck for item in claiming) / len(claiming) if claiming else 0.0,
    )

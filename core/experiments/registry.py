"""The experiments: the one table that command line, page *Results*, README and tests read.

A new experiment is a module with ``run(quick, progress, **options) -> Result`` and one entry here.
"""

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import Any, Literal

from core.experiments import headlines
from core.experiments.headlines import Content

Kind = Literal["scores", "picture", "model"]


@dataclass(frozen=True, slots=True)
class Experiment:
    """A result by name: how it is made, and how it is shown.

    ``module`` in `core.experiments` makes it; None where another ``command`` does. ``summary`` is
    its line in the command's help, ``options`` those that its ``run`` takes. ``about`` introduces
    it on the page; ``files`` are the results that show it, one a condition; ``duration`` says how
    long making them takes. ``lead`` is the measure drawn, ``log`` whether on a logarithmic axis.
    ``headline`` says the result in a few words. ``is_compared``: the page *Compare* can fly it.
    """

    name: str
    title: str
    about: str
    files: tuple[str, ...]
    duration: str
    module: str | None = None
    summary: str = ""
    command: str = ""
    options: tuple[str, ...] = ()
    kind: Kind = "picture"
    lead: str = "macro_f1"
    log: bool = False
    headline: Callable[[Content], str] = lambda content: ""
    is_compared: bool = False

    def __post_init__(self) -> None:
        """Fill in the command that makes it."""
        if not self.command:
            object.__setattr__(self, "command", f"mirrortwin experiment {self.name}")

    def run(self, *arguments: Any, **options: Any) -> Any:
        """Call the ``run`` of its module, which is loaded only now."""
        assert self.module is not None
        return import_module(f"core.experiments.{self.module}").run(*arguments, **options)


_TRAINED = "Trains on a data set: hours. What is done is kept, so it fills bit by bit."
_BOTH = ("data", "conditions", "minutes")

EXPERIMENTS: dict[str, Experiment] = {
    item.name: item
    for item in (
        Experiment(
            "model", "The shipped models", "What each 1D-CNN on this server takes for what, on "
            "test flights whose seeds it never saw: each row is what was injected, each column "
            "what it said.", (), _TRAINED, command="mirrortwin train", kind="model",
        ),
        Experiment(
            "table1", "Table 1: features", "The 1D-CNN on four feature modes, three seeds each. "
            "The paper's claim: residuals against a mirror beat everything else.",
            ("table1-lab", "table1-field"), _TRAINED, "paper.table1",
            "four feature modes, the 1D-CNN, three seeds",
            options=_BOTH, kind="scores", headline=headlines.best_score,
        ),
        Experiment(
            "table2", "Table 2: features and classifiers", "Every feature mode with every "
            "classifier. The paper's claim: what you show the classifier matters more than which "
            "one it is.", ("table2-lab", "table2-field"), _TRAINED, "paper.table2",
            "every feature mode with every classifier",
            options=_BOTH, kind="scores", headline=headlines.best_score,
        ),
        Experiment(
            "table3", "Table 3: residuals or states", "Whether a classifier needs residuals, "
            "states, or both.", ("table3-lab", "table3-field"), _TRAINED, "paper.table3",
            "residuals, states, or both",
            options=_BOTH, kind="scores", headline=headlines.best_score,
        ),
        Experiment(
            "table4", "Table 4: surrogate horizon", "How far ahead the GRU surrogate learns to "
            "predict, and what that does to the diagnosis.", ("table4-lab", "table4-field"),
            _TRAINED, "paper.table4", "how far ahead the surrogate learns to predict",
            options=_BOTH, kind="scores", headline=headlines.horizons,
        ),
        Experiment(
            "table5", "Table 5: cost", "What one diagnosis costs by each way. Different machines: "
            "the paper's is an Intel Core i7-12700H.", ("table5-lab",), "Under a minute.",
            "paper.table5",
            "what a diagnosis costs by each of four ways, in milliseconds and bare JSBSim runs",
            kind="scores", lead="total_ms", log=True, headline=headlines.cost,
        ),
        Experiment(
            "table6", "Table 6: reports", "How good reports are, by the template and by a language "
            "model, before and after grounding. Good is 1, for hallucinations 0.",
            ("table6-lab",), "Minutes; with a language model, hours on a small machine.",
            "paper.table6",
            "how good are reports by the template and by a language model, raw and grounded?",
            options=("minutes",), kind="scores", lead="hr", headline=headlines.reports,
        ),
        Experiment(
            "fig6", "Fig. 6: paths", "Where five faults take the aircraft, beside nominal flight.",
            ("fig6",), "Seconds.", "paper.fig6",
            "paths in 3D and from the side, five faults and nominal",
            headline=headlines.falls, is_compared=True,
        ),
        Experiment(
            "fig7", "Fig. 7: channels", "Six key channels under the same five faults.", ("fig7",),
            "Seconds.", "paper.fig7", "six key channels, five faults and nominal",
            headline=lambda content: f"{len(content['channels'])} channels, "
            f"{len(content['faults']) - 1} faults beside nominal flight", is_compared=True,
        ),
        Experiment(
            "signs", "Signs", "Does every fault move every channel the way, and as far as, "
            "engineers say it does?", ("signs",), "A minute.", "signs.signs",
            "does every fault move every channel the way engineers say?",
            headline=headlines.signs,
        ),
        Experiment(
            "realism", "Realism", "Field flights beside real G1000 logs: levels, noise, ties, and "
            "whether a classifier can tell them apart.", ("realism",),
            "Some ten minutes, and real logs.", "realism.realism",
            "our field flights beside real G1000 logs (--logs; some ten minutes)",
            options=("logs",), headline=headlines.realism,
        ),
        Experiment(
            "speed", "Speed", "What a flight costs, counted in bare JSBSim loops of the same "
            "length: the green bands are the goals.", ("speed",),
            "Some minutes, on a quiet machine.", "cost.speed",
            "what a flight costs, in bare JSBSim loops (some minutes; on a quiet machine)",
            headline=headlines.speed,
        ),
        Experiment(
            "crowd", "Many at once", "How late samples come when many pages fly at once, and what "
            "memory the server takes. The dashed line is the goal.", ("crowd",),
            "Some ten minutes, on a quiet machine.",
            command="mirrortwin bench --clients 50 --out models/results", headline=headlines.crowd,
        ),
        Experiment(
            "cross", "Lab and field", "Models trained in still air and in weather, each tested in "
            "both, and the score that each channel would win back if it read as in lab.",
            ("cross",), "Minutes, and both data sets.", "models.cross",
            "models of lab and of field, each tested in both; what each channel costs",
            options=("data",), headline=headlines.cross,
        ),
        Experiment(
            "field", "Field, end to end", "Flights in wind and gusts as the shipped diagnosis "
            "answers them, the onset unknown: F1 of whole flights.", ("field",),
            "Some ten minutes.", "models.field",
            "field flights diagnosed from end to end: onset, verdict, false evidence",
            headline=headlines.field,
        ),
        Experiment(
            "delay", "Delay", "How soon after its onset a fault is named, and stays named.",
            ("delay",), "Minutes.", "models.delay",
            "how soon is a fault named, and how well at which severity?",
            headline=headlines.delay,
        ),
        Experiment(
            "unknown", "Unknown faults", "Whether it says “none of these” to what it never learnt.",
            ("unknown",), "Minutes.", "models.unknown",
            "does it say `none of these` to what it has never learnt?",
            headline=headlines.unknown,
        ),
    )
}  # fmt: skip
"""By name, in the order in which they are shown."""

RUNNABLE: dict[str, Experiment] = {
    name: item for name, item in EXPERIMENTS.items() if item.module is not None
}
"""Those that ``mirrortwin experiment`` makes."""

COMPARED: tuple[str, ...] = tuple(name for name, item in EXPERIMENTS.items() if item.is_compared)
"""Those whose runs the page *Compare* can fly."""

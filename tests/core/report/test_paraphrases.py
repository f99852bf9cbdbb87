"""True sentences in words that a large language model would choose, written by hand.

The rules were made for the first two cases in view and measured on the third before it was used:
2 of its 24 sentences were struck then. What is struck falls back on the template, so this bounds
how much of a good writer's text is lost, not how much of a report.
"""

import tomllib
from pathlib import Path

from report_samples import diagnosis, evidence, section

from core.report.case.case import open_case
from core.report.check.checker import Checker
from core.report.sentences import sentences

CRACK = open_case(
    diagnosis(
        {"baffle_crack": 0.9, "baffle_rivet": 0.08, "cylinder_crack": 0.02},
        [evidence("E1 CHT3", 18.34, 70.0, 180.0), evidence("E1 CHT1", 1.2, 95.0, 180.0)],
    )
)
COOLER = open_case(
    diagnosis(
        {"oil_cooler_maintenance": 0.93, "baffle_seal": 0.05, "engine_seal_loose": 0.02},
        [
            evidence("E1 OilT", 22.4, 75.0, 180.0),
            evidence("E1 OilP", -2.6, 82.0, 180.0),
            *(evidence(f"E1 CHT{cylinder}", 2.1, 110.0, 180.0) for cylinder in (1, 2, 3, 4)),
        ],
    )
)
VALVE = open_case(
    diagnosis(
        {"cylinder_compression": 0.88, "cylinder_crack": 0.09, "engine_run_rough": 0.03},
        [
            evidence("E1 CHT2", -24.0, 72.0, 180.0),
            evidence("E1 EGT2", 52.0, 66.0, 180.0),
            evidence("E1 RPM", -51.0, 70.0, 180.0),
            evidence("E1 FFlow", -0.31, 70.0, 180.0),
            evidence("IAS", -2.9, 80.0, 180.0),
            evidence("E1 OilT", 1.1, 120.0, 180.0),
        ],
    )
)
BY_HAND = tomllib.loads(Path(__file__).with_name("paraphrases.toml").read_text(encoding="utf-8"))


def test_few_true_sentences_of_a_good_writer_are_struck() -> None:
    struck, total = [], 0
    for name, case in (("crack", CRACK), ("cooler", COOLER), ("valve", VALVE)):
        checker = Checker(case)
        for title, part in BY_HAND[name].items():
            results = [checker.check(item, section(title)) for item in sentences(part["sentences"])]
            total += len(results)
            struck += [(item.text, item.reasons) for item in results if item.struck]
    assert total > 80
    assert len(struck) <= 0.05 * total, struck

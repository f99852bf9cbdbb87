"""The first seed of every family of flights, far enough apart that no two families share a flight.

Data sets begin at the ``first_seed`` of their specification (``assets/data/dataset.toml``), and the
seeds that people type are small.
"""

REALISM_SEED = 20_000
TABLE6_SEED = 700_000
FRESH_SEED = 800_000
"""Evaluation flights in lab of what the models know; `UNKNOWN_SEED` of what they do not."""

UNKNOWN_SEED = 850_000
HEALTHY_SEED = 2_000_000
FIELD_SEED = 2_100_000
FIELD_VALIDATION_SEED = 2_200_000
SURROGATE_SEED = 1_500_000_000
"""Healthy flights that the surrogate learns from and is held out against."""

"""Runs: their records, their store, and the engine that has workers fly them."""

"""Experiments: the results of the paper made again, and what they are made of."""

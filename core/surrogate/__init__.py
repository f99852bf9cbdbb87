"""A network that knows the healthy aircraft and predicts its next reading (paper section 4.2)."""

"""The FMEA fault engine: catalogue, degradation laws, engine factors and effects."""

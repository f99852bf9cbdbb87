"""Where windows lie: 30 s long, every 5 s, read within 120 s after the onset.

Paper section 5.1 gives the window (1,500 steps), section 4.1 the effective window after the onset,
beyond which the two flights have drifted apart for reasons of their own.
"""

from core.clock import DT_S

WINDOW_S = 30.0
STRIDE_S = 5.0
EFFECTIVE_S = 120.0

WINDOW_STEPS = round(WINDOW_S / DT_S)
STRIDE_STEPS = round(STRIDE_S / DT_S)
EFFECTIVE_STEPS = round(EFFECTIVE_S / DT_S)

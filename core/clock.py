"""Simulated time: the steps at which flights advance, the longest flight, and times as text."""

DT_S = 0.02
"""The simulation step: 50 Hz (paper section 3.1)."""

TICK_S = 0.1
"""Seconds between two steps of the fault state."""

STEPS_PER_TICK = round(TICK_S / DT_S)

LONGEST_S = 7200.0
"""The longest flight that can be planned [s]."""


def clock(time_s: float) -> str:
    """Seconds from the start of the flight as people read them: m:ss, or h:mm:ss from an hour on.

    >>> clock(75.4), clock(3725)
    ('1:15', '1:02:05')
    """
    minutes, seconds = divmod(round(time_s), 60)
    hours, minutes_left = divmod(minutes, 60)
    return f"{hours}:{minutes_left:02d}:{seconds:02d}" if hours else f"{minutes}:{seconds:02d}"

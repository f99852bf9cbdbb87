"""Colours, type and scale of the whole app: one place for the page, the figures and the 3D scenes.

Green, amber and red mean status and nothing else (14 CFR 25.1549), so no series uses them. The
series colours keep 3:1 contrast on both the light and the dark surface, and stay apart in lightness
as well as in hue, so that they can be told apart without colour vision.
"""

FAULTED = "#2f81d8"
"""The faulted aircraft: its path, its sensor lines."""

MIRROR = "#97a3b0"
"""The healthy mirror: a quiet ghost behind the faulted line."""

RESIDUAL = "#b455c9"
"""Faulted minus mirror."""

ONSET = "#7b8794"
"""The injection mark on every time axis."""

CLASS_COLOURS: tuple[str, ...] = ("#2f81d8", "#c7519c", "#7a6ff0", "#1f9fb5", "#a5703c")
"""The most probable classes, in order; the rest are drawn in `CLASS_REST`."""

CLASS_REST = "#97a3b0"

DIVERGING: tuple[tuple[float, str], ...] = (
    (0.0, "#1b6ec2"),
    (0.25, "#6ea8e0"),
    (0.5, "rgba(151,163,176,0.10)"),
    (0.75, "#d3a878"),
    (1.0, "#a6611a"),
)
"""Residuals in sigma: blue below the mirror, brown above, nothing where both agree.

Blue and brown stay apart in every kind of colour blindness; to most of it violet looks blue.
"""

STATUS_RED = "#e03131"

VERTICAL_SCALE = 5.0
"""Vertical scale of flight paths, the same in every run and every 3D view."""

FONT_FAMILY = "Inter, 'Segoe UI', system-ui, -apple-system, 'Helvetica Neue', Arial, sans-serif"
MONO_FAMILY = "ui-monospace, 'SF Mono', 'Cascadia Mono', 'DejaVu Sans Mono', Menlo, monospace"

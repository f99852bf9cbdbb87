"""The colours that only the 3D scenes need; the two aircraft have theirs from `app.theme`."""

from dataclasses import dataclass

from app import theme

Rgb = tuple[int, int, int]


def rgb(colour: str) -> Rgb:
    """``#rrggbb`` as three bytes."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


FAULTED = rgb(theme.FAULTED)
MIRROR = rgb(theme.MIRROR)
RESIDUAL = rgb(theme.RESIDUAL)


@dataclass(frozen=True, slots=True)
class Palette:
    """Colours, sRGB 0-255. The sky is a vertical gradient, painted behind the scene."""

    onset: Rgb
    grid_cell: Rgb
    grid_section: Rgb
    sky_top: Rgb
    sky_bottom: Rgb
    text: Rgb


LIGHT = Palette(
    onset=(51, 60, 71),
    grid_cell=(220, 225, 231),
    grid_section=(187, 196, 206),
    sky_top=(232, 236, 241),
    sky_bottom=(252, 253, 254),
    text=(33, 41, 52),
)
DARK = Palette(
    onset=(233, 237, 242),
    grid_cell=(44, 50, 59),
    grid_section=(68, 77, 90),
    sky_top=(16, 19, 24),
    sky_bottom=(30, 35, 42),
    text=(226, 231, 238),
)


def palette(dark: bool) -> Palette:
    """The palette of a theme."""
    return DARK if dark else LIGHT

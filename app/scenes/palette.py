"""The colours that only the 3D scenes need; the two aircraft have theirs from `app.theme`."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app import theme

Rgb = tuple[int, int, int]


def rgb(colour: str) -> Rgb:
    """``#rrggbb`` as three bytes."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


def linear_light(colours: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """SRGB bytes as amounts of light, of the same shape (IEC 61966-2-1).

    For the colours of vertices: viser's client takes those as light and all others as sRGB.
    """
    share = colours / 255.0
    light = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    return np.rint(255.0 * light).astype(np.uint8)


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

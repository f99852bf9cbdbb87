"""The Cessna 172: a mesh of our own, built from the dimensions of its three-view drawing.

``python -m app.scenes.mesh`` writes ``assets/data/aircraft/c172.glb``, which the app reads.
Axes are the body's: x forward, y left, z up, metres, origin at the quarter chord of the wing.
Dimensions: Cessna 172P information manual, section 1 (span 36 ft 1 in, length 27 ft 2 in,
height 8 ft 9.5 in, propeller 75 in).
"""

# trimesh types its data but not all of its functions.
# mypy: disable-error-code="no-untyped-call"

import io
from functools import lru_cache

import numpy as np
import trimesh
from numpy.typing import NDArray
from trimesh.visual.material import PBRMaterial
from trimesh.visual.texture import TextureVisuals

from core.paths import DATA

GLB_PATH = DATA / "aircraft" / "c172.glb"
WINGSPAN_M = 11.0

Points = NDArray[np.float64]
Rgb = tuple[int, int, int]

_ORIGIN_AFT_M = 2.42
"""Distance from spinner tip to the wing's quarter chord: where the mesh has its origin."""

_FUSELAGE = np.array([
    # aft of spinner, half width, bottom z, top z, squareness (2 round, 4 boxy)   [m]
    (0.22, 0.22, -0.24, 0.16, 2.2),
    (0.34, 0.44, -0.40, 0.25, 2.6),
    (0.70, 0.51, -0.48, 0.30, 2.9),
    (1.40, 0.54, -0.56, 0.36, 3.0),
    (1.70, 0.55, -0.58, 0.41, 3.0),
    (2.30, 0.56, -0.60, 0.84, 3.4),
    (3.00, 0.56, -0.60, 0.87, 3.6),
    (3.60, 0.55, -0.57, 0.86, 3.4),
    (4.50, 0.42, -0.44, 0.50, 3.0),
    (5.50, 0.29, -0.26, 0.38, 2.6),
    (6.80, 0.16, -0.05, 0.30, 2.3),
    (7.70, 0.06, 0.08, 0.26, 2.0),
    (7.95, 0.02, 0.13, 0.22, 2.0),
])  # fmt: skip

_WINDOWS: tuple[tuple[float, float, float, float], ...] = (
    # aft from, aft to, z from, z to   [m]
    (1.66, 2.24, 0.42, 0.80),
    (2.36, 2.98, 0.28, 0.70),
    (3.08, 3.58, 0.28, 0.68),
    (3.70, 4.42, 0.44, 0.82),
)

_PAINTS: dict[str, tuple[float, float, float, float]] = {
    "paint": (0.92, 0.92, 0.92, 1.0),
    "glass": (0.10, 0.14, 0.19, 1.0),
    "metal": (0.20, 0.21, 0.23, 1.0),
}


def _loft(sections: Points) -> trimesh.Trimesh:
    """Skin over closed sections (k, n, 3) of equal point count, with flat end caps."""
    k, n, _ = sections.shape
    index = np.arange(k * n).reshape(k, n)
    here, there = index[:-1], index[1:]
    right = lambda grid: np.roll(grid, -1, axis=1)  # noqa: E731
    sides = np.concatenate([
        np.stack([here, right(here), right(there)], axis=-1).reshape(-1, 3),
        np.stack([here, right(there), there], axis=-1).reshape(-1, 3),
    ])  # fmt: skip
    fan = np.stack([np.zeros(n - 2, int), np.arange(1, n - 1), np.arange(2, n)], axis=1)
    caps = np.concatenate([index[0][fan[:, ::-1]], index[-1][fan]])
    mesh = trimesh.Trimesh(sections.reshape(-1, 3), np.concatenate([sides, caps]), process=True)
    mesh.fix_normals()
    return mesh


def _fuselage() -> trimesh.Trimesh:
    """Superellipse sections, interpolated along the body and smoothed where the table bends."""
    aft = np.linspace(_FUSELAGE[0, 0], _FUSELAGE[-1, 0], 72)
    smooth = np.ones(5) / 5.0
    half_width, bottom, top, squareness = (
        np.convolve(np.pad(np.interp(aft, _FUSELAGE[:, 0], column), 2, "edge"), smooth, "valid")
        for column in _FUSELAGE[:, 1:].T
    )
    angle = np.linspace(0.0, 2.0 * np.pi, 32, endpoint=False)
    power = 2.0 / squareness[:, None]
    across = np.sign(np.cos(angle)) * np.abs(np.cos(angle)) ** power
    upward = np.sign(np.sin(angle)) * np.abs(np.sin(angle)) ** power
    sections = np.stack(
        [
            np.broadcast_to(-aft[:, None], across.shape),
            half_width[:, None] * across,
            ((top + bottom) / 2.0)[:, None] + ((top - bottom) / 2.0)[:, None] * upward,
        ],
        axis=-1,
    )
    return _loft(sections)


def _airfoil(thickness: float, camber: float) -> Points:
    """NACA four-digit section, (n, 2): chordwise 0-1 and height in chords (Abbott 1959)."""
    x = (1.0 - np.cos(np.linspace(0.0, np.pi, 12))) / 2.0
    half = 5.0 * thickness * (
        0.2969 * np.sqrt(x) - 0.1260 * x - 0.3516 * x**2 + 0.2843 * x**3 - 0.1036 * x**4
    )  # fmt: skip
    line = np.where(x < 0.4, camber / 0.16 * (0.8 * x - x**2),
                    camber / 0.36 * (0.2 + 0.8 * x - x**2))  # fmt: skip
    upper, lower = np.stack([x, line + half], axis=1), np.stack([x, line - half], axis=1)
    return np.concatenate([upper[::-1], lower[1:-1]])


def _surface(
    stations: list[tuple[float, float, float, float]], airfoil: Points, *, upright: bool = False
) -> trimesh.Trimesh:
    """A wing or tail from stations (span position, leading edge aft, chord, height) [m]."""
    sections = []
    for span, leading_edge, chord, height in stations:
        aft = leading_edge + chord * airfoil[:, 0]
        thick = chord * airfoil[:, 1]
        along = np.full_like(aft, span)
        columns = [-aft, thick, along + height] if upright else [-aft, along, thick + height]
        sections.append(np.stack(columns, axis=1))
    return _loft(np.array(sections))


def _mirrored(mesh: trimesh.Trimesh) -> list[trimesh.Trimesh]:
    """The part and its mirror image across the plane of symmetry."""
    other = mesh.copy()
    other.apply_transform(np.diag([1.0, -1.0, 1.0, 1.0]))
    return [mesh, other]


def _bar(start: Points, end: Points, width: float, thickness: float) -> trimesh.Trimesh:
    """A streamlined bar, ``width`` along x, between two points [m]."""
    ring = np.linspace(0.0, 2.0 * np.pi, 10, endpoint=False)
    along = (end - start) / np.linalg.norm(end - start)
    side = np.cross(along, [1.0, 0.0, 0.0])
    side /= np.linalg.norm(side)
    outline = (
        np.outer(np.cos(ring), [width / 2.0, 0.0, 0.0]) + np.outer(np.sin(ring), side) * thickness
    )
    return _loft(np.stack([outline + start, outline + end]))


def _blob(center: tuple[float, float, float], radii: tuple[float, float, float]) -> trimesh.Trimesh:
    """An ellipsoid [m]."""
    sphere: trimesh.Trimesh = trimesh.creation.icosphere(subdivisions=2)
    sphere.apply_scale(radii)
    sphere.apply_translation(center)
    return sphere


def _wings() -> list[trimesh.Trimesh]:
    section = _airfoil(0.12, 0.02)
    wing = _surface(
        [(0.0, 2.0, 1.63, 0.80), (2.60, 2.0, 1.63, 0.88), (5.30, 2.16, 1.15, 0.96),
         (5.46, 2.30, 0.86, 0.98), (5.50, 2.48, 0.50, 0.99)],
        section,
    )  # fmt: skip
    strut = _bar(np.array([-2.55, 0.54, -0.45]), np.array([-2.50, 2.50, 0.83]), 0.16, 0.035)
    return [*_mirrored(wing), *_mirrored(strut)]


def _tail() -> list[trimesh.Trimesh]:
    section = _airfoil(0.09, 0.0)
    plane = _surface(
        [(0.0, 6.72, 1.32, 0.24), (1.60, 7.02, 0.86, 0.24), (1.72, 7.16, 0.62, 0.24)], section
    )
    fin = _surface(
        [(0.20, 5.30, 2.72, 0.0), (0.42, 6.20, 1.86, 0.0), (0.62, 6.60, 1.50, 0.0),
         (1.36, 7.28, 0.94, 0.0), (1.43, 7.38, 0.80, 0.0)],
        section, upright=True,
    )  # fmt: skip
    return [*_mirrored(plane), fin]


def _running_gear() -> tuple[list[trimesh.Trimesh], list[trimesh.Trimesh]]:
    """Legs and fairings (painted), tyres and propeller (dark)."""
    leg = _bar(np.array([-2.95, 0.42, -0.52]), np.array([-3.05, 1.22, -0.95]), 0.14, 0.03)
    fairing = _blob((-3.08, 1.26, -0.98), (0.42, 0.12, 0.19))
    tyre = _blob((-3.05, 1.26, -1.06), (0.19, 0.08, 0.19))
    nose_leg = _bar(np.array([-1.10, 0.0, -0.45]), np.array([-1.02, 0.0, -0.94]), 0.11, 0.05)
    nose_fairing = _blob((-1.08, 0.0, -0.99), (0.36, 0.11, 0.18))
    nose_tyre = _blob((-1.03, 0.0, -1.07), (0.18, 0.07, 0.18))
    spinner = _blob((-0.24, 0.0, -0.04), (0.24, 0.18, 0.18))
    blade = _bar(np.array([-0.16, 0.0, -0.04]), np.array([-0.16, 0.30, 0.865]), 0.05, 0.075)
    other = blade.copy()
    other.apply_transform(
        trimesh.transformations.rotation_matrix(np.pi, [1.0, 0.0, 0.0], [-0.16, 0.0, -0.04])
    )
    painted = [*_mirrored(leg), *_mirrored(fairing), nose_leg, nose_fairing, spinner]
    return painted, [*_mirrored(tyre), nose_tyre, blade, other]


def _is_window(centers: Points) -> NDArray[np.bool_]:
    """Which fuselage faces are glazed, from their centres (n, 3)."""
    aft, height = -centers[:, 0], centers[:, 2]
    glazed = np.zeros(len(centers), dtype=bool)
    for aft_from, aft_to, z_from, z_to in _WINDOWS:
        glazed |= (aft > aft_from) & (aft < aft_to) & (height > z_from) & (height < z_to)
    return glazed


def build_c172() -> trimesh.Scene:
    """The aircraft as three parts, ``paint``, ``glass`` and ``metal``, each with its material."""
    body = _fuselage()
    glazed = _is_window(body.triangles_center)
    painted, dark = _running_gear()
    parts = {
        "paint": [body.submesh([np.flatnonzero(~glazed)], append=True),
                  *_wings(), *_tail(), *painted],
        "glass": [body.submesh([np.flatnonzero(glazed)], append=True)],
        "metal": dark,
    }  # fmt: skip
    scene = trimesh.Scene()
    for name, meshes in parts.items():
        part = trimesh.util.concatenate(meshes)
        part.apply_translation([_ORIGIN_AFT_M, 0.0, 0.0])
        # Creases sharper than 40 degrees stay creases: without this the wing looks inflated.
        part = trimesh.graph.smooth_shade(part, angle=np.radians(40.0))
        part.visual = TextureVisuals(material=_material(name, _PAINTS[name]))
        scene.add_geometry(part, node_name=name, geom_name=name)
    return scene


def _material(name: str, rgba: tuple[float, float, float, float]) -> PBRMaterial:
    return PBRMaterial(
        name=name,
        baseColorFactor=list(rgba),
        metallicFactor=0.1,
        roughnessFactor=0.55,
        alphaMode="OPAQUE" if rgba[3] >= 1.0 else "BLEND",
        doubleSided=True,
    )


@lru_cache(maxsize=16)
def aircraft_glb(paint: Rgb, opacity: float = 1.0) -> bytes:
    """The aircraft as binary glTF, painted in sRGB ``paint``; below 1 ``opacity`` makes a ghost."""
    scene = trimesh.load_scene(GLB_PATH)
    for name, part in scene.geometry.items():
        # glTF colours are linear; the page's are sRGB.
        rgb = np.array(_PAINTS[name][:3]) if name != "paint" else (np.array(paint) / 255.0) ** 2.2
        part.visual.material = _material(
            name, (float(rgb[0]), float(rgb[1]), float(rgb[2]), opacity)
        )
    buffer = io.BytesIO()
    scene.export(buffer, file_type="glb", include_normals=True)
    return buffer.getvalue()


def main() -> None:
    """Build the mesh and write it where the app reads it."""
    GLB_PATH.parent.mkdir(parents=True, exist_ok=True)
    GLB_PATH.write_bytes(build_c172().export(file_type="glb", include_normals=True))


if __name__ == "__main__":
    main()

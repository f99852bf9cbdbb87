"""The aircraft that is drawn is a Cessna 172."""

import io

import numpy as np
import pytest
import trimesh
from scipy.spatial import KDTree

from app.scenes.mesh import GLB_PATH, WINGSPAN_M, aircraft_glb, build_c172


def test_dimensions_are_those_of_the_manual() -> None:
    length, span, height = trimesh.load_scene(GLB_PATH).extents
    assert length == pytest.approx(8.28, abs=0.1)
    assert span == pytest.approx(WINGSPAN_M, abs=0.05)
    assert height == pytest.approx(2.68, abs=0.05)


def test_the_left_side_mirrors_the_right() -> None:
    vertices = build_c172().geometry["paint"].vertices
    distance, _ = KDTree(vertices).query(vertices * [1.0, -1.0, 1.0])
    # A few corners differ: the triangles along the windows are cut the other way.
    assert np.mean(distance < 0.01) > 0.99


def test_the_wing_is_high_and_the_nose_in_front() -> None:
    vertices = build_c172().geometry["paint"].vertices
    tips = vertices[np.abs(vertices[:, 1]) > 5.0]
    assert tips[:, 2].min() > 0.7
    assert np.abs(tips[:, 0]).max() < 1.2, "the tips lie abeam of the origin"
    tail = vertices[vertices[:, 2] > 1.2]
    assert tail[:, 0].max() < -4.0, "what stands highest is the fin, behind"


def test_the_file_is_what_the_code_builds() -> None:
    stored = trimesh.load_scene(GLB_PATH)
    built = build_c172()
    assert set(stored.geometry) == set(built.geometry)
    for name, part in built.geometry.items():
        np.testing.assert_allclose(stored.geometry[name].vertices, part.vertices, atol=1e-5)
    assert GLB_PATH.stat().st_size < 300_000


def test_paint_and_ghost_are_in_the_glb() -> None:
    scene = trimesh.load_scene(io.BytesIO(aircraft_glb((255, 0, 128), 0.5)), file_type="glb")
    material = scene.geometry["paint"].visual.material
    assert material.alphaMode == "BLEND"
    np.testing.assert_allclose(material.baseColorFactor, [255, 0, 56, 128], atol=2)
    solid = trimesh.load_scene(io.BytesIO(aircraft_glb((255, 0, 128))), file_type="glb")
    assert solid.geometry["paint"].visual.material.alphaMode == "OPAQUE"

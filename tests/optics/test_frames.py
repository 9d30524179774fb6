"""Frames: a Mueller matrix tells the same story in each of them."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from pbrdf.optics.frames import angle_between, change_frames, normalised, table_axis, transverse
from pbrdf.optics.mueller import linear_polariser, rotator

Float = NDArray[np.float64]
COUNT = 200


def unit_vectors(seed: int) -> Float:
    return normalised(np.random.default_rng(seed).normal(size=(COUNT, 3)))


@pytest.fixture
def beam() -> Float:
    return unit_vectors(1)


def frame_across(beam: Float, seed: int) -> Float:
    return transverse(unit_vectors(seed), beam)


def modulo_half_turn(angle: Float) -> Float:
    return np.abs((angle + np.pi / 2) % np.pi - np.pi / 2)


def test_a_unit_vector_has_length_one_and_zero_has_none(beam: Float) -> None:
    np.testing.assert_allclose(np.linalg.norm(beam, axis=-1), 1.0)
    assert np.isnan(normalised([0.0, 0.0, 0.0])).all()


def test_table_axis_stands_across_light_and_camera(beam: Float) -> None:
    light = unit_vectors(2)
    axis = table_axis(light, beam)
    np.testing.assert_allclose(np.sum(axis * light, axis=-1), 0.0, atol=1e-14)
    np.testing.assert_allclose(np.sum(axis * beam, axis=-1), 0.0, atol=1e-14)
    np.testing.assert_allclose(table_axis([0.0, 0.0, 1.0], [1.0, 0.0, 0.0]), [0.0, 1.0, 0.0])
    assert np.isnan(table_axis([0.0, 0.0, 1.0], [0.0, 0.0, 1.0])).all()


def test_a_projected_axis_lies_across_the_beam_and_turns_no_further_than_it_must(beam: Float) -> None:
    axis = unit_vectors(3)
    x = transverse(axis, beam)
    np.testing.assert_allclose(np.sum(x * beam, axis=-1), 0.0, atol=1e-14)
    # axis, beam and the projection lie in one plane, the projection on the side of the axis
    np.testing.assert_allclose(np.sum(np.cross(axis, beam) * x, axis=-1), 0.0, atol=1e-14)
    assert np.all(np.sum(axis * x, axis=-1) > 0)


def test_angles_are_right_handed_about_the_beam(beam: Float) -> None:
    x = frame_across(beam, 4)
    turn = np.linspace(-3.1, 3.1, COUNT)
    turned = np.cos(turn)[:, None] * x + np.sin(turn)[:, None] * np.cross(beam, x)
    np.testing.assert_allclose(angle_between(x, turned, beam), turn, atol=1e-12)
    np.testing.assert_allclose(angle_between(turned, x, beam), -turn, atol=1e-12)
    np.testing.assert_allclose(angle_between(x, turned, -beam), -turn, atol=1e-12)


def test_a_polariser_fixed_in_space_is_one_at_another_angle_in_another_frame(beam: Float) -> None:
    x, x_new = frame_across(beam, 5), frame_across(beam, 6)
    axis = np.linspace(0.0, np.pi, COUNT)
    in_space = np.cos(axis)[:, None] * x + np.sin(axis)[:, None] * np.cross(beam, x)
    turn = angle_between(x, x_new, beam)
    found = change_frames(linear_polariser(axis), turn, turn)
    np.testing.assert_allclose(found, linear_polariser(angle_between(x_new, in_space, beam)), atol=1e-12)


def test_there_and_back(beam: Float) -> None:
    mueller = np.random.default_rng(7).normal(size=(COUNT, 4, 4))
    out = unit_vectors(8)
    angles = [angle_between(frame_across(z, 9), frame_across(z, 10), z) for z in (beam, out)]
    back = [angle_between(frame_across(z, 10), frame_across(z, 9), z) for z in (beam, out)]
    assert np.abs(change_frames(mueller, *angles) - mueller).max() > 0.1
    np.testing.assert_allclose(change_frames(change_frames(mueller, *angles), *back), mueller, atol=1e-13)


def test_by_a_third_frame_is_as_good_as_straight(beam: Float) -> None:
    mueller = np.random.default_rng(11).normal(size=(COUNT, 4, 4))
    out = unit_vectors(12)
    x = {
        name: [frame_across(z, seed) for z in (beam, out)] for name, seed in (("a", 13), ("b", 14), ("c", 15))
    }

    def turns(start: str, end: str) -> list[Float]:
        return [angle_between(a, b, z) for a, b, z in zip(x[start], x[end], (beam, out), strict=True)]

    by_way_of_b = change_frames(change_frames(mueller, *turns("a", "b")), *turns("b", "c"))
    np.testing.assert_allclose(by_way_of_b, change_frames(mueller, *turns("a", "c")), atol=1e-13)
    over = np.asarray(turns("a", "b")) + turns("b", "c") - np.asarray(turns("a", "c"))
    np.testing.assert_allclose(modulo_half_turn(over), 0.0, atol=1e-12)


def test_stokes_vectors_in_and_out_agree_with_the_matrix_in_every_frame() -> None:
    random = np.random.default_rng(16)
    mueller, stokes = random.normal(size=(2, COUNT, 4, 4))
    turn_in, turn_out = random.uniform(-3, 3, (2, COUNT))
    straight = rotator(turn_out) @ mueller @ stokes
    np.testing.assert_allclose(
        change_frames(mueller, turn_in, turn_out) @ rotator(turn_in) @ stokes, straight, atol=1e-13
    )

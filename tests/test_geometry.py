"""Angles and accelerations against exact values and mpmath with 50 digits."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from accelcal.errors import InputError
from accelcal.geometry import MOUNTINGS, accelerations
from accelcal.head_angles import angular_distance, head_positions, position_angles, turn_angles

ANGLES = st.floats(-3600, 3600, allow_subnormal=False)
FIXTURE = st.floats(-0.1, 0.1, allow_subnormal=False)


def precise(angle_deg: float, delta0: float) -> tuple[float, float]:
    """Cosine and sine of the sum, rounded once."""
    with mpmath.workdps(50):
        angle = mpmath.mpf(angle_deg) * mpmath.pi / 180 + mpmath.mpf(delta0)
        return float(mpmath.cos(angle)), float(mpmath.sin(angle))


# Positions


def test_positions_of_figure_2() -> None:
    assert position_angles(range(1, 10)).tolist() == [0, 45, 90, 135, 180, 225, 270, 315, 360]


@given(st.integers(1, 720))
def test_a_turn_is_equally_spaced_and_returns(positions: int) -> None:
    angles = turn_angles(positions)
    assert angles.shape == (positions + 1,)
    assert angles[0] == 0.0
    assert angles[-1] == 360.0
    np.testing.assert_allclose(np.diff(angles), 360 / positions, rtol=1e-12, atol=1e-12)
    assert_array_equal(angles, position_angles(np.arange(1, positions + 2), positions))


def test_positions_keep_their_shape() -> None:
    assert position_angles([[1, 2], [3, 9]]).tolist() == [[0, 45], [90, 360]]
    assert position_angles(13, positions=24).shape == ()
    assert position_angles(13, positions=24) == 180.0
    assert position_angles([]).shape == (0,)


@given(st.integers(1, 72), st.integers(-720_000, 720_000))
def test_a_turn_has_its_positions_wherever_it_starts(positions: int, millidegrees: int) -> None:
    places = head_positions(turn_angles(positions) + millidegrees / 1000.0)
    assert places[-1] == places[0]
    assert np.unique(places).size == positions
    assert (places >= 0.0).all()
    assert (places < 360.0).all()


@given(ANGLES, ANGLES)
def test_the_distance_of_two_angles_is_that_of_their_directions(one: float, other: float) -> None:
    c, s = precise(one - other, 0.0)
    distance = float(angular_distance(np.array(one), other))
    assert distance == pytest.approx(abs(np.degrees(np.arctan2(s, c))), abs=1e-9)


@pytest.mark.parametrize(("position", "positions"), [(0, 8), (10, 8), (-3, 12), (14, 12), (6, 4)])
def test_a_position_outside_the_turn_is_refused(position: int, positions: int) -> None:
    with pytest.raises(InputError) as caught:
        position_angles([1, position, 99], positions)
    assert str(caught.value) == (
        f"position {position} is outside the turn; with {positions} positions"
        f" J is a whole number from 1 to {positions + 1}"
    )


@pytest.mark.parametrize("positions", [0, -8])
def test_a_turn_without_positions_is_refused(positions: int) -> None:
    with pytest.raises(InputError, match=f"^{positions} positions in a turn; .* at least 1"):
        turn_angles(positions)


# Accelerations


@given(ANGLES, FIXTURE)
def test_against_fifty_digits(angle: float, delta0: float) -> None:
    cosine, sine = precise(angle, delta0)
    found = accelerations(angle, delta0)
    assert found.input == pytest.approx(cosine, rel=0, abs=4e-16)
    assert found.pendulous == pytest.approx(sine, rel=0, abs=4e-16)


@pytest.mark.parametrize("turns", [0, -1, 1, -7, 1000])
def test_quarter_turns_are_exact(turns: int) -> None:
    found = accelerations(360.0 * turns + np.array([0.0, 90.0, 180.0, 270.0]))
    assert found.input.tolist() == [1, 0, -1, 0]
    assert found.pendulous.tolist() == [0, 1, 0, -1]


@pytest.mark.parametrize("mounting", MOUNTINGS)
def test_zeros_of_the_sensing_axes_have_no_sign(mounting: str) -> None:
    found = accelerations(np.arange(-720.0, 721.0, 90.0), mounting=mounting)
    zero_input = found.input[found.input == 0.0]
    assert zero_input.size == 8
    assert not np.signbit(zero_input).any()


@pytest.mark.parametrize("angle", [45.0, 135.0, 225.0, 315.0, -45.0])
def test_the_diagonals_share_gravity_equally(angle: float) -> None:
    found = accelerations(angle)
    assert abs(found.input) == pytest.approx(np.sqrt(0.5), abs=2e-16)
    assert abs(found.pendulous) == pytest.approx(np.sqrt(0.5), abs=2e-16)


@pytest.mark.parametrize("delta0", [1e-3, 1e-9, 1e-17, -1e-17])
def test_a_small_fixture_angle_survives_at_every_quarter_turn(delta0: float) -> None:
    """The 1e-17 would be lost if it were added to the angle in radians."""
    found = accelerations([0.0, 90.0, 180.0, 270.0, 360.0], delta0)
    s = np.sin(delta0)
    assert found.pendulous[[0, 2, 4]].tolist() == [s, -s, s]
    assert found.input[[1, 3]].tolist() == [-s, s]


@given(ANGLES, FIXTURE)
def test_the_mountings_are_the_same_motion_seen_on_other_axes(angle: float, delta0: float) -> None:
    seen = {mounting: accelerations(angle, delta0, mounting) for mounting in MOUNTINGS}
    cosine, sine = seen["o+"].input, seen["o+"].pendulous
    assert all(a.input == cosine for a in seen.values())
    assert [float(a.pendulous) for a in seen.values()] == [sine, -sine, 0.0, 0.0]
    assert [float(a.output) for a in seen.values()] == [0.0, 0.0, sine, -sine]


@given(ANGLES, FIXTURE, st.sampled_from(MOUNTINGS))
def test_gravity_keeps_its_length(angle: float, delta0: float, mounting: str) -> None:
    assert sum(a**2 for a in accelerations(angle, delta0, mounting)) == pytest.approx(
        1.0, abs=1e-15
    )


def test_angle_and_mounting_broadcast() -> None:
    angles = np.array([[0.0], [90.0], [30.0]])
    grid = accelerations(angles, 1e-3, list(MOUNTINGS))
    cosine, pendulous, output = np.broadcast_arrays(*grid)
    assert cosine.shape == (3, 4)
    for place in np.ndindex(3, 4):
        one = accelerations(float(angles[place[0], 0]), 1e-3, MOUNTINGS[place[1]])
        assert (cosine[place], pendulous[place], output[place]) == tuple(map(float, one))


@pytest.mark.parametrize("mounting", ["o", "", "O+", "x-"])
def test_an_unknown_mounting_is_refused(mounting: str) -> None:
    with pytest.raises(InputError) as caught:
        accelerations([0.0, 90.0], mounting=["o+", mounting])
    assert str(caught.value) == f"mounting {mounting!r} is unknown; it is one of o+, o-, p+, p-"


@pytest.mark.parametrize("delta0", [np.nan, np.inf, -np.inf])
def test_a_fixture_angle_that_is_not_finite_is_refused(delta0: float) -> None:
    with pytest.raises(InputError, match=rf"^delta0 is {delta0}; it is a finite number$"):
        accelerations(0.0, delta0)


def test_a_position_between_two_is_refused():
    with pytest.raises(InputError, match=r"position 1\.5 is outside .* whole number"):
        position_angles([1, 1.5])


@pytest.mark.parametrize("angle", [np.nan, np.inf])
def test_an_angle_that_is_no_number_is_refused(angle):
    with pytest.raises(InputError, match=r"angle (nan|inf); it is a finite number"):
        accelerations([0.0, angle])


def test_all_axes_take_the_shape_of_angle_and_mounting_together():
    found = accelerations(np.zeros((3, 1)), mounting=np.array(["o+", "o-", "p+", "p-"]))
    assert {axis.shape for axis in found} == {(3, 4)}

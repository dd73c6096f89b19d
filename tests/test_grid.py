"""The least point of a grid is found from each 64th of its points."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from accelcal.estimate.contrasts import Grid


def misfit(points, share, shape, squares):
    """Likelihood of a size beside noise, as for the head error."""
    variance = share + points[..., None] ** 2 * shape
    return (np.log(variance) + squares / variance).sum(axis=-1)


@given(
    st.lists(st.floats(0.05, 1.0), min_size=1, max_size=8),
    st.integers(0, 2**32 - 1),
    st.floats(-2.0, 3.0),
)
def test_the_whole_grid_has_no_lower_point(strengths, seed, size):
    shape = np.array(strengths) ** 2
    noise = np.random.default_rng(seed).standard_normal(shape.size)
    squares = (1.0 + 10.0 ** (2 * size) * shape) * noise**2
    share = shape.size / (shape.size + 6.0)
    grid = Grid(np.log(0.01), 0.005, 2500)
    points = np.exp(np.log(0.01) + 0.005 * np.arange(2500))
    values = misfit(points, share, shape, squares)
    point, least = grid.least(lambda x: misfit(x, share, shape, squares))
    # of two valleys of one depth either will do
    assert least[0] <= values.min() + 0.02
    if least[0] <= values.min():
        assert np.isclose(point[0], points[np.argmin(values)], rtol=1e-12)


def test_the_ends_of_the_grid_belong_to_it():
    grid = Grid(0.0, 0.01, 100)
    falling, rising = (grid.least(lambda x, sign=sign: sign * x)[0][0] for sign in (-1.0, 1.0))
    assert np.isclose(falling, np.exp(0.99))
    assert rising == 1.0

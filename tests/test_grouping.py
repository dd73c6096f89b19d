"""Sums over groups: in one product where they are small, stacked where they are large."""

import numpy as np
import pytest

from accelcal.numerics import grouping
from accelcal.numerics.grouping import grouped


@pytest.fixture(params=["in one product", "stacked"])
def way(request, monkeypatch):
    if request.param == "stacked":
        monkeypatch.setattr(grouping, "_SMALL", 0)
        monkeypatch.setattr(grouping, "_CACHED", 8)


@pytest.mark.parametrize("members", [[3], [2, 2, 2], [1, 4, 2, 4, 1]])
@pytest.mark.usefixtures("way")
def test_sums_and_products_over_groups(members):
    rng = np.random.default_rng(0)
    index = rng.permutation(np.repeat(np.arange(len(members)), members))
    values, columns = rng.normal(size=(index.size, 3)), rng.normal(size=(index.size, 2))
    found = grouped(index)
    products, sums = found.products(values, columns), found.sums(values)
    for group in range(len(members)):
        own = index == group
        assert products[group] == pytest.approx(values[own].T @ columns[own], rel=1e-12)
        assert sums[group] == pytest.approx(values[own].sum(axis=0), rel=1e-12)


def test_more_groups_than_a_short_number_counts():
    index = np.arange(40_000)[::-1]
    assert grouped(index).order.tolist() == index.tolist()

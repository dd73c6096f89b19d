"""Sparse regression of packages that are not part of accelcal; each is imported when it is used."""

from __future__ import annotations

import warnings

import numpy as np

from rivals.dictionary import Dictionary, Floats
from rivals.stepwise import MOST

THRESHOLDS = np.geomspace(1.5, 12.0, 10)
"""Of STLSQ, in standard deviations of what the base model leaves."""


def lasso_cv(given: Dictionary) -> list[int]:
    """LassoCV of scikit-learn, its five folds shuffled."""
    from sklearn.linear_model import LassoCV
    from sklearn.model_selection import KFold

    columns, reading = _scaled(given)
    folds = KFold(5, shuffle=True, random_state=0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the smallest penalties, which do not converge
        fit = LassoCV(cv=folds).fit(columns * np.sqrt(reading.size), reading)
    return _strongest(fit.coef_)


def frols(given: Dictionary) -> list[int]:
    """FROLS of sysidentpy with BIC; the columns are inputs with a lag of one reading."""
    from sysidentpy.basis_function import Polynomial
    from sysidentpy.model_structure_selection import FROLS
    from sysidentpy.parameter_estimation import LeastSquares

    columns, reading = _scaled(given)
    count = columns.shape[1]
    model = FROLS(
        order_selection=True,
        n_info_values=MOST,
        info_criteria="bic",
        xlag=[[1]] * count,
        model_type="NFIR",
        estimator=LeastSquares(),
        basis_function=Polynomial(degree=1),
        err_tol=None,
    )
    inputs, outputs = np.vstack([columns, np.zeros(count)]), np.append(0.0, reading)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        model.fit(X=inputs, y=outputs[:, None])
    # column 0 of its regressors is the constant
    return [int(place) - 1 for place in model.pivv[: len(model.final_model)] if place > 0]


def stlsq(given: Dictionary) -> list[int]:
    """STLSQ of pysindy, its threshold chosen by BIC."""
    from pysindy.optimizers import STLSQ

    columns, reading = _scaled(given)
    found = [np.zeros(columns.shape[1])]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of thresholds that leave no column
        for threshold in THRESHOLDS:
            fit = STLSQ(threshold=float(threshold)).fit(columns, reading[:, None])
            found.append(np.asarray(fit.coef_)[0])
    return _strongest(min(found, key=lambda size: _bic(columns, reading, size)))


def _scaled(given: Dictionary) -> tuple[Floats, Floats]:
    """Unit columns, and readings in standard deviations of what the base model leaves."""
    return given.columns, given.reading / float(np.sqrt(np.mean(given.reading**2)))


def _bic(columns: Floats, reading: Floats, size: Floats) -> float:
    squares = float(np.sum((reading - columns @ size) ** 2))
    n = reading.size
    return n * float(np.log(squares / n)) + float(np.log(n)) * np.count_nonzero(size)


def _strongest(size: Floats) -> list[int]:
    order = np.argsort(-np.abs(size), kind="stable")
    return [int(place) for place in order if size[place]]

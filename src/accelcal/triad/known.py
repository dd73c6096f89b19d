"""Attitudes known: bias and all nine sensitivities by linear least squares.

An error of the attitude does not act on a channel along gravity, so what repeated visits to such an
attitude scatter by is the noise of the channel alone: with what changes from visit to visit, and
without the errors of attitudes, which are most of what is left elsewhere.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from accelcal.arguments.axes import AXES
from accelcal.arrays import Array, Labels
from accelcal.errors import DesignError, InputError
from accelcal.estimate.uncertainty import welch_satterthwaite
from accelcal.numerics.decimal_steps import decimal_steps
from accelcal.triad.record import TriadRecord, names_of, places_of
from accelcal.triad.solution import Design, Seats, Solution, design_of, seats_of

_ALONG = 0.01
"""Share of an error of the attitude, in its square, that a channel feels at most: 6 deg."""


class Noise(NamedTuple):
    """Noise of a channel in one visit [output unit^2]."""

    variance: float  # of the output
    rounding: float  # that of rounding, which all visits to an attitude may have in common
    dof: float  # degrees of freedom; 0 where nothing tells it


class Visits(NamedTuple):
    """Rows that follow each other in one attitude, averaged.

    Attributes
    ----------
    output : ndarray, shape (v, 3)
        Outputs [output unit].
    up : ndarray, shape (v, 3)
        Acceleration along the axes of the block [g].
    share : ndarray, shape (n,)
        What the variance of a visit is worth in the mean of all rows of each attitude.
    steps : ndarray, shape (3,)
        Decimal step in which the outputs come [output unit].
    """

    output: Array
    up: Array
    share: Array
    steps: Array

    @classmethod
    def of(cls, record: TriadRecord) -> Visits:
        """Find the visits of a record whose attitudes are known, a row each.

        Examples
        --------
        >>> up = np.eye(3)[[0, 0, 1, 2, 0]]
        >>> found = Visits.of(TriadRecord(np.arange(15.0).reshape(5, 3), up))
        >>> found.output[:, 0].tolist(), found.share.round(3).tolist()
        ([1.5, 6.0, 9.0, 12.0], [0.556, 1.0, 1.0])
        """
        if record.up is None:
            raise ValueError("visits of attitudes that are not known")
        number = Labels.of(names_of(record)).code
        start = np.flatnonzero(np.diff(number, prepend=-1))
        rows = np.diff(start, append=len(number))
        output, up = (np.add.reduceat(a, start) / rows[:, None] for a in (record.output, record.up))
        whole, squares = (np.bincount(number[start], weights=rows**power) for power in (1, 2))
        return cls(output, up, np.asarray(squares / whole**2), decimal_steps(record.output.T))

    def noise(self, sensitivity: Array) -> list[Noise]:
        """Noise of the channels, with S of y = b + S a, by visits in which each is up or down."""
        felt = self.up @ sensitivity.T
        along = np.abs(felt) >= np.sqrt(1.0 - _ALONG) * np.linalg.norm(sensitivity, axis=1)
        left = self.output - felt
        rounding = (self.steps**2 / 12.0).tolist()
        found = [_scatter(left[own, i], self.up[own]) for i, own in enumerate(along.T)]
        return [
            Noise(squares / max(dof, 1.0), step, dof)
            for (squares, dof), step in zip(found, rounding, strict=True)
        ]


def _scatter(values: Array, up: Array) -> tuple[float, float]:
    """Sum of squares about the means of directions, and its degrees of freedom."""
    place = np.array(places_of(up), dtype=np.intp)
    number = np.bincount(place)
    off = values - (np.bincount(place, weights=values) / np.maximum(number, 1))[place]
    return float(off @ off), float(values.size - number.size)


_FEWEST = 4
_ONE = 1e-6  # rad
_OWN_COLUMN = "give each channel the column of its own outputs"
_LEAST = 1e-6
"""Mean variance in the residuals, in place of none where errors of attitudes leave nothing."""

_LITTLE = 0.05
"""Growth of a variance by errors of attitudes alone, up to which noise told apart counts for it."""

_ABOUT = 3.0
"""Errors about one axis of three leave so much less in the residuals than those about all."""

_FEW = 2.0
"""Degrees of freedom from which visits tell the noise of a channel."""


def from_known_attitudes(
    output: Array, up: Array, visits: Visits, shaft: tuple[str, ...] | None
) -> Solution:
    """Calibrate a triad by its outputs, shape (n, 3) [output unit], in attitudes that are known.

    There the acceleration along the axes of the block is `up`, shape (n, 3) [g]; the block was
    clamped anew on each shaft.

    Raises
    ------
    InputError
        If an output never changes, or two outputs are one.
    DesignError
        If there are fewer than four attitudes, or their directions lie in a plane.

    Notes
    -----
    y = b + S a is a regression of three channels on the same design A, a row (1, a) each. An
    error of the attitude moves all channels at once, so the covariance of the channels is taken
    from the residuals whole: cov = (A^T A)^-1 (x) R^T R / (n - 4). Such an error does not act
    where the channel points up; what that adds to some parameters is counted. What it takes from
    others, as from the scale factors where all attitudes are along an axis, is taken off where
    repeated visits tell the noise of the channel alone: residuals cannot. How the block sits on
    each of several shafts is taken out of the residuals, and its covariance added.
    """
    n = len(output)
    if n < _FEWEST:
        raise DesignError(f"{n} attitudes; at least {_FEWEST} known ones tell bias and sensitivity")
    matrix = np.column_stack([np.ones(n), up])
    names = ("the bias", *(f"the sensitivity along {axis}" for axis in "xyz"))
    design = design_of(matrix, names, "turn the block about a second axis")
    estimate = design.inverse @ output
    _refuse_one_column(output, estimate[1:].T)
    residual = output - matrix @ estimate
    bias, sensitivity = estimate[0], np.asarray(estimate[1:].T, dtype=np.float64)
    scale = np.linalg.norm(sensitivity, axis=1)
    found = Solution(
        bias=bias,
        sensitivity=sensitivity,
        free=tuple(range(12)),
        covariance=None,
        residual=residual / scale,
        design=design,
    )
    if n == _FEWEST:
        return found
    axes = sensitivity / scale[:, None]
    return _with_uncertainty(found, seats_of(found.residual, axes, up, shaft, design), up, visits)


def _refuse_one_column(output: Array, sensitivity: Array) -> None:
    for i, axis in enumerate(AXES):
        if not np.ptp(output[:, i]):
            raise InputError(f"output {axis} is the same in all attitudes; {_OWN_COLUMN}")
        for j in range(i):
            across = np.linalg.norm(np.cross(sensitivity[i], sensitivity[j]))
            if across <= _ONE * np.linalg.norm(sensitivity[i]) * np.linalg.norm(sensitivity[j]):
                told = f"outputs {AXES[j]} and {axis} tell one and the same axis"
                raise InputError(f"{told}; {_OWN_COLUMN}")


def _with_uncertainty(found: Solution, seats: Seats, up: Array, visits: Visits) -> Solution:
    """Covariance in the order b_x, b_y, b_z, S_xx, S_xy ..., S_zz; degrees of freedom of each."""
    scale, inverse = np.linalg.norm(found.sensitivity, axis=1), found.design.inverse
    left = seats.left * scale / np.sqrt(seats.freedom)
    scatter, told = left.T @ left, zip(found.sensitivity, seats.freedom.tolist(), strict=True)
    channels = [
        _Channel.of(found.design, scatter[i, i], axis, dof, up)
        for i, (axis, dof) in enumerate(told)
    ]
    tilt = float(np.mean([channel.tilt for channel in channels]))
    pairs = list(zip(channels, visits.noise(found.sensitivity), strict=True))
    parts = [channel.uncertainty(noise, visits.share, tilt) for channel, noise in pairs]
    factor, freedom = (np.concatenate(part) for part in zip(*parts, strict=True))
    own = np.kron(scatter, inverse @ inverse.T) * np.outer(factor, factor)
    whole = own + _of_seats(seats, found.sensitivity)
    # which has the order b_x, S_xx, S_xy, S_xz, b_y ...
    if seats.size:
        told_by = np.diagonal(own), np.diagonal(whole - own)
        freedom = welch_satterthwaite(told_by, [freedom, np.full_like(freedom, seats.dof)])
    order = [4 * i for i in range(3)] + [4 * i + 1 + j for i in range(3) for j in range(3)]
    return found._replace(
        covariance=np.asarray(whole[np.ix_(order, order)], dtype=np.float64),
        freedom=freedom[order],
        seats=seats,
        noise_untold=any(
            channel.growth.min() <= _LITTLE and noise.dof < _FEW for channel, noise in pairs
        ),
    )


def _of_seats(seats: Seats, sensitivity: Array) -> Array:
    """Covariance by the turns of the block; a scale factor feels the cosine, as of an attitude."""
    scale = np.repeat(np.linalg.norm(sensitivity, axis=1), 4)
    along = np.column_stack([np.zeros(3), sensitivity])
    cosine = [1.5 * seats.size**4 * np.outer(row, row) for row in along]
    whole = seats.covariance * np.outer(scale, scale)
    for i, part in enumerate(cosine):
        whole[4 * i : 4 * i + 4, 4 * i : 4 * i + 4] += part
    return np.asarray(whole)


class _Channel(NamedTuple):
    """What is left of one channel.

    Attributes
    ----------
    squares : ndarray, shape (4, n)
        Squares of what an output in each attitude does to b, S_x, S_y, S_z.
    dof : float
        Degrees of freedom of the residuals.
    scatter : float
        Their variance [output unit^2].
    axis : ndarray, shape (3,)
        Row of S [output unit per g].
    growth : ndarray, shape (4,)
        Variances if errors of attitudes alone are left, over those if all errors are alike.
    tilt : float
        Variance of these errors about each axis, if they alone are left [rad^2].
    freedom : float
        Degrees of freedom of the residuals then, `dof` at most: these errors are felt by some.
    """

    squares: Array
    dof: float
    scatter: float
    axis: Array
    growth: Array
    tilt: float
    freedom: float

    @classmethod
    def of(cls, design: Design, scatter: float, axis: Array, dof: float, up: Array) -> _Channel:
        """Judge a channel; such an error moves it by 1 - (axis a)^2 of its square.

        The degrees of freedom are Satterthwaite's, tr(M h)^2 / tr(M h M h) with h these shares and
        M what turns errors to residuals, fewer in proportion where turns of the block took some.
        """
        squares, length, whole_dof = design.inverse**2, float(axis @ axis), len(up) - _FEWEST
        felt = 1.0 - (up @ axis) ** 2 / length
        leverage = np.sum(design.basis**2, axis=1)
        whole = float(felt @ (1.0 - leverage))
        core = design.basis.T @ (felt[:, None] * design.basis)
        both = float(felt**2 @ (1.0 - 2.0 * leverage) + np.sum(core**2))
        mean = max(whole / whole_dof, _LEAST)
        growth = np.asarray(squares @ felt / (mean * squares.sum(axis=1)))
        freedom = whole**2 / both * dof / whole_dof if both > _LEAST else dof
        tilt = scatter / (mean * length)
        return cls(squares, dof, scatter, axis, growth, tilt, float(np.clip(freedom, 1.0, dof)))

    def uncertainty(self, noise: Noise, share: Array, tilt: float) -> tuple[Array, Array]:
        """Growth of the uncertainties over those of alike errors, and degrees of freedom.

        The variance of a visit is worth a share in the mean of each attitude, shape (n,); that of
        errors of attitudes, the tilt, is as the mean of all channels tells it [rad^2].

        Notes
        -----
        A growth of less than 1 is not taken where the noise of the channel, which is alike in all
        attitudes, may be all that is left. Where visits tell it, it counts beside what errors of
        attitudes do at most: to first order, and by the cosine of an error, of which 1 - cos has
        the mean square 1.5 tilt^2. All three channels tell the size of these.
        """
        plain = self.scatter * self.squares.sum(axis=1)
        variance = plain * np.maximum(self.growth, 1.0)
        over_dof = 1.0 / np.where(self.growth > 1.0 + _LEAST, self.freedom, self.dof)
        if noise.dof >= _FEW and self.scatter:
            own = noise.variance * (self.squares @ share)
            rounding = noise.rounding * self.squares.sum(axis=1)
            first = _ABOUT * self.growth * plain * tilt / self.tilt
            second = 1.5 * tilt**2 * np.concatenate([[0.0], self.axis**2])
            told = np.maximum(own + rounding + first + second, np.finfo(float).tiny)
            inverse = own / noise.dof + (first + second) / (3.0 * self.freedom)
            tight = self.growth <= _LITTLE
            variance = np.where(tight, told, variance)
            over_dof = np.where(tight, inverse / told, over_dof)
        factor = np.sqrt(variance / plain) if self.scatter else np.ones(4)
        return factor, 1.0 / np.maximum(over_dof, _LEAST)

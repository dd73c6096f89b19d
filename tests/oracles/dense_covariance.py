"""Covariances of the errors of readings as matrices of readings by readings."""

import numpy as np


def matrix_of(covariance):
    """Covariance matrix of all readings, shape (n, n) [g^2]."""
    apart = np.abs(np.subtract.outer(covariance.number, covariance.number))
    one_run = np.equal.outer(covariance.run, covariance.run)
    noise = np.where(one_run, covariance.rho ** apart.astype(float), 0.0)
    noise *= np.outer(covariance.noise, covariance.noise)
    return noise + covariance.shared @ covariance.shared.T


def whitening_matrix(covariance):
    """Inverse of the Cholesky factor of the covariance, shape (n, n) [1/g]."""
    return np.linalg.inv(np.linalg.cholesky(matrix_of(covariance)))

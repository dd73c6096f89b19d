"""Random part of the error: repeatability, drift, fluctuation, equation (3), Allan deviation."""

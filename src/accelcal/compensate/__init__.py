"""From the output of a calibrated accelerometer back to acceleration: equation (1) inverted."""

"""The error model (4): error of a measured acceleration with its band, split by component."""

"""The version, written here and nowhere else."""

__version__ = "0.1.0"

SOFTWARE = f"accelcal {__version__}"
"""What a result says it was made by."""

"""A unit through its recalibrations: drift, scatter from one to the next, jumps."""

"""Three accelerometers in one block, calibrated from the attitudes in which it stood still."""

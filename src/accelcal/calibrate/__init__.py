"""From records to calibrations: the rooms below, wired together."""

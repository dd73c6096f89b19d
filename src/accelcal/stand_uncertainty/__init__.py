"""Budget of the stand: what head, level, chamber and voltmeter do to each coefficient (GUM)."""

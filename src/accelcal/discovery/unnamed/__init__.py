"""What stands in no catalogue: patterns, what comes and goes or wanders, what is taken for it."""

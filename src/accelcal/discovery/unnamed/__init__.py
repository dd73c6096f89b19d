"""What stands in no catalogue: patterns, what comes and goes or wanders, laws of large sizes."""

"""Archives: many tables in, one frame out, and none lost on the way."""

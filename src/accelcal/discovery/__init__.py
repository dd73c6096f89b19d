"""The missing effect: where model and readings disagree, its name, and how sure that is."""

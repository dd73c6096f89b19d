"""Arguments of a call, checked: what does not fit is an InputError of one line, before any work."""

"""Arguments of a call, checked: what does not fit is refused in one line, before any work."""

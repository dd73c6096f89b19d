"""Words: those of tables (`vocabulary`, `head_words`, `signs`), and `wording` for messages."""

"""Words: those of tables (`vocabulary`, `head_words`), and `wording` for messages."""

"""Results as a person reads them: text for a terminal, tables for a notebook."""

"""Files that people write in TOML: data sheets, stands, laboratories and effects of their own."""

"""The shipped scenes: one TOML file each."""

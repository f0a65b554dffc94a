"""TOML files that people write: read, checked by a model, and every fault told in one line that names file, line and key."""

"""The conference file: what a conference consists of."""

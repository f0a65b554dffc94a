"""The link between a site and its hub: how good it is, and what it has room for."""

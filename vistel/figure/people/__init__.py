"""People made from implicit primitives: shape, surface, texture."""

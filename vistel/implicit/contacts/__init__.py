"""Which posed primitives touch, where and how deep."""

"""How free things move: gravity, collisions, friction, rest, and soft bodies."""

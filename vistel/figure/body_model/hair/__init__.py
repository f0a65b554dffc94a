"""Hair of people of the body model: strands along guide curves, drawn as textured cards over a cap."""

"""Fields: evaluated, traced, meshed, deformed."""

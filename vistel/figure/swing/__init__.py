"""What hangs loose moves: long hair, skirts, the fronts of an open jacket (Singh §7.3 names it as what is missing)."""

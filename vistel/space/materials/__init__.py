"""One step of dents and bonds: pressing, recovery, sticking and tearing."""

"""The ports of simulated devices: what they have in common, pseudo-terminals, and lines within a process."""

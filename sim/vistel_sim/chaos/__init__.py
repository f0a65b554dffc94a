"""Whole conferences under faults: which faults there are, at random times, and whether what must hold did hold."""

"""The link to the hub, measured: once before a meeting, and as long as a process runs."""

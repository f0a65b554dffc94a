"""For tests of programs and devices of others. The fixtures of pytest are in `vistel_sim.testing`, since they start simulators."""

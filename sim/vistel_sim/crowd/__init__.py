"""Many participants without devices: what their sites would send and receive, from few processes."""

from vistel_sim.crowd.conference import crowd_conference, talkers

__all__ = ("crowd_conference", "talkers")

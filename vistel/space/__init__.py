"""The virtual room: things, people, contacts, grasps, dynamics, and the deterministic step of the world."""

"""What is shown at an instant: from messages to postures and poses, with playout."""

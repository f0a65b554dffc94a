"""What the host of a conference does to it from the console."""

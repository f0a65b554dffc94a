"""What was recorded elsewhere, as people of a conference and messages of a log."""

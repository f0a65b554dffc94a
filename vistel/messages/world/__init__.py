"""The room of the world as messages: encoded, decoded, and run again from a log."""

"""The state of the world as messages: encoded, decoded, and computed again from a log."""

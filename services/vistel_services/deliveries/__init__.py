"""What crosses the bus in parts and is kept on this machine: avatars."""

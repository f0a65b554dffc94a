"""What of a room is kept on disk, and read again after a crash: snapshots of its world and a journal of the steps between them."""

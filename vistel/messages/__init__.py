"""Between the messages of the wire and what the library computes with: neither knows the other."""

"""`vistel sim crowd`: many people of few processes, and what they cost."""

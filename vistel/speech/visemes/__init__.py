"""From the sound of a voice to the visemes of its mouth."""

"""Makes the net that reads visemes from the sound of a voice, and judges it."""

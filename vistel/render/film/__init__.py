"""Films of a log: its pictures one by one, their sound, H.264 and USD."""

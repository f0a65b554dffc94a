"""Text over the picture: names, captions, subtitles, delays."""

"""OpenGL: a context, shader programs, textures, and the canvas that is drawn on."""

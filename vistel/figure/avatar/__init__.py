"""An avatar as a value: meshes, texture and patches; its checks, levels of detail and texture registration."""

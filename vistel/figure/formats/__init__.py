"""Avatars in files: npz, parcels, USD, glTF, VRM, OBJ."""

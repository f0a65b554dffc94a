"""Contacts of bodies: near primitives, shared patches, pressure and force."""

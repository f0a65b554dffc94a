"""Sticky notes: small things with text on them, which stick where they are let go of."""

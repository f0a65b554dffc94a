"""Recordings of headsets, as what the page of a guest with one would have sent."""

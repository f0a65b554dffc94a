"""The studios, pages on this machine: an avatar looked at, wrinkles drawn on it, devices calibrated. Python computes everything."""

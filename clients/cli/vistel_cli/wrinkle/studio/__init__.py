"""The wrinkle studio: a page on this machine on which wrinkles are drawn and seen on a figure; all mathematics is Python's."""

"""Pages for browsers, served by services and commands: at which address, to whom."""

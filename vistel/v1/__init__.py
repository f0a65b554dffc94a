"""Generated from proto/vistel/v1 by `make proto`; do not edit."""

"""`vistel testing`: the test kit on the command line."""

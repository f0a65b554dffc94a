"""`vistel examples`: files to try the commands of the documentation with."""

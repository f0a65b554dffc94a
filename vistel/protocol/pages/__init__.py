"""What the console's page for guests says of them: records that the page makes, the gateway checks, and drivers read."""

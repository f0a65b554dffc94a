"""The renderer's desktop windows: opened, shown on, listened to, and connected to the bus."""

"""From where a picture is taken, and on which screens it is shown."""

"""Distils MakeHuman's free body data into the one file of `vistel.figure.body_model`."""

"""The motion codec: what the numbers of a Motion are, how they are foreseen, and how they become bytes.

`layout` says what is sent and in which steps, `model` how the numbers are foreseen and how likely what is left of them
is, `kernels` does it, `lists` reads what older versions sent. docs/reference/motion-stream.md tells it all for whoever
writes another decoder.
"""

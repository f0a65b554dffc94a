"""The motion codec: what the numbers of a Motion are, how they are predicted, and how they are encoded.

`layout` lists the numbers and their steps, `model` predicts them and the sizes of their residuals, `codec_kernels` codes
frames, `lists` reads messages of older versions. docs/reference/motion-stream.md describes the bytes.
"""

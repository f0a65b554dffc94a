"""Recognisers of others, for those who have a model: Vosk, sherpa-onnx, Whisper, Julius. None is loaded before it is used."""

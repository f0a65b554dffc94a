"""Speech engines of others, for users who have a model: Vosk, sherpa-onnx, Whisper, Julius. None is loaded before it is used."""

"""How the acoustic model of vistel.speech is made: texts, voices, rooms and noises, training, figures."""

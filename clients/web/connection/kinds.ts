// The first byte of what comes as bytes.
export const VOICES = 2; // vistel/audio/forwarded_voices.py
export const SCREENS = 3; // vistel/session/screens.py

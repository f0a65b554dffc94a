// Gestures, in the order in which records number them (PointerFrame.Gesture), each with its key.
export const GESTURES = [
  { name: "Wave", key: "W" },
  { name: "Nod", key: "N" },
  { name: "Shake head", key: "S" },
  { name: "Point", key: "P" },
  { name: "Thumb up", key: "T" },
  { name: "Clap", key: "C" },
];

export class Gestures {
  newest = { gesture: 0, number: 0 };

  /** Begin a gesture, 1 being the first. */
  make(gesture: number): void {
    this.newest = { gesture, number: this.newest.number + 1 };
  }

  has(key: string): boolean {
    return this.of(key) > 0;
  }

  /** Whether a key began one. */
  press(key: string): boolean {
    const gesture = this.of(key);
    if (gesture > 0) this.make(gesture);
    return gesture > 0;
  }

  private of(key: string): number {
    return GESTURES.findIndex((g) => g.key === key.toUpperCase()) + 1;
  }
}

// Gestures, in the order in which records number them (PointerFrame.Gesture), each with its key; their names are in words.ts.
export const GESTURES = [
  { name: "wave", key: "W" },
  { name: "nod", key: "N" },
  { name: "shake", key: "S" },
  { name: "point", key: "P" },
  { name: "thumb", key: "T" },
  { name: "clap", key: "C" },
] as const;

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

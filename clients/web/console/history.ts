// Figures of the last ten minutes, for sparklines.
import type { Numbers } from "./wire";

const KEPT = 600; // one a second

export class History {
  private readonly rows = new Map<string, number[]>();

  add(numbers: Numbers): void {
    for (const s of numbers.sites) {
      this.push(`${s.name} pictures`, s.pictures_per_s);
      this.push(`${s.name} delay`, s.delay_ms);
    }
    for (const p of numbers.people) {
      this.push(`${p.name} motions`, p.motions_per_s);
      this.push(`${p.name} age`, p.age_ms);
    }
  }

  of(key: string): readonly number[] {
    return this.rows.get(key) ?? [];
  }

  private push(key: string, value: number | undefined): void {
    const row = this.rows.get(key) ?? [];
    this.rows.set(key, row);
    row.push(value ?? 0);
    if (row.length > KEPT) row.shift();
  }
}

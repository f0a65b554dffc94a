// What can be done to wrinkles; each is one step of the history.

import { add, freshName, mix, owned, refit, sampled, scale, sub, type OnCurve } from "./geometry";
import type { State } from "./state";
import type { Branch, Form, Layer, Shape, Vec, Wrinkle, WrinkleSet } from "./types";

const PROFILES: Record<"cloth" | "skin", Layer[]> = {
  cloth: [
    { intensity: 1, offset: 0, thickness: 1, lean: 0.2 },
    { intensity: -0.4, offset: -1, thickness: 0.8, lean: 0 },
  ],
  skin: [
    { intensity: -1, offset: 0, thickness: 0.6, lean: 0 },
    { intensity: 0.45, offset: 0, thickness: 1.6, lean: 0 },
  ],
};
const USUAL = { cloth: { thickness: 0.014, intensity: 0.008 }, skin: { thickness: 0.003, intensity: 0.0011 } };

/** Changes points of the selected wrinkle on the plane: `move` gets all of them and may move them and change the shape. */
export function reshape(
  state: State,
  label: string,
  move: (points: Vec[][], shape: Shape, w: Wrinkle) => void,
  merge = "",
): void {
  const n = state.selection.wrinkle;
  const points = state.pointsOf(n);
  const shape = state.shape;
  if (!shape || points.length === 0) return;
  const plane = state.plane;
  state.edit(
    label,
    (form) => {
      const w = form.sets[state.selection.set]?.wrinkles[n];
      if (!w) return;
      const own = owned(form, w, shape, state.opened.shapes);
      move(points, own, w);
      refit(w, own, plane, points);
    },
    merge,
  );
}

/** Changes attributes of the selected wrinkle that are not its points. */
export function adjust(state: State, label: string, change: (w: Wrinkle) => void, merge = ""): void {
  const { set, wrinkle } = state.selection;
  state.edit(
    label,
    (form) => {
      const w = form.sets[set]?.wrinkles[wrinkle];
      if (w) change(w);
    },
    merge,
  );
}

export function adjustSet(state: State, label: string, change: (s: WrinkleSet) => void, merge = ""): void {
  const { set } = state.selection;
  state.edit(
    label,
    (form) => {
      const s = form.sets[set];
      if (s) change(s);
    },
    merge,
  );
}

/** Moves the whole wrinkle on the plane [m]; its shape stays. */
export function shift(state: State, by: Vec, merge = ""): void {
  const plane = state.plane;
  adjust(state, "Move wrinkle", (w) => {
    w.at = [w.at[0] + by[0] / plane[0], w.at[1] + by[1] / plane[1]];
  }, merge); // prettier-ignore
}

/** A new wrinkle of a curve through places on the plane. */
export function drawCurve(state: State, places: Vec[]): void {
  const set = state.set;
  if (!set || places.length < 2) return;
  const plane = state.plane;
  const at = state.selection.set;
  const usual = USUAL[set.material];
  state.edit("Draw curve", (form) => {
    const shape: Shape = {
      name: freshName(`${set.name}_curve`, [...form.shapes.map((s) => s.name), ...Object.keys(state.opened.shapes)]),
      about: "Drawn in the studio",
      material: set.material,
      profile: structuredClone(PROFILES[set.material]),
      branches: [branchOf(places.length)],
    };
    const w: Wrinkle = {
      shape: shape.name, at: [0, 0], size: 1, ...usual, turn: 0, mirrored: false, wrinkledness: 0, seed: 0,
    }; // prettier-ignore
    refit(w, shape, plane, [places]);
    form.shapes.push(shape);
    form.sets[at]?.wrinkles.push(w);
  });
  state.select({ wrinkle: set.wrinkles.length - 1, branch: 0, point: places.length - 1 });
}

/** A new branch of the selected wrinkle through places on the plane, the first of which lies on one of its curves. */
export function drawBranch(state: State, places: Vec[]): void {
  if (places.length < 2) return;
  reshape(state, "Draw branch", (points, shape) => {
    shape.branches.push(branchOf(places.length));
    points.push(places);
  });
  state.select({ branch: (state.shape?.branches.length ?? 1) - 1, point: places.length - 1 });
}

function branchOf(count: number): Branch {
  const points = Array.from({ length: count }, () => ({ at: [0, 0] as Vec, intensity: 1, thickness: 1 }));
  return { points, start: "taper", end: "vanish", cap: 2 };
}

/** A built-in shape in the middle of the plane, or at a place. */
export function addShape(state: State, name: string): void {
  const set = state.set;
  const shape = state.opened.shapes[name];
  if (!set || !shape) return;
  const size = shape.material === "cloth" ? 0.07 : 0.025;
  const at = state.selection.set;
  state.edit(`Add ${name}`, (form) => {
    form.sets[at]?.wrinkles.push({
      shape: name, at: [0.5, 0.5], size: Math.min(size, 0.4 * Math.min(...state.plane)), ...USUAL[set.material], turn: 0,
      mirrored: false, wrinkledness: 0.2, seed: set.wrinkles.length + 1,
    });
  }); // prettier-ignore
  state.select({ wrinkle: set.wrinkles.length - 1 });
}

/** A control point more, where the curve was clicked. */
export function insertPoint(state: State, branch: number, place: OnCurve): void {
  reshape(state, "Add point", (points, shape) => {
    const of = shape.branches[branch] as Branch;
    const a = of.points[place.span];
    const b = of.points[place.span + 1];
    if (!a || !b) return;
    const between = { at: [0, 0] as Vec, intensity: mix(a.intensity, b.intensity, place.t), thickness: mix(a.thickness, b.thickness, place.t) };
    of.points.splice(place.span + 1, 0, between);
    points[branch]?.splice(place.span + 1, 0, place.at);
  });
  state.select({ branch, point: place.span + 1 });
}

/** Deletes the selected point; a branch of one point, or with none selected, goes whole; a wrinkle without branches too. */
export function remove(state: State): void {
  const { set, wrinkle, branch, point } = state.selection;
  if (wrinkle < 0) return;
  const of = state.shape?.branches[branch];
  if (of && point >= 0 && of.points.length > 2) {
    reshape(state, "Delete point", (points, shape) => {
      shape.branches[branch]?.points.splice(point, 1);
      points[branch]?.splice(point, 1);
    });
    state.select({ point: Math.min(point, of.points.length - 1) });
  } else if (of && (state.shape?.branches.length ?? 0) > 1) {
    reshape(state, "Delete branch", (points, shape) => {
      shape.branches.splice(branch, 1);
      points.splice(branch, 1);
    });
    state.select({ wrinkle });
  } else {
    const alone = (state.set?.wrinkles.length ?? 0) === 1 && (state.set?.pull.length ?? 0) === 0 && !state.set?.mouth;
    if (alone) {
      removeSet(state);
      return;
    }
    state.edit("Delete wrinkle", (form) => form.sets[set]?.wrinkles.splice(wrinkle, 1));
    state.select({ wrinkle: -1 });
  }
}

export function duplicate(state: State): void {
  const { set } = state.selection;
  const w = state.wrinkle;
  if (!w) return;
  state.edit("Duplicate wrinkle", (form) => {
    const copy = structuredClone(w);
    copy.at = [copy.at[0] + 0.03, copy.at[1] + 0.02];
    copy.seed += 1;
    form.sets[set]?.wrinkles.push(copy);
  });
  state.select({ wrinkle: (state.set?.wrinkles.length ?? 1) - 1 });
}

/** Turns the selected wrinkle [degrees] and makes it larger about its middle. */
export function turn(state: State, degrees: number, factor = 1): void {
  adjust(state, factor === 1 ? "Turn wrinkle" : "Scale wrinkle", (w) => {
    w.turn = Math.round((w.turn + degrees) * 100) / 100;
    w.size = typeof w.size === "number" ? w.size * factor : [w.size[0] * factor, w.size[1] * factor];
  });
}

/** Moves the selected point, or the whole wrinkle where none is, [m]. */
export function nudge(state: State, by: Vec): void {
  const { branch, point } = state.selection;
  const merge = `nudge ${branch} ${point}`;
  if (point < 0) shift(state, by, merge);
  else
    reshape(state, "Move point", (points) => {
      const of = points[branch];
      if (of?.[point]) of[point] = add(of[point] as Vec, by);
    }, merge); // prettier-ignore
}

export function addSet(state: State, region: string): void {
  const of = state.opened.regions.find((r) => r.name === region);
  if (!of) return;
  const like = state.form.sets.find((s) => s.region === region);
  const names = state.form.sets.map((s) => s.name);
  const material = like?.material ?? "cloth";
  const name = names.includes(`${region}_new`) ? freshName(`${region}_new`, names) : `${region}_new`;
  const drive = like
    ? structuredClone(like.drive)
    : { joint: "neck", axis: null, action: null, curve: { knots: [[0, 0], [60, 1]] as Vec[], form: "smooth" as const } };
  const shape = material === "cloth" ? "hip_crease" : "forehead_lines";
  const plane = Object.values(of.planes)[0] ?? [0.3, 0.5];
  state.edit("New set", (form: Form) => {
    form.sets.push({
      name, region, material, drive, pull: [], lift: material === "cloth" ? 1 : 0, memory: 0.2, mouth: false,
      wrinkles: [{
        shape, at: [0.5, 0.5], size: 0.3 * Math.min(...plane), ...USUAL[material], turn: 0, mirrored: false, wrinkledness: 0, seed: 0,
      }],
    });
  }); // prettier-ignore
  state.select({ set: state.form.sets.length - 1, wrinkle: 0 });
}

export function removeSet(state: State): void {
  const { set } = state.selection;
  if (state.form.sets.length <= 1) return;
  state.edit("Delete set", (form) => form.sets.splice(set, 1));
  state.selection.set = -1;
  state.select({ set: Math.min(set, state.form.sets.length - 1) });
}

/** Where an end lies if it is drawn onto another curve of its wrinkle; itself where none is near. reach: [m]. */
export function snapped(points: Vec[][], branch: number, at: Vec, reach: number): Vec {
  let best: Vec = at;
  let least = reach;
  points.forEach((of, b) => {
    if (b === branch) return;
    for (const place of sampled(of)) {
      const away = Math.hypot(...sub(place.at, at));
      if (away < least) {
        least = away;
        best = place.at;
      }
    }
  });
  return scale(best, 1);
}

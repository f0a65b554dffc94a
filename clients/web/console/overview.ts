// From where the whole room is seen: as the renderers' overview (vistel/render/view/camera.py), unless a board or a panel would then be
// behind the camera, turned away or cut off.
export type Place = readonly [number, number, number];
export interface View {
  from: Place;
  to: Place;
}
/** A head, and which way it looks. */
export interface Head {
  at: Place;
  looks: Place;
}
/** A rectangle on which something is read: its corners, and its normal. */
export interface Front {
  corners: Place[];
  normal: Place;
}

export const FIELD = 45; // of the picture, upright [degrees]
export const ROUND: View = { from: [0.62, 1.66, 2.3], to: [0, 0.82, 0.05] };
const WALL_M = 3.9; // the walls are at 4.05
const FARTHEST = 1.7; // times as far as ROUND, to have everything in the picture
const TURNS = 24; // directions that are tried
const NEAR_M = 0.7; // nothing that is looked at is nearer
const EDGE = 0.94; // of the picture's half width and height: nothing is cut off
const READ = 0.35; // cosine to its normal from which a rectangle is read
// What a view is worth: that each board is read, that each person is in the picture, and that their face is; and what it costs to turn
// away from ROUND (by half a turn) and to stand farther.
const WORTH = { front: 10, person: 4, face: 1.5, turn: 2, farther: 2 };

/** aspect: the picture's width by its height. */
export function overview(people: readonly Head[], fronts: readonly Front[], aspect: number, least = 1): View {
  if (!fronts.length) return moved(ROUND, 0, least, ROUND.to);
  let best = moved(ROUND, 0, least, ROUND.to);
  let most = -Infinity;
  const middle = mean([...people.map((p) => p.at), ...fronts.flatMap((f) => f.corners)]);
  for (const share of [0, 0.3, 0.6]) {
    const to: Place = [mix(ROUND.to[0], middle[0], share), ROUND.to[1], mix(ROUND.to[2], middle[2], share)];
    for (let times = least; times <= FARTHEST + 1e-9; times += 0.1) {
      for (let n = 0; n < TURNS; n++) {
        const turn = n <= TURNS / 2 ? n / TURNS : n / TURNS - 1; // of a whole one
        const view = moved(ROUND, 2 * Math.PI * turn, times, to);
        const worth = seen(view, people, fronts, aspect) - WORTH.turn * 2 * Math.abs(turn) - WORTH.farther * (times - least);
        if (worth > most + 1e-9) [most, best] = [worth, view];
      }
    }
  }
  return best;
}

function seen(view: View, people: readonly Head[], fronts: readonly Front[], aspect: number): number {
  const all = [...people.map((p) => p.at), ...fronts.flatMap((f) => f.corners)];
  const inRoom = Math.abs(view.from[0]) <= WALL_M && Math.abs(view.from[2]) <= WALL_M;
  if (!inRoom || all.some((place) => length(less(place, view.from)) < NEAR_M)) return -Infinity;
  const inside = insideOf(view, aspect);
  let worth = 0;
  for (const { corners, normal } of fronts) {
    const towards = less(view.from, mean(corners));
    if (corners.every(inside) && dot(normal, towards) > READ * length(towards)) worth += WORTH.front;
  }
  for (const { at, looks } of people) {
    const towards = less(view.from, at);
    if (inside(at)) worth += WORTH.person + WORTH.face * Math.max(0, dot(looks, towards) / length(towards));
  }
  return worth;
}

/** Whether a place is in the picture. */
function insideOf({ from, to }: View, aspect: number): (place: Place) => boolean {
  const ahead = unit(less(to, from));
  const right = unit([-ahead[2], 0, ahead[0]]);
  const up: Place = [right[1] * ahead[2] - right[2] * ahead[1], right[2] * ahead[0] - right[0] * ahead[2], right[0] * ahead[1] - right[1] * ahead[0]];
  const half = EDGE * Math.tan((FIELD * Math.PI) / 360);
  return (place) => {
    const away = less(place, from);
    const deep = dot(away, ahead);
    return deep > 0 && Math.abs(dot(away, up)) <= half * deep && Math.abs(dot(away, right)) <= half * aspect * deep;
  };
}

/** The view turned about `to` [rad], so many times as far. */
function moved(view: View, turn: number, times: number, to: Place): View {
  const [x, y, z] = less(view.from, view.to);
  const [cos, sin] = [Math.cos(turn), Math.sin(turn)];
  return { from: [to[0] + times * (cos * x + sin * z), to[1] + times * y, to[2] + times * (cos * z - sin * x)], to };
}

function mean(places: readonly Place[]): Place {
  const [x, y, z] = places.reduce<Place>((sum, p) => [sum[0] + p[0], sum[1] + p[1], sum[2] + p[2]], [0, 0, 0]);
  return [x / places.length, y / places.length, z / places.length];
}

const mix = (a: number, b: number, share: number) => a + share * (b - a);
const less = (a: Place, b: Place): Place => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const dot = (a: Place, b: Place) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const length = (a: Place) => Math.sqrt(dot(a, a));
const unit = (a: Place): Place => [a[0] / length(a), a[1] / length(a), a[2] / length(a)];

// console/language.ts
var STORED = "vistel-language";
var language = localStorage.getItem(STORED) ?? (navigator.language.startsWith("ja") ? "ja" : "en");
document.documentElement.lang = language;
function speaksJapanese() {
  return language === "ja";
}
function switchLanguage() {
  language = language === "ja" ? "en" : "ja";
  localStorage.setItem(STORED, language);
  document.documentElement.lang = language;
}
function phrases(english, japanese) {
  return (key, ...given) => given.reduce((said2, each, n) => said2.replace(`{${n}}`, () => String(each)), (language === "ja" ? japanese : english)[key]);
}

// studio/frame.ts
var NAMES = phrases(
  { avatar: "Avatar", wrinkles: "Wrinkles", calibration: "Calibration", room: "Room", studios: "Studios", language: "日本語" },
  { avatar: "アバター", wrinkles: "しわ", calibration: "校正", room: "部屋", studios: "スタジオ", language: "English" }
);
async function frame(here) {
  document.documentElement.dataset.begun = "true";
  const other = document.getElementById("language");
  other.textContent = NAMES("language");
  other.onclick = () => (switchLanguage(), location.reload());
  const nav = document.getElementById("studios");
  nav.setAttribute("aria-label", NAMES("studios"));
  const answer = await fetch("../studios.json");
  const { studios, console } = await answer.json();
  nav.replaceChildren(...studios.map((studio2) => link(`../${studio2}/`, NAMES(studio2), studio2 === here)));
  if (console) nav.append(link(console, NAMES("room"), false));
}
function link(to, text2, here) {
  const a = document.createElement("a");
  [a.href, a.textContent] = [to, text2];
  if (here) a.setAttribute("aria-current", "page");
  return a;
}

// studio/said.ts
var JAPANESE = {
  // Moves and hands of a calibration.
  "Waiting for the device.": "機器を待っています。",
  "Computing.": "計算しています。",
  "Keep still.": "そのまま動かないでください。",
  "Done. Thank you.": "終わりました。ありがとうございました。",
  "Stand straight, face the table, arms out to the sides, palms down. Hold still.": "まっすぐ立ち、テーブルの方を向き、腕を横に伸ばして手のひらを下に。そのまま止まります。",
  "Keep the chest still. Nod, shake your head, tilt it to both shoulders; slowly, as far as it goes.": "胸を動かさずに、うなずき、首を横に振り、左右の肩へ傾けます。ゆっくり、できるだけ大きく。",
  "Keep elbows and wrists straight. Draw large circles with both arms, ahead, to the sides and up.": "肘と手首を伸ばしたまま、両腕で前、横、上に大きな円を描きます。",
  "Upper arms still at your sides, wrists straight. Bend and stretch both elbows, turning the palms.": "上腕を体の脇に付け、手首を伸ばしたまま、両肘を曲げ伸ばしし、手のひらを返します。",
  "Hold both forearms still. Circle with your hands in the wrists, and turn nothing else.": "両方の前腕を動かさずに、手首だけで手を回します。",
  "Legs still. Bow, lean to both sides and turn to both sides with the chest.": "脚を動かさずに、お辞儀をし、左右に傾け、胸を左右に回します。",
  "Hold the hand flat, fingers together, thumb along the index finger.": "手を平らにし、指をそろえ、親指を人差し指に沿わせます。",
  "Make a tight fist, thumb over the fingers.": "親指を外にして、拳を固く握ります。",
  "Hold the hand flat and spread fingers and thumb as far as they go.": "手を平らにし、指と親指をできるだけ広げます。",
  "Touch the tip of the thumb with the tip of the index finger, other fingers relaxed.": "親指の先と人差し指の先を合わせ、ほかの指は力を抜きます。",
  "Look ahead, mouth closed, face relaxed.": "口を閉じ、顔の力を抜いて、前を見ます。",
  "Keep the head still, and look at each point when asked.": "頭を動かさずに、言われた点を順に見ます。",
  open: "開いた手",
  fist: "拳",
  spread: "広げた手",
  pinch: "つまむ",
  "t pose": "Tの姿勢",
  head: "頭",
  arms: "腕",
  elbows: "肘",
  wrists: "手首",
  spine: "背骨",
  "size of upper arm": "上腕の長さ (左と右)",
  "size of forearm": "前腕の長さ (左と右)",
  "size of shoulders": "肩幅",
  "size of spine": "背骨の長さ",
  // Sliders.
  "Left elbow": "左の肘",
  "Right elbow": "右の肘",
  "Left arm up": "左腕を上げる",
  "Right arm up": "右腕を上げる",
  "Arms forward": "腕を前へ",
  Fists: "拳",
  "Knees and hips": "膝と腰",
  "Back bent": "背中を曲げる",
  "Head bowed": "頭を下げる",
  Arms: "腕",
  Body: "体",
  Face: "顔",
  "Inner brows up": "眉の内側を上げる",
  "Outer brows up": "眉の外側を上げる",
  Frown: "しかめる",
  Squint: "目を細める",
  "Nose wrinkled": "鼻にしわ",
  Smile: "笑う",
  "Jaw dropped": "口を開ける",
  // The page of wrinkles.
  "Opening …": "開いています…",
  Wrinkles: "しわ",
  Photograph: "写真",
  "Lay the texture right with pins": "ピンでテクスチャーを合わせる",
  Undo: "元に戻す",
  Redo: "やり直す",
  Keys: "キー",
  "Keys (?)": "キー (?)",
  Save: "保存",
  "Save (Ctrl+S)": "保存 (Ctrl+S)",
  Sets: "セット",
  "New set": "新しいセット",
  "New set …": "新しいセット…",
  Texture: "テクスチャー",
  Island: "島",
  "A picture of your own for this island": "この島に自分の写真を使う",
  "Photograph …": "写真…",
  "The texture as it lay without pins": "ピンのない元のテクスチャー",
  "Clear pins": "ピンを消す",
  "Select and drag (V)": "選んで動かす (V)",
  Select: "選択",
  "Draw a curve (P)": "曲線を描く (P)",
  Draw: "描く",
  "Draw a branch (B)": "枝を描く (B)",
  Branch: "枝",
  "Add a shape": "形を加える",
  "Add shape …": "形を加える…",
  "Show the whole plane (F)": "全体を表示 (F)",
  Fit: "全体",
  "Texture of the region with its wrinkles": "しわの付いた部分のテクスチャー",
  "Picture with the net of an island": "島の網を重ねた写真",
  "Driving curve": "駆動曲線",
  Figure: "人物",
  "Show the selected set wholly, whatever the figure does (H)": "姿勢に関わらず、選んだセットを最大で表示 (H)",
  "Full strength": "最大",
  "Bend to where the set is strongest (G)": "セットが最も強くなるまで曲げる (G)",
  "Bend to it": "そこまで曲げる",
  "Without colour": "色なし",
  Grey: "色なし",
  "The whole figure (double-click)": "全身 (ダブルクリック)",
  Whole: "全身",
  "The figure; drag to turn it": "人物。ドラッグで回します",
  Bend: "曲げる",
  Reset: "戻す",
  "Double-click: as at first": "ダブルクリックで最初に戻す",
  Left: "左",
  Right: "右",
  "No set": "セットなし",
  Sleeve: "袖",
  "Trouser leg": "ズボンの脚",
  Trunk: "胴",
  Skirt: "スカート",
  Wrinkle: "しわ",
  Set: "セット",
  Curve: "曲線",
  Point: "点",
  Duplicate: "複製",
  Delete: "削除",
  Name: "名前",
  Material: "素材",
  Cloth: "布",
  Skin: "肌",
  Lift: "盛り上がり",
  Memory: "形の記憶",
  Intensity: "強さ",
  Width: "幅",
  Start: "始まり",
  End: "終わり",
  Cap: "端",
  "Tapers off": "細くなる",
  Vanishes: "消える",
  Round: "丸い",
  Radius: "半径",
  Height: "高さ",
  Size: "大きさ",
  Turn: "回転",
  Wrinkledness: "しわの多さ",
  Seed: "乱数の種",
  Mirrored: "鏡像",
  "Driven by": "動かすもの",
  "Between knots": "節の間",
  smooth: "なめらか",
  straight: "直線",
  Rotation: "回転",
  "Click a curve to edit it, or draw one with P.": "曲線をクリックして編集するか、Pで描きます。",
  "Drag a point, or press ? for keys": "点をドラッグします。? でキーの一覧",
  "Click points of the curve; Enter or double-click ends it, Esc forgets it": "曲線の点をクリックします。Enterかダブルクリックで終わり、Escで取り消し",
  "Click on a curve, then points away from it; Enter ends it": "曲線をクリックし、そこから点を打ちます。Enterで終わり",
  "Unfolding the texture …": "テクスチャーを広げています…",
  "Click the net to set a pin; drag pins to where they belong on the picture": "網をクリックしてピンを置き、写真の正しい所へドラッグします",
  Working: "作業中",
  "laying cloth on sleeves and legs": "袖と脚に布を掛けています",
  "preparing the figure": "人物を用意しています",
  "looking where the texture lies": "テクスチャーの位置を調べています",
  "laying the photograph": "写真を貼っています",
  "laying the texture": "テクスチャーを貼っています",
  // What was done, as undone and redone.
  "Add knot": "節を加える",
  "Delete knot": "節を削除",
  "Move wrinkle": "しわを動かす",
  "Draw curve": "曲線を描く",
  "Draw branch": "枝を描く",
  "Add point": "点を加える",
  "Delete point": "点を削除",
  "Delete branch": "枝を削除",
  "Delete wrinkle": "しわを削除",
  "Duplicate wrinkle": "しわを複製",
  "Turn wrinkle": "しわを回す",
  "Scale wrinkle": "しわを拡大縮小",
  "Move point": "点を動かす",
  "Delete set": "セットを削除",
  "Rename set": "セットの名前",
  "Delete pin": "ピンを削除",
  "Set pin": "ピンを置く",
  "Move pin": "ピンを動かす",
  Ends: "端",
  Mirror: "鏡像",
  Driver: "動かすもの",
  "Form of curve": "曲線の形",
  Axis: "軸",
  "Not saved": "保存できませんでした",
  Close: "閉じる",
  "Select, draw a curve, draw a branch from a curve": "選択、曲線を描く、曲線から枝を描く",
  "End what is drawn, or forget it": "描いたものを終える、取り消す",
  "Double-click on a curve": "曲線をダブルクリック",
  "Add a control point": "制御点を加える",
  "Square handle": "四角い取っ手",
  "Width at the selected point": "選んだ点の幅",
  "Delete the point, the branch, the wrinkle": "点、枝、しわを削除",
  "Arrows, with Shift": "矢印キー、Shiftと共に",
  "Move the point or wrinkle by 1 mm, 5 mm": "点かしわを1 mm、5 mm動かす",
  "Next point of the curve": "曲線の次の点",
  "Turn and scale the wrinkle": "しわを回す、拡大縮小する",
  "Duplicate the wrinkle": "しわを複製",
  "Full strength; bend the figure to the set": "最大で表示、セットまで曲げる",
  "Show the whole texture": "テクスチャー全体を表示",
  "Wheel, right drag": "ホイール、右ドラッグ",
  "Zoom; move the view": "拡大縮小、表示の移動",
  "Undo, redo": "元に戻す、やり直す",
  "Click the net to set a pin, drag it to where that place of the body is on the picture, Del deletes it": "網をクリックしてピンを置き、写真のその体の場所へドラッグ。Delで削除",
  "Drag knots, double-click adds one, Del deletes it": "節をドラッグ、ダブルクリックで加え、Delで削除"
};
function said(text2) {
  return speaksJapanese() && JAPANESE[text2.trim()] || text2;
}
function sayPage(root) {
  if (!speaksJapanese()) return;
  const texts = document.createTreeWalker(root, NodeFilter.SHOW_TEXT);
  for (let node = texts.nextNode(); node; node = texts.nextNode()) {
    const text2 = node.nodeValue ?? "";
    if (said(text2) !== text2) node.nodeValue = said(text2);
  }
  for (const name of ["title", "aria-label"])
    for (const element of root.querySelectorAll(`[${name}]`)) element.setAttribute(name, said(element.getAttribute(name)));
}

// studio/wrinkles/api.ts
var Refusal = class extends Error {
  constructor(text2, status) {
    super(text2);
    this.status = status;
  }
  status;
};
var page = Math.random().toString(36).slice(2);
async function open() {
  return unpacked(await post("api/open", { page }));
}
async function update(session, asked) {
  return unpacked(await post("api/update", { ...asked, session, page }));
}
async function save(session, form, revision) {
  return (await post("api/save", { session, form, revision, page })).json();
}
async function doing() {
  const answer = await fetch(`api/doing?page=${page}`);
  return answer.ok ? (await answer.json()).doing : "";
}
function albedoAddress(session, version) {
  return `api/albedo?session=${encodeURIComponent(session)}&version=${version}`;
}
async function post(path2, body) {
  return sent(path2, JSON.stringify(body), "application/json");
}
async function sent(path2, body, type) {
  let answer;
  try {
    answer = await fetch(path2, { method: "POST", headers: { "Content-Type": type }, body });
  } catch {
    throw new Refusal("The studio does not answer; is it still running?", 0);
  }
  if (!answer.ok) {
    const said2 = await answer.json().catch(() => ({}));
    throw new Refusal(said2.error ?? `the studio said ${answer.status}`, answer.status);
  }
  return answer;
}
async function picture(session, island, base, file) {
  const address = `api/picture?session=${encodeURIComponent(session)}&island=${island}&base=${base}&page=${page}`;
  return (await sent(address, file, "application/octet-stream")).json();
}
var KINDS = { f4: Float32Array, u4: Uint32Array, u1: Uint8Array };
async function unpacked(answer) {
  const data = await answer.arrayBuffer();
  const length = new DataView(data).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
  const arrays = {};
  let at = 4 + length;
  for (const { name, kind, shape } of head.arrays) {
    const count = shape.reduce((a, b) => a * b, 1);
    const array = new KINDS[kind](data, at, count);
    arrays[name] = array;
    at += Math.ceil(array.byteLength / 4) * 4;
  }
  return { head, arrays };
}

// studio/wrinkles/dom.ts
function make(tag, attributes = {}, ...children) {
  const out = document.createElement(tag);
  for (const [key, value] of Object.entries(attributes)) {
    if (typeof value === "function") out.addEventListener(key, value);
    else if (typeof value === "boolean") out.toggleAttribute(key, value);
    else out.setAttribute(key, key === "title" || key === "aria-label" ? said(String(value)) : String(value));
  }
  out.append(...children.map((child) => typeof child === "string" ? said(child) : child));
  return out;
}
function byId(id) {
  const found = document.getElementById(id);
  if (!found) throw new Error(`the page lacks #${id}`);
  return found;
}
function fitted(canvas) {
  const ratio = window.devicePixelRatio || 1;
  const width = Math.max(1, Math.round(canvas.clientWidth * ratio));
  const height = Math.max(1, Math.round(canvas.clientHeight * ratio));
  if (canvas.width !== width || canvas.height !== height) {
    canvas.width = width;
    canvas.height = height;
  }
  return ratio;
}
function nextFrame(paint) {
  let asked = false;
  return () => {
    if (asked) return;
    asked = true;
    requestAnimationFrame(() => {
      asked = false;
      paint();
    });
  };
}
function typing(event) {
  const at = event.target;
  if (at instanceof HTMLInputElement) return at.type !== "range" && at.type !== "checkbox";
  return at instanceof HTMLSelectElement || at instanceof HTMLTextAreaElement;
}
function words(name) {
  const text2 = name.replaceAll("_", " ");
  return text2.charAt(0).toUpperCase() + text2.slice(1);
}

// studio/wrinkles/bends_view.ts
var BendsView = class {
  constructor(panel, state, bent) {
    this.state = state;
    this.bent = bent;
    const groups = /* @__PURE__ */ new Map();
    for (const bend of state.opened.bends) {
      let group = groups.get(bend.group);
      if (!group) {
        group = make("div", { class: "group" }, make("h3", {}, bend.group));
        groups.set(bend.group, group);
        panel.append(group);
      }
      const step = bend.unit === "°" ? 1 : 0.01;
      const slider = make("input", { type: "range", min: bend.low, max: bend.high, step, value: bend.start, "aria-label": bend.label, "data-bend": bend.name });
      const out = make("output", {}, "");
      slider.addEventListener("input", () => {
        this.state.bends[bend.name] = Number(slider.value);
        this.follow();
        this.bent();
      });
      slider.addEventListener("dblclick", () => {
        this.state.bends[bend.name] = bend.start;
        this.follow();
        this.bent();
      });
      this.inputs.set(bend.name, { slider, out, bend });
      group.append(make("label", { class: "bend", title: "Double-click: as at first" }, make("span", {}, bend.label), slider, out));
    }
    this.follow();
  }
  state;
  bent;
  inputs = /* @__PURE__ */ new Map();
  /** Shows the state's values. */
  follow() {
    for (const [name, { slider, out, bend }] of this.inputs) {
      const value = this.state.bends[name] ?? bend.start;
      if (Number(slider.value) !== value) slider.value = String(value);
      out.textContent = bend.unit === "°" ? `${Math.round(value)}°` : `${Math.round(100 * value)} %`;
      slider.style.setProperty("--at", `${100 * (value - bend.low) / (bend.high - bend.low)}%`);
    }
  }
  reset() {
    for (const { bend } of this.inputs.values()) this.state.bends[bend.name] = bend.start;
    this.follow();
    this.bent();
  }
};

// studio/wrinkles/colours.ts
var INK = {
  back: "#121315",
  grid: "rgba(255,255,255,0.07)",
  line: "rgba(255,255,255,0.16)",
  text: "#8f959d",
  bright: "#e6e8eb",
  ridge: "#ffb454",
  valley: "#6fc3ff",
  other: "rgba(255,255,255,0.55)",
  fault: "#ff6b6b",
  pin: "#58d6a9"
};
var FONT = "11px system-ui, sans-serif";

// studio/wrinkles/geometry.ts
var sub = (a, b) => [a[0] - b[0], a[1] - b[1]];
var add = (a, b) => [a[0] + b[0], a[1] + b[1]];
var scale = (a, by) => [a[0] * by, a[1] * by];
var distance = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1]);
var mix = (a, b, t) => a + (b - a) * t;
var clamp = (x, low, high) => Math.min(high, Math.max(low, x));
var round = (x) => Math.round(x * 1e5) / 1e5;
function sampled(points, count = 20) {
  const first = points[0];
  if (!first) return [];
  const out = [{ at: first, span: 0, t: 0 }];
  const at = (k) => {
    const n = points.length;
    if (k < 0) return sub(scale(points[0], 2), points[1]);
    if (k >= n) return sub(scale(points[n - 1], 2), points[n - 2]);
    return points[k];
  };
  for (let k = 0; k + 1 < points.length; k++) {
    const p = [at(k - 1), at(k), at(k + 1), at(k + 2)];
    const knot = [0];
    for (let j = 0; j < 3; j++) {
      knot.push(knot[j] + Math.sqrt(Math.max(distance(p[j], p[j + 1]), 1e-12)));
    }
    const [u0, u1, u2, u3] = knot;
    for (let i = 1; i <= count; i++) {
      const u = mix(u1, u2, i / count);
      const between = (ua, ub, a, b) => [
        ((ub - u) * a[0] + (u - ua) * b[0]) / (ub - ua),
        ((ub - u) * a[1] + (u - ua) * b[1]) / (ub - ua)
      ];
      const a1 = between(u0, u1, p[0], p[1]);
      const a2 = between(u1, u2, p[1], p[2]);
      const a3 = between(u2, u3, p[2], p[3]);
      const b1 = between(u0, u2, a1, a2);
      const b2 = between(u1, u3, a2, a3);
      out.push({ at: between(u1, u2, b1, b2), span: k, t: i / count });
    }
  }
  return out;
}
function nearest(curve, to) {
  let best = null;
  for (let k = 0; k + 1 < curve.length; k++) {
    const a = curve[k];
    const b = curve[k + 1];
    const d = sub(b.at, a.at);
    const length = d[0] * d[0] + d[1] * d[1];
    const t = length > 0 ? clamp(((to[0] - a.at[0]) * d[0] + (to[1] - a.at[1]) * d[1]) / length, 0, 1) : 0;
    const at = add(a.at, scale(d, t));
    const away = distance(at, to);
    if (!best || away < best.away) {
      const start = a.span === b.span ? a.t : 0;
      best = { place: { at, span: b.span, t: mix(start, b.t, t) }, away };
    }
  }
  return best;
}
function spread(size) {
  return typeof size === "number" ? [size, size] : size;
}
function onPlane(w, plane, p) {
  const [across, along] = spread(w.size);
  const x = p[0] * (w.mirrored ? -across : across);
  const y = p[1] * along;
  const angle = w.turn * Math.PI / 180;
  const c = Math.cos(angle);
  const s = Math.sin(angle);
  return [w.at[0] * plane[0] + c * x - s * y, w.at[1] * plane[1] + s * x + c * y];
}
function controlPoints(w, shape, plane, moved) {
  return shape.branches.map(
    (branch, b) => branch.points.map((point, k) => onPlane(w, plane, moved?.[b]?.[k] ?? point.at))
  );
}
function freshName(base, taken) {
  const known = new Set(taken);
  const stem = base.replace(/_\d+$/, "");
  for (let k = 2; ; k++) if (!known.has(`${stem}_${k}`)) return `${stem}_${k}`;
}
function owned(form, w, shape, builtin) {
  const users = form.sets.flatMap((s) => s.wrinkles).filter((other) => other.shape === w.shape).length;
  let own = form.shapes.find((s) => s.name === w.shape);
  if (!own || users > 1) {
    own = structuredClone(shape);
    own.name = freshName(w.shape, [...Object.keys(builtin), ...form.shapes.map((s) => s.name)]);
    form.shapes.push(own);
    w.shape = own.name;
  }
  if (w.mirrored) {
    for (const layer of own.profile) {
      layer.offset = -layer.offset;
      layer.lean = -layer.lean;
    }
  }
  return own;
}
function refit(w, shape, plane, points) {
  const every = points.flat();
  const low = [Math.min(...every.map((p) => p[0])), Math.min(...every.map((p) => p[1]))];
  const high = [Math.max(...every.map((p) => p[0])), Math.max(...every.map((p) => p[1]))];
  const half = Math.max(high[0] - low[0], high[1] - low[1], 1e-3) / 2;
  const middle = scale(add(low, high), 0.5);
  w.at = [round(middle[0] / plane[0]), round(middle[1] / plane[1])];
  const unit2 = Math.ceil(half * 1e5) / 1e5;
  w.size = unit2;
  w.turn = 0;
  w.mirrored = false;
  w.wrinkledness = 0;
  const there = [w.at[0] * plane[0], w.at[1] * plane[1]];
  shape.branches.forEach((branch, b) => {
    branch.points.forEach((point, k) => {
      const p = sub(points[b][k], there);
      point.at = [round(clamp(p[0] / unit2, -1, 1)), round(clamp(p[1] / unit2, -1, 1))];
    });
  });
}
function tidied(form) {
  const worn = new Set(form.sets.flatMap((s) => s.wrinkles).map((w) => w.shape));
  form.shapes = form.shapes.filter((s) => worn.has(s.name));
}
function attribute(branch, of, place) {
  const value = (k) => {
    const point = branch.points[k];
    if (!point) return 0;
    if (of === "thickness") return point.thickness;
    const gone = k === 0 && branch.start === "vanish" || k === branch.points.length - 1 && branch.end === "vanish";
    return gone ? 0 : point.intensity;
  };
  const t = place.t * place.t * (3 - 2 * place.t);
  return mix(value(place.span), value(place.span + 1), t);
}

// studio/wrinkles/edits.ts
var PROFILES = {
  cloth: [
    { intensity: 1, offset: 0, thickness: 1, lean: 0.2 },
    { intensity: -0.4, offset: -1, thickness: 0.8, lean: 0 }
  ],
  skin: [
    { intensity: -1, offset: 0, thickness: 0.6, lean: 0 },
    { intensity: 0.45, offset: 0, thickness: 1.6, lean: 0 }
  ]
};
var USUAL = { cloth: { thickness: 0.014, intensity: 8e-3 }, skin: { thickness: 3e-3, intensity: 11e-4 } };
function reshape(state, label, move, merge = "") {
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
    merge
  );
}
function adjust(state, label, change, merge = "") {
  const { set, wrinkle } = state.selection;
  state.edit(
    label,
    (form) => {
      const w = form.sets[set]?.wrinkles[wrinkle];
      if (w) change(w);
    },
    merge
  );
}
function adjustSet(state, label, change, merge = "") {
  const { set } = state.selection;
  state.edit(
    label,
    (form) => {
      const s = form.sets[set];
      if (s) change(s);
    },
    merge
  );
}
function shift(state, by, merge = "") {
  const plane = state.plane;
  adjust(state, "Move wrinkle", (w) => {
    w.at = [w.at[0] + by[0] / plane[0], w.at[1] + by[1] / plane[1]];
  }, merge);
}
function drawCurve(state, places) {
  const set = state.set;
  if (!set || places.length < 2) return;
  const plane = state.plane;
  const at = state.selection.set;
  const usual = USUAL[set.material];
  state.edit("Draw curve", (form) => {
    const shape = {
      name: freshName(`${set.name}_curve`, [...form.shapes.map((s) => s.name), ...Object.keys(state.opened.shapes)]),
      about: "Drawn in the studio",
      material: set.material,
      profile: structuredClone(PROFILES[set.material]),
      branches: [branchOf(places.length)]
    };
    const w = {
      shape: shape.name,
      at: [0, 0],
      size: 1,
      ...usual,
      turn: 0,
      mirrored: false,
      wrinkledness: 0,
      seed: 0
    };
    refit(w, shape, plane, [places]);
    form.shapes.push(shape);
    form.sets[at]?.wrinkles.push(w);
  });
  state.select({ wrinkle: set.wrinkles.length - 1, branch: 0, point: places.length - 1 });
}
function drawBranch(state, places) {
  if (places.length < 2) return;
  reshape(state, "Draw branch", (points, shape) => {
    shape.branches.push(branchOf(places.length));
    points.push(places);
  });
  state.select({ branch: (state.shape?.branches.length ?? 1) - 1, point: places.length - 1 });
}
function branchOf(count) {
  const points = Array.from({ length: count }, () => ({ at: [0, 0], intensity: 1, thickness: 1 }));
  return { points, start: "taper", end: "vanish", cap: 2 };
}
function addShape(state, name) {
  const set = state.set;
  const shape = state.opened.shapes[name];
  if (!set || !shape) return;
  const size = shape.material === "cloth" ? 0.07 : 0.025;
  const at = state.selection.set;
  state.edit(`Add ${name}`, (form) => {
    form.sets[at]?.wrinkles.push({
      shape: name,
      at: [0.5, 0.5],
      size: Math.min(size, 0.4 * Math.min(...state.plane)),
      ...USUAL[set.material],
      turn: 0,
      mirrored: false,
      wrinkledness: 0.2,
      seed: set.wrinkles.length + 1
    });
  });
  state.select({ wrinkle: set.wrinkles.length - 1 });
}
function insertPoint(state, branch, place) {
  reshape(state, "Add point", (points, shape) => {
    const of = shape.branches[branch];
    const a = of.points[place.span];
    const b = of.points[place.span + 1];
    if (!a || !b) return;
    const between = { at: [0, 0], intensity: mix(a.intensity, b.intensity, place.t), thickness: mix(a.thickness, b.thickness, place.t) };
    of.points.splice(place.span + 1, 0, between);
    points[branch]?.splice(place.span + 1, 0, place.at);
  });
  state.select({ branch, point: place.span + 1 });
}
function remove(state) {
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
function duplicate(state) {
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
function turn(state, degrees, factor = 1) {
  adjust(state, factor === 1 ? "Turn wrinkle" : "Scale wrinkle", (w) => {
    w.turn = Math.round((w.turn + degrees) * 100) / 100;
    w.size = typeof w.size === "number" ? w.size * factor : [w.size[0] * factor, w.size[1] * factor];
  });
}
function nudge(state, by) {
  const { branch, point } = state.selection;
  const merge = `nudge ${branch} ${point}`;
  if (point < 0) shift(state, by, merge);
  else
    reshape(state, "Move point", (points) => {
      const of = points[branch];
      if (of?.[point]) of[point] = add(of[point], by);
    }, merge);
}
function addSet(state, region) {
  const of = state.opened.regions.find((r) => r.name === region);
  if (!of) return;
  const like = state.form.sets.find((s) => s.region === region);
  const names = state.form.sets.map((s) => s.name);
  const material = like?.material ?? "cloth";
  const name = names.includes(`${region}_new`) ? freshName(`${region}_new`, names) : `${region}_new`;
  const drive = like ? structuredClone(like.drive) : { joint: "neck", axis: null, action: null, curve: { knots: [[0, 0], [60, 1]], form: "smooth" } };
  const shape = material === "cloth" ? "hip_crease" : "forehead_lines";
  const plane = Object.values(of.planes)[0] ?? [0.3, 0.5];
  state.edit("New set", (form) => {
    form.sets.push({
      name,
      region,
      material,
      drive,
      pull: [],
      lift: material === "cloth" ? 1 : 0,
      memory: 0.2,
      mouth: false,
      wrinkles: [{
        shape,
        at: [0.5, 0.5],
        size: 0.3 * Math.min(...plane),
        ...USUAL[material],
        turn: 0,
        mirrored: false,
        wrinkledness: 0,
        seed: 0
      }]
    });
  });
  state.select({ set: state.form.sets.length - 1, wrinkle: 0 });
}
function removeSet(state) {
  const { set } = state.selection;
  if (state.form.sets.length <= 1) return;
  state.edit("Delete set", (form) => form.sets.splice(set, 1));
  state.selection.set = -1;
  state.select({ set: Math.min(set, state.form.sets.length - 1) });
}
function snapped(points, branch, at, reach) {
  let best = at;
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

// studio/wrinkles/drive_view.ts
var EDGE = { left: 42, right: 18, top: 14, bottom: 26 };
var DriveView = class {
  constructor(canvas, state) {
    this.canvas = canvas;
    this.state = state;
    state.listen((change) => {
      if (change === "selection") this.knot = Math.min(this.knot, (state.set?.drive.curve.knots.length ?? 0) - 1);
      this.redraw();
    });
    canvas.addEventListener("pointerdown", (e) => this.down(e));
    canvas.addEventListener("pointermove", (e) => this.move(e));
    canvas.addEventListener("pointerup", () => this.up());
    canvas.addEventListener("pointercancel", () => this.up());
    canvas.addEventListener("dblclick", (e) => this.twice(e));
    canvas.addEventListener("keydown", (e) => this.key(e));
    new ResizeObserver(() => this.redraw()).observe(canvas);
  }
  canvas;
  state;
  knot = -1;
  dragging = false;
  count = 0;
  redraw = nextFrame(() => this.paint());
  get span() {
    const drive = this.state.set?.drive;
    if (!drive) return [0, 1];
    const values = drive.curve.knots.map((k) => k[0]);
    if (drive.action) return [Math.min(0, ...values), Math.max(1, ...values)];
    const low = drive.axis ? -90 : 0;
    return [Math.min(low, ...values), Math.max(drive.axis ? 120 : 150, ...values)];
  }
  /** Where a value and a weight are on the canvas, in CSS pixels. */
  toScreen([x, y]) {
    const [low, high] = this.span;
    const { clientWidth: w, clientHeight: h } = this.canvas;
    return [
      mix(EDGE.left, w - EDGE.right, (x - low) / (high - low)),
      mix(h - EDGE.bottom, EDGE.top, y)
    ];
  }
  toCurve([x, y]) {
    const [low, high] = this.span;
    const { clientWidth: w, clientHeight: h } = this.canvas;
    const step = this.state.set?.drive.action ? 100 : 2;
    const value = mix(low, high, (x - EDGE.left) / (w - EDGE.right - EDGE.left));
    const weight = (h - EDGE.bottom - y) / (h - EDGE.bottom - EDGE.top);
    return [Math.round(clamp(value, low, high) * step) / step, Math.round(clamp(weight, 0, 1) * 100) / 100];
  }
  at(e) {
    const box = this.canvas.getBoundingClientRect();
    return [e.clientX - box.left, e.clientY - box.top];
  }
  down(e) {
    this.canvas.focus();
    const s = this.at(e);
    const knots = this.state.set?.drive.curve.knots ?? [];
    this.knot = knots.findIndex((k) => Math.hypot(this.toScreen(k)[0] - s[0], this.toScreen(k)[1] - s[1]) < 11);
    this.dragging = this.knot >= 0;
    this.count++;
    this.canvas.setPointerCapture(e.pointerId);
    this.redraw();
  }
  move(e) {
    if (!this.dragging) return;
    const to = this.toCurve(this.at(e));
    adjustSet(this.state, "Driving curve", (set) => {
      const { knots } = set.drive.curve;
      const least = set.drive.action ? 0.01 : 0.5;
      const before = knots[this.knot - 1];
      const after = knots[this.knot + 1];
      const low = before ? before[0] + least : -Infinity;
      const high = after ? after[0] - least : Infinity;
      knots[this.knot] = [clamp(to[0], low, high), to[1]];
    }, `knot ${this.count}`);
  }
  up() {
    if (this.dragging) this.state.history.seal();
    this.dragging = false;
  }
  twice(e) {
    const to = this.toCurve(this.at(e));
    const knots = this.state.set?.drive.curve.knots;
    if (!knots || this.knot >= 0 || knots.some((k) => Math.abs(k[0] - to[0]) < 1e-6)) return;
    this.knot = knots.findIndex((k) => k[0] > to[0]);
    if (this.knot < 0) this.knot = knots.length;
    adjustSet(this.state, "Add knot", (set) => set.drive.curve.knots.splice(this.knot, 0, to));
  }
  key(e) {
    if (e.key !== "Delete" && e.key !== "Backspace") return;
    e.stopPropagation();
    e.preventDefault();
    const knots = this.state.set?.drive.curve.knots;
    if (!knots || knots.length <= 2 || this.knot < 0) return;
    const gone = this.knot;
    this.knot = -1;
    adjustSet(this.state, "Delete knot", (set) => set.drive.curve.knots.splice(gone, 1));
  }
  paint() {
    const ratio = fitted(this.canvas);
    const ink = this.canvas.getContext("2d");
    const set = this.state.set;
    if (!ink) return;
    ink.setTransform(ratio, 0, 0, ratio, 0, 0);
    const { clientWidth: w, clientHeight: h } = this.canvas;
    ink.clearRect(0, 0, w, h);
    if (!set) return;
    const { knots, form } = set.drive.curve;
    const [low, high] = this.span;
    ink.font = FONT;
    ink.lineWidth = 1;
    this.paintGrid(ink, low, high, set.drive.action !== null);
    const line = [[low, knots[0]?.[1] ?? 0]];
    for (let k = 0; k + 1 < knots.length; k++) {
      const [x0, y0] = knots[k];
      const [x1, y1] = knots[k + 1];
      for (let i = 0; i <= 16; i++) {
        const t = i / 16;
        line.push([mix(x0, x1, t), mix(y0, y1, form === "smooth" ? t * t * (3 - 2 * t) : t)]);
      }
    }
    line.push([high, knots.at(-1)?.[1] ?? 0]);
    ink.beginPath();
    line.forEach((p, k) => {
      const [x, y] = this.toScreen(p);
      if (k === 0) ink.moveTo(x, y);
      else ink.lineTo(x, y);
    });
    ink.strokeStyle = INK.ridge;
    ink.lineWidth = 2;
    ink.stroke();
    ink.lineTo(w - EDGE.right, h - EDGE.bottom);
    ink.lineTo(EDGE.left, h - EDGE.bottom);
    ink.fillStyle = "rgba(255,180,84,0.08)";
    ink.fill();
    knots.forEach((k, n) => {
      const [x, y] = this.toScreen(k);
      ink.beginPath();
      ink.arc(x, y, 5, 0, 2 * Math.PI);
      ink.fillStyle = n === this.knot ? INK.bright : INK.ridge;
      ink.fill();
      ink.strokeStyle = "#1c1e21";
      ink.lineWidth = 2;
      ink.stroke();
      if (n === this.knot) {
        ink.fillStyle = INK.bright;
        ink.textAlign = x > w - 90 ? "right" : "left";
        ink.textBaseline = "middle";
        const unit2 = set.drive.action ? "" : "°";
        ink.fillText(`${k[0]}${unit2}, ${Math.round(100 * k[1])} %`, x + (x > w - 90 ? -11 : 11), y < 26 ? y + 12 : y - 9);
      }
    });
    this.paintNow(ink, h);
  }
  paintGrid(ink, low, high, action) {
    const step = action ? 0.25 : 30;
    ink.strokeStyle = INK.grid;
    ink.fillStyle = INK.text;
    ink.textAlign = "center";
    ink.textBaseline = "top";
    for (let x = Math.ceil(low / step) * step; x <= high + 1e-9; x += step) {
      const [sx, bottom] = this.toScreen([x, 0]);
      const top = this.toScreen([x, 1])[1];
      ink.beginPath();
      ink.moveTo(Math.round(sx) + 0.5, top);
      ink.lineTo(Math.round(sx) + 0.5, bottom);
      ink.stroke();
      ink.fillText(action ? x.toFixed(2) : `${Math.round(x)}°`, sx, bottom + 7);
    }
    ink.textAlign = "right";
    ink.textBaseline = "middle";
    for (const y of [0, 0.5, 1]) {
      const [left, sy] = this.toScreen([low, y]);
      ink.beginPath();
      ink.moveTo(left, Math.round(sy) + 0.5);
      ink.lineTo(this.toScreen([high, y])[0], Math.round(sy) + 0.5);
      ink.stroke();
      ink.fillText(`${100 * y} %`, left - 8, sy);
    }
  }
  /** Where the figure is now. */
  paintNow(ink, h) {
    const now = this.state.now;
    const [low, high] = this.span;
    if (!now || now.driven < low - 1 || now.driven > high + 1) return;
    const x = this.toScreen([clamp(now.driven, low, high), 0])[0];
    ink.strokeStyle = INK.pin;
    ink.lineWidth = 1.25;
    ink.beginPath();
    ink.moveTo(x, EDGE.top - 6);
    ink.lineTo(x, h - EDGE.bottom);
    ink.stroke();
    ink.fillStyle = INK.pin;
    ink.beginPath();
    ink.moveTo(x - 4, EDGE.top - 8);
    ink.lineTo(x + 4, EDGE.top - 8);
    ink.lineTo(x, EDGE.top - 2);
    ink.fill();
  }
};

// studio/wrinkles/figure_view.ts
var VERTEX = `#version 300 es
in vec3 position;
in vec3 normal;
in vec2 still;
in vec2 moved;
uniform mat4 clip;
out vec3 n;
out vec3 p;
out vec2 at_light;
out vec2 at_albedo;
void main() {
  n = normal;
  p = position;
  at_light = vec2(still.x, 1.0 - still.y);
  at_albedo = vec2(moved.x, 1.0 - moved.y);
  gl_Position = clip * vec4(position, 1.0);
}`;
var FRAGMENT = `#version 300 es
precision highp float;
in vec3 n;
in vec3 p;
in vec2 at_light;
in vec2 at_albedo;
uniform sampler2D albedo;
uniform sampler2D light;
uniform vec3 eye;
uniform vec3 key;
uniform bool plain;
out vec4 colour;
void main() {
  vec3 m = normalize(n);
  vec3 to_eye = normalize(eye - p);
  vec3 base = plain ? vec3(0.42) : texture(albedo, at_albedo).rgb;
  float folds = texture(light, at_light).r * (255.0 / 128.0);
  float sky = 0.5 + 0.5 * m.y;
  float lamp = max(dot(m, key), 0.0);
  float fill = max(dot(m, normalize(vec3(-key.x, 0.2, key.z * 0.6))), 0.0);
  float rim = pow(1.0 - max(dot(m, to_eye), 0.0), 4.0) * 0.07;
  vec3 lit = base * folds * (mix(vec3(0.16, 0.15, 0.15), vec3(0.30, 0.32, 0.35), sky) + lamp * vec3(0.82, 0.79, 0.74) + fill * 0.16);
  lit += rim * vec3(0.5, 0.55, 0.62) * folds;
  lit = lit / (1.0 + 0.18 * lit);
  colour = vec4(mix(lit * 12.92, 1.055 * pow(max(lit, 0.0031308), vec3(1.0 / 2.4)) - 0.055, step(0.0031308, lit)), 1.0);
}`;
var FigureView = class {
  constructor(canvas) {
    this.canvas = canvas;
    const gl = canvas.getContext("webgl2", { antialias: true, alpha: true, preserveDrawingBuffer: true });
    if (!gl) throw new Error("This browser draws no WebGL 2; the figure cannot be shown.");
    this.gl = gl;
    this.program = linked(gl);
    const buffer = () => gl.createBuffer();
    this.dynamic = { position: buffer(), normal: buffer(), moved: buffer() };
    this.array = gl.createVertexArray();
    this.albedo = gl.createTexture();
    this.light = gl.createTexture();
    this.listen();
    new ResizeObserver(() => this.redraw()).observe(canvas);
  }
  canvas;
  gl;
  program;
  dynamic;
  array;
  albedo;
  light;
  still = null;
  index = null;
  count = 0;
  painted = false;
  redraw = nextFrame(() => this.draw());
  yaw = 0.5;
  pitch = 0.08;
  away = 2.6;
  target = [0, 0.95, 0];
  plain = false;
  /** triangles (T, 3) of drawn vertices, uv (R, 2): where the light of wrinkles lies. */
  mesh(triangles, uv) {
    const { gl } = this;
    this.count = triangles.length;
    this.index = gl.createBuffer();
    this.still = gl.createBuffer();
    gl.bindVertexArray(this.array);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.index);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, triangles, gl.STATIC_DRAW);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.still);
    gl.bufferData(gl.ARRAY_BUFFER, uv, gl.STATIC_DRAW);
    this.attribute("still", 2);
    for (const [name, size] of [["position", 3], ["normal", 3], ["moved", 2]]) {
      gl.bindBuffer(gl.ARRAY_BUFFER, this.dynamic[name]);
      this.attribute(name, size);
    }
    gl.bindVertexArray(null);
  }
  attribute(name, size) {
    const at = this.gl.getAttribLocation(this.program, name);
    if (at < 0) return;
    this.gl.enableVertexAttribArray(at);
    this.gl.vertexAttribPointer(at, size, this.gl.FLOAT, false, 0, 0);
  }
  pose(positions, normals, moved) {
    const { gl } = this;
    for (const [name, data] of [["position", positions], ["normal", normals], ["moved", moved]]) {
      gl.bindBuffer(gl.ARRAY_BUFFER, this.dynamic[name]);
      gl.bufferData(gl.ARRAY_BUFFER, data, gl.DYNAMIC_DRAW);
    }
    this.redraw();
  }
  paint(picture2) {
    const { gl } = this;
    gl.bindTexture(gl.TEXTURE_2D, this.albedo);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.SRGB8_ALPHA8, gl.RGBA, gl.UNSIGNED_BYTE, picture2);
    gl.generateMipmap(gl.TEXTURE_2D);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR_MIPMAP_LINEAR);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
    this.painted = true;
    this.redraw();
  }
  /** Light of wrinkles on a part of the texture of that size. */
  shade(light, size, rect) {
    const { gl } = this;
    const [x, y, w, h] = rect;
    gl.bindTexture(gl.TEXTURE_2D, this.light);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    if (w === size[0] && h === size[1]) {
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.R8, w, h, 0, gl.RED, gl.UNSIGNED_BYTE, light);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
    } else gl.texSubImage2D(gl.TEXTURE_2D, 0, x, y, w, h, gl.RED, gl.UNSIGNED_BYTE, light);
    this.redraw();
  }
  /** Looks at a place from where its surface faces. */
  focus(middle, facing, radius) {
    this.target = [...middle];
    this.yaw = Math.atan2(facing[0], facing[2]);
    this.pitch = clamp(Math.asin(clamp(facing[1], -1, 1)), -0.5, 0.6);
    this.away = Math.max(0.35, 3.4 * radius);
    this.redraw();
  }
  /** Looks at all of it. */
  whole() {
    this.target = [0, 0.9, 0];
    this.away = 3.1;
    this.redraw();
  }
  listen() {
    const { canvas } = this;
    let last = null;
    canvas.addEventListener("contextmenu", (e) => e.preventDefault());
    canvas.addEventListener("pointerdown", (e) => {
      canvas.setPointerCapture(e.pointerId);
      canvas.focus();
      last = [e.clientX, e.clientY];
    });
    canvas.addEventListener("pointermove", (e) => {
      if (!last) return;
      const dx = e.clientX - last[0];
      const dy = e.clientY - last[1];
      last = [e.clientX, e.clientY];
      if (e.buttons & 2 || e.shiftKey) this.pan(dx, dy);
      else this.turn(-dx * 8e-3, dy * 8e-3);
    });
    for (const over of ["pointerup", "pointercancel"]) canvas.addEventListener(over, () => last = null);
    canvas.addEventListener("dblclick", () => this.whole());
    canvas.addEventListener(
      "wheel",
      (e) => {
        e.preventDefault();
        this.away = clamp(this.away * Math.exp(e.deltaY * 12e-4), 0.15, 8);
        this.redraw();
      },
      { passive: false }
    );
  }
  turn(yaw, pitch) {
    this.yaw += yaw;
    this.pitch = clamp(this.pitch + pitch, -1.45, 1.45);
    this.redraw();
  }
  pan(dx, dy) {
    const per = this.away / this.canvas.clientHeight;
    const c = Math.cos(this.yaw);
    const s = Math.sin(this.yaw);
    this.target = [this.target[0] - dx * per * c, this.target[1] + dy * per, this.target[2] + dx * per * s];
    this.redraw();
  }
  draw() {
    const { gl, canvas } = this;
    fitted(canvas);
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    if (!this.painted || this.count === 0) return;
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.CULL_FACE);
    gl.useProgram(this.program);
    const back = [
      Math.sin(this.yaw) * Math.cos(this.pitch),
      Math.sin(this.pitch),
      Math.cos(this.yaw) * Math.cos(this.pitch)
    ];
    const eye = [0, 1, 2].map((k) => this.target[k] + this.away * back[k]);
    const clip = projected(eye, back, this.yaw, canvas.width / canvas.height);
    const at = (name) => gl.getUniformLocation(this.program, name);
    const key = unit([
      Math.cos(this.yaw) * -0.55 + Math.sin(this.yaw) * 0.6,
      0.75,
      Math.sin(this.yaw) * 0.55 + Math.cos(this.yaw) * 0.6
    ]);
    gl.uniformMatrix4fv(at("clip"), false, clip);
    gl.uniform3fv(at("eye"), eye);
    gl.uniform3fv(at("key"), key);
    gl.uniform1i(at("plain"), this.plain ? 1 : 0);
    gl.activeTexture(gl.TEXTURE1);
    gl.bindTexture(gl.TEXTURE_2D, this.light);
    gl.uniform1i(at("light"), 1);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.albedo);
    gl.uniform1i(at("albedo"), 0);
    gl.bindVertexArray(this.array);
    gl.drawElements(gl.TRIANGLES, this.count, gl.UNSIGNED_INT, 0);
    gl.bindVertexArray(null);
  }
};
function unit(v) {
  const length = Math.hypot(...v) || 1;
  return [v[0] / length, v[1] / length, v[2] / length];
}
function projected(eye, back, yaw, aspect) {
  const right = [Math.cos(yaw), 0, -Math.sin(yaw)];
  const up = [
    back[1] * right[2] - back[2] * right[1],
    back[2] * right[0] - back[0] * right[2],
    back[0] * right[1] - back[1] * right[0]
  ];
  const near = 0.03;
  const far = 20;
  const f = 1 / Math.tan(0.5 * 0.6);
  const dot = (a) => a[0] * eye[0] + a[1] * eye[1] + a[2] * eye[2];
  const z = (far + near) / (near - far);
  const w = 2 * far * near / (near - far);
  const out = new Float32Array(16);
  for (let k = 0; k < 3; k++) {
    out[4 * k] = f / aspect * right[k];
    out[4 * k + 1] = f * up[k];
    out[4 * k + 2] = z * back[k];
    out[4 * k + 3] = -back[k];
  }
  out[12] = -f / aspect * dot(right);
  out[13] = -f * dot(up);
  out[14] = -z * dot(back) + w;
  out[15] = dot(back);
  return out;
}
function linked(gl) {
  const program = gl.createProgram();
  for (const [kind, text2] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text2);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader) ?? "shader");
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program) ?? "program");
  return program;
}

// studio/wrinkles/fields.ts
function number(label, value, range, change) {
  const shown = (x) => String(Number(x.toFixed(4)));
  const field = make("input", { type: "number", step: range.step, min: range.low, max: range.high, value: shown(value), "aria-label": label });
  const slider = make("input", { type: "range", min: range.low, max: range.high, step: range.step, value, tabindex: -1, "aria-label": `${label} slider` });
  const fill = () => {
    slider.style.setProperty("--at", `${100 * (Number(slider.value) - range.low) / (range.high - range.low)}%`);
  };
  fill();
  slider.addEventListener("input", () => {
    field.value = shown(Number(slider.value));
    fill();
    change(Number(slider.value), true);
  });
  slider.addEventListener("change", () => change(Number(slider.value), false));
  field.addEventListener("change", () => {
    const typed = Number(field.value);
    if (!Number.isFinite(typed)) return;
    const kept2 = Math.min(range.high, Math.max(range.low, typed));
    field.value = shown(kept2);
    slider.value = String(kept2);
    fill();
    change(kept2, false);
  });
  return make("label", { class: "field" }, make("span", {}, label), slider, make("span", { class: "value" }, field, make("i", {}, range.unit ?? "")));
}
function choice(label, value, options, change) {
  const select = make("select", { "aria-label": label, change: () => change(select.value) });
  for (const option of options) {
    const [key, text2] = typeof option === "string" ? [option, option] : option;
    select.append(make("option", { value: key, selected: key === value }, text2));
  }
  return make("label", { class: "field wide" }, make("span", {}, label), select);
}
function text(label, value, change) {
  const field = make("input", { type: "text", value, "aria-label": label, spellcheck: "false" });
  field.addEventListener("change", () => change(field.value));
  return make("label", { class: "field wide" }, make("span", {}, label), field);
}
function check(label, value, change) {
  const field = make("input", { type: "checkbox", checked: value, "aria-label": label });
  field.addEventListener("change", () => change(field.checked));
  return make("label", { class: "field wide check" }, make("span", {}, label), field);
}

// studio/wrinkles/inspector.ts
var ENDS = [
  ["taper", "Tapers off"],
  ["vanish", "Vanishes"],
  ["round", "Round"]
];
var Inspector = class {
  constructor(panel, state) {
    this.panel = panel;
    this.state = state;
    state.listen(() => this.draw());
    panel.addEventListener("pointerup", () => {
      this.held = false;
      this.state.history.seal();
    });
  }
  panel;
  state;
  held = false;
  key = "";
  draw() {
    if (this.held || this.panel.contains(document.activeElement) && document.activeElement instanceof HTMLInputElement && document.activeElement.type === "text") return;
    const { set, wrinkle, selection } = this.state;
    const key = JSON.stringify([set && { ...set, drive: 0 }, selection, wrinkle && this.state.shape]);
    if (key === this.key) return;
    this.key = key;
    const focus = this.panel.contains(document.activeElement) ? document.activeElement?.getAttribute("aria-label") : null;
    if (!set) this.panel.replaceChildren();
    else if (wrinkle) this.panel.replaceChildren(...this.ofPoint(), ...this.ofCurve(), ...this.ofWrinkle(wrinkle));
    else this.panel.replaceChildren(...this.ofSet());
    if (focus) this.panel.querySelector(`[aria-label="${focus}"]`)?.focus();
  }
  /** A slider that is held stays where it is while the page follows. */
  step(name, held) {
    this.held = held;
    if (!held) this.key = "";
    return held ? `field ${name}` : "";
  }
  ofPoint() {
    const { branch, point } = this.state.selection;
    const p = this.state.shape?.branches[branch]?.points[point];
    if (!p) return [];
    const count = this.state.shape?.branches[branch]?.points.length ?? 0;
    const set = (key, value, held) => {
      reshape(this.state, words(key), (_, shape) => {
        const of = shape.branches[branch]?.points[point];
        if (of) of[key] = value;
      }, this.step(key, held));
    };
    return [
      heading(`Point ${point + 1} of ${count}`),
      number("Intensity", 100 * p.intensity, { low: -100, high: 100, step: 1, unit: "%" }, (x, held) => set("intensity", x / 100, held)),
      number("Width", 100 * p.thickness, { low: 5, high: 100, step: 1, unit: "%" }, (x, held) => set("thickness", x / 100, held))
    ];
  }
  ofCurve() {
    const b = this.state.selection.branch;
    const branch = this.state.shape?.branches[b];
    if (!branch) return [];
    const count = this.state.shape?.branches.length ?? 0;
    const ends = (end, value) => reshape(this.state, "Ends", (_, shape) => {
      const of = shape.branches[b];
      if (of) of[end] = value;
    });
    return [
      heading(count > 1 ? `Curve ${b + 1} of ${count}` : "Curve"),
      choice("Start", branch.start, ENDS, (x) => ends("start", x)),
      choice("End", branch.end, ENDS, (x) => ends("end", x)),
      number(
        "Cap",
        branch.cap,
        { low: 0.2, high: 6, step: 0.1, unit: "radii" },
        (x, held) => reshape(this.state, "Cap", (_, shape) => {
          const of = shape.branches[b];
          if (of) of.cap = x;
        }, this.step("cap", held))
      )
    ];
  }
  ofWrinkle(w) {
    const skin = this.state.set?.material === "skin";
    const put = (label, change, held = false) => adjust(this.state, label, change, this.step(label, held));
    const size = typeof w.size === "number" ? w.size : Math.max(...w.size);
    return [
      heading("Wrinkle", button("Duplicate", "D", () => duplicate(this.state)), button("Delete", "Del", () => {
        this.state.select({ branch: -1, point: -1 });
        remove(this.state);
      })),
      make("p", { class: "quiet" }, words(w.shape), this.state.opened.shapes[w.shape] ? " (built in; its own once a point is moved)" : " (its own)"),
      number("Radius", 1e3 * w.thickness, skin ? { low: 0.3, high: 10, step: 0.1, unit: "mm" } : { low: 2, high: 40, step: 0.5, unit: "mm" }, (x, held) => put("Radius", (to) => to.thickness = x / 1e3, held)),
      number("Height", 1e3 * w.intensity, skin ? { low: -4, high: 4, step: 0.05, unit: "mm" } : { low: -25, high: 25, step: 0.5, unit: "mm" }, (x, held) => put("Height", (to) => to.intensity = x / 1e3, held)),
      number("Size", 1e3 * size, { low: 2, high: 300, step: 1, unit: "mm" }, (x, held) => put("Size", (to) => {
        const factor = x / 1e3 / (typeof to.size === "number" ? to.size : Math.max(...to.size));
        to.size = typeof to.size === "number" ? to.size * factor : [to.size[0] * factor, to.size[1] * factor];
      }, held)),
      number("Turn", ((w.turn + 180) % 360 + 360) % 360 - 180, { low: -180, high: 180, step: 1, unit: "°" }, (x, held) => put("Turn", (to) => to.turn = x, held)),
      number("Wrinkledness", 100 * w.wrinkledness, { low: 0, high: 100, step: 1, unit: "%" }, (x, held) => put("Wrinkledness", (to) => to.wrinkledness = x / 100, held)),
      number("Seed", w.seed, { low: 0, high: 99, step: 1 }, (x, held) => put("Seed", (to) => to.seed = Math.round(x), held)),
      check("Mirrored", w.mirrored, (x) => put("Mirror", (to) => to.mirrored = x))
    ];
  }
  ofSet() {
    const { state } = this;
    const set = state.set;
    if (!set) return [];
    const names = state.form.sets.map((s) => s.name);
    return [
      heading("Set", button("Delete", "", () => removeSet(state))),
      text("Name", set.name, (value) => {
        const name = value.trim().toLowerCase().replace(/[^a-z0-9]+/g, "_").replace(/^[^a-z]+|_+$/g, "");
        if (name && !names.includes(name)) adjustSet(state, "Rename set", (s) => s.name = name);
        this.key = "";
      }),
      choice("Material", set.material, [["cloth", "Cloth"], ["skin", "Skin"]], (x) => adjustSet(state, "Material", (s) => s.material = x)),
      number("Lift", 100 * set.lift, { low: 0, high: 100, step: 5, unit: "%" }, (x, held) => adjustSet(state, "Lift", (s) => s.lift = x / 100, this.step("lift", held))),
      number("Memory", 100 * set.memory, { low: 0, high: 100, step: 5, unit: "%" }, (x, held) => adjustSet(state, "Memory", (s) => s.memory = x / 100, this.step("memory", held))),
      make("p", { class: "quiet" }, "Click a curve to edit it, or draw one with P.")
    ];
  }
};
function driveChoices(state) {
  const set = state.set;
  if (!set) return [];
  const { joint, action, axis, curve } = set.drive;
  const now = action ? `action ${action}` : `joint ${joint}`;
  const options = [
    ...state.opened.joints.map((j) => [`joint ${j}`, words(j)]),
    ...state.opened.actions.map((a) => [`action ${a}`, a])
  ];
  if (!options.some(([key]) => key === now)) options.unshift([now, words(now.split(" ")[1] ?? "")]);
  const about = axis ? `${axis[0]},${axis[1]},${axis[2]}` : "";
  const axes = [["", "whole angle"], ["1,0,0", "about x"], ["0,1,0", "about y"], ["0,0,1", "about z"], ["-1,0,0", "about -x"], ["0,-1,0", "about -y"], ["0,0,-1", "about -z"]];
  if (!axes.some(([key]) => key === about)) axes.push([about, `about ${about}`]);
  const put = (label, change) => adjustSet(state, label, (s) => change(s.drive));
  const out = [
    choice("Driven by", now, options, (value) => put("Driver", (d) => {
      const [kind, name] = value.split(" ");
      const was = d.action !== null;
      d.joint = kind === "joint" ? name : null;
      d.action = kind === "action" ? name : null;
      if (kind === "action") d.axis = null;
      if (was !== (d.action !== null)) {
        const high = Math.max(...d.curve.knots.map((k) => k[0]), 1e-6);
        const low = Math.min(0, ...d.curve.knots.map((k) => k[0]));
        const to = was ? 120 : 1;
        d.curve.knots = d.curve.knots.map(([x, y]) => [clamp(Math.round((x - low) / (high - low) * to * 100) / 100, 0, to), y]);
      }
    })),
    choice("Between knots", curve.form, [["smooth", "smooth"], ["linear", "straight"]], (value) => put("Form of curve", (d) => d.curve.form = value))
  ];
  if (!action)
    out.splice(1, 0, choice("Rotation", about, axes, (value) => put("Axis", (d) => d.axis = value ? value.split(",").map(Number) : null)));
  return out;
}
function heading(title, ...buttons) {
  return make("h3", {}, title, make("span", { class: "grow" }), ...buttons);
}
function button(label, key, click) {
  return make("button", { class: "small", title: key ? `${label} (${key})` : label, click }, label);
}

// studio/wrinkles/link.ts
var LATER_MS = 60;
var SLOW_MS = 700;
var Link = class {
  constructor(state, figure, plane, bends, say2, repaint) {
    this.state = state;
    this.figure = figure;
    this.plane = plane;
    this.bends = bends;
    this.say = say2;
    this.repaint = repaint;
  }
  state;
  figure;
  plane;
  bends;
  say;
  repaint;
  version = 0;
  busy = false;
  formWaits = false;
  waits = false;
  seek = false;
  focus = false;
  timer = 0;
  whole = false;
  /** Told when all that was asked for is shown. */
  settled = () => void 0;
  /** The figure was used for something else: everything of it is to come again. */
  anew() {
    this.version = 0;
    this.whole = true;
    this.ask({ form: true });
  }
  /** Something changed. form: what is edited; seek: the figure is to bend until the selected set is strongest. */
  ask(what = {}) {
    this.waits = true;
    this.formWaits ||= what.form ?? false;
    this.seek ||= what.seek ?? false;
    this.focus ||= what.focus ?? false;
    clearTimeout(this.timer);
    this.timer = window.setTimeout(() => void this.send(), this.formWaits ? LATER_MS : 0);
  }
  get idle() {
    return !this.busy && !this.waits;
  }
  async send() {
    if (this.busy || !this.waits) return;
    const { state } = this;
    const { set, side } = state.selection;
    const asked = {
      bends: state.bends,
      held: state.held && state.set && state.mode === "wrinkles" ? [state.set.name] : [],
      have: this.version,
      plane: { set, side }
    };
    if (state.mode === "photograph") {
      this.waits = false;
      return;
    }
    if (this.whole) asked.whole = true;
    if (this.formWaits) asked.form = structuredClone(state.form);
    const { seek, focus } = this;
    if (seek) asked.seek = { set, side };
    if (focus) asked.focus = { set, side };
    this.waits = this.formWaits = this.seek = this.focus = false;
    this.busy = true;
    const slow = window.setInterval(() => void this.tellSlow(), SLOW_MS);
    try {
      const { head, arrays } = await update(state.opened.session, asked);
      if (head.albedo && arrays.triangles && arrays.still) {
        this.figure.mesh(arrays.triangles, arrays.still);
        await this.repaint();
        this.whole = false;
      }
      this.take(head, arrays, seek && !this.seek);
      this.say("", "");
    } catch (fault) {
      this.version = 0;
      this.say(fault instanceof Error ? fault.message : String(fault), "fault");
    } finally {
      clearInterval(slow);
      this.busy = false;
    }
    if (this.waits) void this.send();
    else this.settled();
  }
  async tellSlow() {
    const text2 = await doing().catch(() => "");
    if (this.busy) this.say(text2 || "Working", "busy");
  }
  take(head, arrays, sought) {
    const { state } = this;
    state.sets = head.sets;
    state.faults = head.faults;
    if (head.jitters) state.jitters = head.jitters;
    if (sought) {
      state.bends = head.bends;
      this.bends().follow();
    }
    this.figure.pose(arrays.positions, arrays.normals, arrays.uv);
    if (arrays.light && head.light.size && head.light.rect)
      this.figure.shade(arrays.light, head.light.size, head.light.rect);
    this.version = head.light.version;
    const { set, side } = state.selection;
    if (arrays.plane && head.plane && head.planeSize && head.plane.set === set && head.plane.side === side)
      this.plane.show(arrays.plane, head.planeSize[0], head.planeSize[1]);
    if (head.focus) this.figure.focus(head.focus.middle, head.focus.facing, head.focus.radius);
    state.tell("answer");
  }
};

// studio/wrinkles/registration.ts
function applied(s, p) {
  return [s.a * p[0] - s.b * p[1] + s.t[0], s.b * p[0] + s.a * p[1] + s.t[1]];
}
function solved(from, to, before) {
  const n = from.length;
  if (n === 0) return before;
  const mean = (points) => {
    const sum = points.reduce(add, [0, 0]);
    return [sum[0] / n, sum[1] / n];
  };
  const p = mean(from);
  const q = mean(to);
  let { a, b } = before;
  let along = 0;
  let across = 0;
  let size = 0;
  for (let k = 0; k < n; k++) {
    const x = sub(from[k], p);
    const y = sub(to[k], q);
    along += x[0] * y[0] + x[1] * y[1];
    across += x[0] * y[1] - x[1] * y[0];
    size += x[0] * x[0] + x[1] * x[1];
  }
  if (n > 1 && size > 1e-9) {
    a = along / size;
    b = across / size;
  }
  const turned = applied({ a, b, t: [0, 0] }, p);
  return { a, b, t: sub(q, turned) };
}
function kept(island, s, middle, size) {
  const k = Math.hypot(s.a, s.b);
  const m = [middle[0] * size[0], middle[1] * size[1]];
  const w = sub(m, s.t);
  const back = [(s.a * w[0] + s.b * w[1]) / (k * k), (-s.b * w[0] + s.a * w[1]) / (k * k)];
  const move = sub(back, m);
  return { island, move: [move[0] / size[0], move[1] / size[1]], turn: -Math.atan2(s.b, s.a), scale: 1 / k };
}
function ofKept(said2, middle, size) {
  if (!said2) return { a: 1, b: 0, t: [0, 0] };
  const k = 1 / said2.scale;
  const a = k * Math.cos(-said2.turn);
  const b = k * Math.sin(-said2.turn);
  const m = [middle[0] * size[0], middle[1] * size[1]];
  const at = add(m, [said2.move[0] * size[0], said2.move[1] * size[1]]);
  return { a, b, t: sub(m, applied({ a, b, t: [0, 0] }, at)) };
}
function rest(pins, s, size) {
  return pins.map((pin) => {
    const at = applied(s, [pin.from[0] * size[0], pin.from[1] * size[1]]);
    return Math.hypot(at[0] - pin.to[0] * size[0], at[1] - pin.to[1] * size[1]);
  });
}

// studio/wrinkles/pins_view.ts
var PinsView = class {
  constructor(canvas, state, figure, say2) {
    this.canvas = canvas;
    this.state = state;
    this.figure = figure;
    this.say = say2;
    canvas.addEventListener("pointerdown", (e) => this.down(e));
    canvas.addEventListener("pointermove", (e) => this.move(e));
    canvas.addEventListener("pointerup", () => this.up());
    canvas.addEventListener("pointercancel", () => this.up());
    canvas.addEventListener("contextmenu", (e) => e.preventDefault());
    canvas.addEventListener("wheel", (e) => this.wheel(e), { passive: false });
    new ResizeObserver(() => this.redraw()).observe(canvas);
    state.listen((change) => {
      if (change === "form" && state.mode === "photograph") void this.follow();
    });
    const select = byId("island");
    select.addEventListener("change", () => this.choose(Number(select.value)));
    const file = byId("photograph-file");
    file.addEventListener("change", () => void this.bring(file));
    byId("pins-clear").addEventListener("click", () => this.clear());
  }
  canvas;
  state;
  figure;
  say;
  laid = null;
  island = 0;
  pin = -1;
  drag = null;
  zoom = 1;
  middle = [0.5, 0.5];
  count = 0;
  repaint = nextFrame(() => this.paint());
  posing = false;
  bent = false;
  /** The avatar whose texture is shown, of those that the server has. */
  shownBase = 0;
  /** Shows the texture and the figure without wrinkles. */
  async enter() {
    this.say("Unfolding the texture …", "busy");
    const { session } = this.state.opened;
    const asked = { session, form: this.state.form, bends: this.state.bends };
    const { head, arrays } = await unpacked(await post("api/photograph", asked));
    const address = `${albedoAddress(session, this.state.form.base)}&of=avatar&base=${this.state.form.base}`;
    const picture2 = await createImageBitmap(await (await fetch(address)).blob(), { colorSpaceConversion: "none" });
    this.laid = { ...head, ...arrays, picture: picture2 };
    const { laid } = this;
    byId("island").replaceChildren(
      ...laid.islands.map((i) => make("option", { value: i.number, selected: i.number === this.island }, `${i.number}  ${words(i.part)}`))
    );
    this.figure.mesh(laid.triangles, laid.uv);
    this.figure.shade(new Uint8Array([128]), [1, 1], [0, 0, 1, 1]);
    this.figure.paint(laid.picture);
    this.choose(laid.islands.some((i) => i.number === this.island) ? this.island : 0);
    this.say("Click the net to set a pin; drag pins to where they belong on the picture", "");
  }
  /** Bends the figure as the sliders say; the newest that is asked for comes last. */
  async pose() {
    if (!this.laid) return;
    this.bent = true;
    if (this.posing) return;
    this.posing = true;
    try {
      while (this.bent) {
        this.bent = false;
        const { session } = this.state.opened;
        const asked = { session, form: this.state.form, bends: this.state.bends };
        const { arrays } = await unpacked(await post("api/photograph", asked));
        this.laid.positions = arrays.positions;
        this.laid.normals = arrays.normals;
        this.redraw();
      }
    } catch (fault) {
      this.say(fault instanceof Error ? fault.message : String(fault), "fault");
    } finally {
      this.posing = false;
    }
  }
  async follow() {
    if (this.shownBase !== this.state.form.base) {
      this.shownBase = this.state.form.base;
      await this.enter();
    }
    this.redraw();
  }
  choose(island) {
    this.island = island;
    this.pin = -1;
    const box = this.laid?.islands.find((i) => i.number === island)?.box;
    if (box && this.laid) {
      const [w, h] = this.laid.size;
      this.middle = [(box[0] + box[2]) / 2 * w, (box[1] + box[3]) / 2 * h];
      const { clientWidth, clientHeight } = this.canvas;
      this.zoom = 0.8 * Math.min(clientWidth / ((box[2] - box[0]) * w + 1), clientHeight / ((box[3] - box[1]) * h + 1));
    }
    this.redraw();
  }
  async bring(file) {
    const chosen = file.files?.[0];
    file.value = "";
    if (!chosen) return;
    this.say(`Laying ${chosen.name} …`, "busy");
    try {
      const answer = await picture(this.state.opened.session, this.island, this.state.form.base, chosen);
      this.shownBase = answer.base;
      const { island } = this;
      this.state.edit("Photograph", (form) => {
        form.base = answer.base;
        form.pins = form.pins.filter((p) => p.island !== island);
        form.texture = form.texture.filter((t) => t.island !== island);
      });
      await this.enter();
      this.say(answer.notes.join("; ") || `${chosen.name} lies on the island; pin it`, "good");
    } catch (fault) {
      this.say(fault instanceof Error ? fault.message : String(fault), "fault");
    }
  }
  clear() {
    const { island } = this;
    this.state.edit("Clear pins", (form) => {
      form.pins = form.pins.filter((p) => p.island !== island);
      form.texture = form.texture.filter((t) => t.island !== island);
    });
    this.pin = -1;
  }
  /** Deletes the selected pin; the rest hold the texture. */
  remove() {
    const gone = this.mine()[this.pin];
    if (!gone) return;
    this.pin = -1;
    this.change("Delete pin", (pins) => pins.filter((p) => JSON.stringify(p) !== JSON.stringify(gone)));
  }
  mine() {
    return this.state.form.pins.filter((p) => p.island === this.island);
  }
  centre(island) {
    const box = this.laid?.islands.find((i) => i.number === island)?.box ?? [0, 0, 1, 1];
    return [(box[0] + box[2]) / 2, (box[1] + box[3]) / 2];
  }
  similarity(island = this.island) {
    const said2 = this.state.form.texture.find((t) => t.island === island);
    return ofKept(said2, this.centre(island), this.laid?.size ?? [1, 1]);
  }
  change(label, how, merge = "") {
    const { laid, island } = this;
    if (!laid) return;
    const [w, h] = laid.size;
    const before = this.similarity();
    this.state.edit(label, (form) => {
      const mine = how(form.pins.filter((p) => p.island === island));
      form.pins = [...form.pins.filter((p) => p.island !== island), ...mine];
      const texels = (p) => [p[0] * w, p[1] * h];
      const found = solved(mine.map((p) => texels(p.from)), mine.map((p) => texels(p.to)), before);
      form.texture = form.texture.filter((t) => t.island !== island);
      if (mine.length > 0) form.texture.push(kept(island, found, this.centre(island), laid.size));
    }, merge);
  }
  /** Texels to CSS pixels; the picture's first row is v = 1. */
  toScreen(p) {
    const { clientWidth, clientHeight } = this.canvas;
    return [clientWidth / 2 + (p[0] - this.middle[0]) * this.zoom, clientHeight / 2 - (p[1] - this.middle[1]) * this.zoom];
  }
  toTexels(s) {
    const { clientWidth, clientHeight } = this.canvas;
    return [this.middle[0] + (s[0] - clientWidth / 2) / this.zoom, this.middle[1] - (s[1] - clientHeight / 2) / this.zoom];
  }
  at(e) {
    const box = this.canvas.getBoundingClientRect();
    return [e.clientX - box.left, e.clientY - box.top];
  }
  down(e) {
    const { laid } = this;
    if (!laid) return;
    this.canvas.focus();
    this.canvas.setPointerCapture(e.pointerId);
    const s = this.at(e);
    const [w, h] = laid.size;
    const name = `pin ${++this.count}`;
    if (e.button !== 0) {
      this.drag = { pan: s, name };
      return;
    }
    this.pin = this.mine().findIndex((p) => {
      const at = this.toScreen([p.to[0] * w, p.to[1] * h]);
      return Math.hypot(at[0] - s[0], at[1] - s[1]) < 10;
    });
    if (this.pin < 0 && this.onNet(s)) {
      const to = this.toTexels(s);
      const { a, b, t } = this.similarity();
      const k = a * a + b * b;
      const d = [to[0] - t[0], to[1] - t[1]];
      const from = [(a * d[0] + b * d[1]) / k / w, (-b * d[0] + a * d[1]) / k / h];
      const pin = { island: this.island, from, to: [to[0] / w, to[1] / h] };
      this.change("Set pin", (pins) => [...pins, pin], name);
      this.pin = this.mine().length - 1;
    }
    this.drag = { pan: this.pin < 0 ? s : null, name };
    this.redraw();
  }
  /** Whether a corner of the island's net is near. */
  onNet(s) {
    const { laid } = this;
    if (!laid) return false;
    const how = this.similarity();
    const [w, h] = laid.size;
    let least = Infinity;
    for (let k = 0; k < laid.island.length; k++) {
      if (laid.island[k] !== this.island) continue;
      const at = this.toScreen(applied(how, [laid.uv[2 * k] * w, laid.uv[2 * k + 1] * h]));
      least = Math.min(least, Math.hypot(at[0] - s[0], at[1] - s[1]));
    }
    return least < 24;
  }
  move(e) {
    const { drag, laid } = this;
    if (!drag || !laid) return;
    const s = this.at(e);
    if (drag.pan) {
      this.middle = [this.middle[0] - (s[0] - drag.pan[0]) / this.zoom, this.middle[1] + (s[1] - drag.pan[1]) / this.zoom];
      drag.pan = s;
      this.redraw();
      return;
    }
    const to = this.toTexels(s);
    const number2 = this.pin;
    this.change("Move pin", (pins) => pins.map((p, k) => k === number2 ? { ...p, to: [to[0] / laid.size[0], to[1] / laid.size[1]] } : p), drag.name);
  }
  up() {
    this.drag = null;
    this.state.history.seal();
  }
  wheel(e) {
    e.preventDefault();
    const s = this.at(e);
    const before = this.toTexels(s);
    this.zoom = clamp(this.zoom * Math.exp(-e.deltaY * 15e-4), 0.02, 60);
    const after = this.toTexels(s);
    this.middle = [this.middle[0] + before[0] - after[0], this.middle[1] + before[1] - after[1]];
    this.redraw();
  }
  redraw() {
    if (this.state.mode === "photograph") this.repaint();
  }
  paint() {
    const ratio = fitted(this.canvas);
    const ink = this.canvas.getContext("2d");
    const { laid } = this;
    if (!ink || !laid) return;
    ink.setTransform(ratio, 0, 0, ratio, 0, 0);
    const { clientWidth, clientHeight } = this.canvas;
    ink.fillStyle = INK.back;
    ink.fillRect(0, 0, clientWidth, clientHeight);
    const [w, h] = laid.size;
    const [left, top] = this.toScreen([0, h]);
    ink.drawImage(laid.picture, left, top, w * this.zoom, h * this.zoom);
    const how = this.similarity();
    ink.strokeStyle = "rgba(88,214,169,0.5)";
    ink.lineWidth = 0.7;
    ink.beginPath();
    const place = (k) => this.toScreen(applied(how, [laid.uv[2 * k] * w, laid.uv[2 * k + 1] * h]));
    for (let t = 0; t < laid.triangles.length; t += 3) {
      const [i, j, k] = [laid.triangles[t], laid.triangles[t + 1], laid.triangles[t + 2]];
      if (laid.island[i] !== this.island) continue;
      const [a, b, c] = [place(i), place(j), place(k)];
      ink.moveTo(a[0], a[1]);
      ink.lineTo(b[0], b[1]);
      ink.lineTo(c[0], c[1]);
    }
    ink.stroke();
    this.paintPins(ink, how);
    this.dress();
  }
  paintPins(ink, how) {
    const [w, h] = this.laid?.size ?? [1, 1];
    const pins = this.mine();
    const away = rest(pins, how, [w, h]);
    ink.font = FONT;
    ink.textBaseline = "middle";
    pins.forEach((pin, k) => {
      const to = this.toScreen([pin.to[0] * w, pin.to[1] * h]);
      const at = this.toScreen(applied(how, [pin.from[0] * w, pin.from[1] * h]));
      ink.strokeStyle = INK.fault;
      ink.lineWidth = 1.5;
      ink.beginPath();
      ink.moveTo(at[0], at[1]);
      ink.lineTo(to[0], to[1]);
      ink.stroke();
      ink.beginPath();
      ink.arc(to[0], to[1], 6, 0, 2 * Math.PI);
      ink.fillStyle = k === this.pin ? INK.bright : INK.pin;
      ink.fill();
      ink.strokeStyle = "#0b0c0d";
      ink.lineWidth = 2;
      ink.stroke();
      if (away[k] >= 1) {
        ink.fillStyle = INK.bright;
        ink.fillText(`${away[k].toFixed(0)} px off`, to[0] + 11, to[1]);
      }
    });
  }
  /** The figure with the texture as pins hold it. */
  dress() {
    const { laid } = this;
    if (!laid) return;
    const [w, h] = laid.size;
    const moved = laid.uv.slice();
    for (const said2 of this.state.form.texture) {
      const how = this.similarity(said2.island);
      for (let k = 0; k < laid.island.length; k++) {
        if (laid.island[k] !== said2.island) continue;
        const at = applied(how, [laid.uv[2 * k] * w, laid.uv[2 * k + 1] * h]);
        moved[2 * k] = at[0] / w;
        moved[2 * k + 1] = at[1] / h;
      }
    }
    this.figure.pose(laid.positions, laid.normals, moved);
  }
};

// studio/wrinkles/ink.ts
var AROUND = 0.5;
function path(ink, there, curve) {
  ink.beginPath();
  curve.forEach((p, k) => {
    const [x, y] = there(p);
    if (k === 0) ink.moveTo(x, y);
    else ink.lineTo(x, y);
  });
}
function paintWidth(ink, there, branch, curve, radius, colour) {
  ink.save();
  ink.fillStyle = colour;
  const left = [];
  const right = [];
  curve.forEach((c, k) => {
    const before = curve[Math.max(0, k - 1)].at;
    const after = curve[Math.min(curve.length - 1, k + 1)].at;
    const d = sub(after, before);
    const length = Math.hypot(...d) || 1;
    const r = radius * attribute(branch, "thickness", c) * Math.sqrt(Math.abs(attribute(branch, "intensity", c))) / length;
    left.push([c.at[0] - d[1] * r, c.at[1] + d[0] * r]);
    right.push([c.at[0] + d[1] * r, c.at[1] - d[0] * r]);
  });
  path(ink, there, [...left, ...right.reverse()]);
  ink.closePath();
  ink.globalAlpha = 0.16;
  ink.fill();
  ink.globalAlpha = 0.5;
  ink.lineWidth = 0.75;
  ink.strokeStyle = colour;
  ink.stroke();
  ink.restore();
}
function paintPoint(ink, there, p, colour, end, chosen) {
  const [x, y] = there(p);
  ink.beginPath();
  if (end === "taper") {
    ink.moveTo(x, y - 6);
    ink.lineTo(x + 6, y);
    ink.lineTo(x, y + 6);
    ink.lineTo(x - 6, y);
    ink.closePath();
  } else ink.arc(x, y, chosen ? 5.5 : 4.5, 0, 2 * Math.PI);
  ink.fillStyle = chosen ? INK.bright : end === "vanish" ? INK.back : colour;
  ink.fill();
  ink.strokeStyle = chosen ? colour : end === "vanish" ? colour : "rgba(0,0,0,0.7)";
  ink.lineWidth = chosen ? 2.5 : 1.5;
  ink.stroke();
}
function paintPlane(ink, there, plane, picture2, knots) {
  const h = plane[1];
  const [left, top] = there([0, h]);
  const [right, bottom] = there([plane[0], 0]);
  const width = right - left;
  const height = bottom - top;
  ink.save();
  ink.beginPath();
  ink.rect(left - AROUND * width, top, (1 + 2 * AROUND) * width, height);
  ink.clip();
  for (const k of [-1, 0, 1]) {
    ink.globalAlpha = k === 0 ? 1 : 0.28;
    if (picture2) ink.drawImage(picture2, left + k * width, top, width, height);
    else {
      ink.fillStyle = "#26282c";
      ink.fillRect(left + k * width, top, width, height);
    }
  }
  ink.restore();
  ink.strokeStyle = INK.line;
  ink.lineWidth = 1;
  ink.strokeRect(Math.round(left) + 0.5, Math.round(top) + 0.5, Math.round(width), Math.round(height));
  ink.font = FONT;
  ink.textBaseline = "middle";
  for (const [joint, v] of knots) {
    const y = Math.round(there([0, clamp(v, 0, 1) * h])[1]) + 0.5;
    ink.strokeStyle = INK.line;
    ink.setLineDash([3, 5]);
    ink.beginPath();
    ink.moveTo(left - AROUND * width, y);
    ink.lineTo(left + width * (1 + AROUND), y);
    ink.stroke();
    ink.setLineDash([]);
    ink.fillStyle = INK.text;
    ink.textAlign = "left";
    ink.fillText(words(joint), Math.max(8, left - AROUND * width + 6), y + (v >= 1 ? 10 : -9));
  }
}

// studio/wrinkles/plane_view.ts
var GRAB = 9;
var PlaneView = class {
  constructor(canvas, state, say2) {
    this.canvas = canvas;
    this.state = state;
    this.say = say2;
    state.listen((change) => {
      if (change === "selection") {
        const key = `${state.selection.set} ${state.selection.side}`;
        if (key !== this.shown) {
          this.shown = key;
          this.picture = null;
          this.frame();
        }
      }
      this.redraw();
    });
    canvas.addEventListener("pointerdown", (e) => this.down(e));
    canvas.addEventListener("pointermove", (e) => this.move(e));
    canvas.addEventListener("pointerup", (e) => this.up(e));
    canvas.addEventListener("pointercancel", (e) => this.up(e));
    canvas.addEventListener("pointerleave", () => {
      this.hover = null;
      this.redraw();
    });
    canvas.addEventListener("dblclick", (e) => this.twice(e));
    canvas.addEventListener("contextmenu", (e) => e.preventDefault());
    canvas.addEventListener("wheel", (e) => this.wheel(e), { passive: false });
    new ResizeObserver(() => {
      if (this.zoom === 0) this.frame();
      this.redraw();
    }).observe(canvas);
  }
  canvas;
  state;
  say;
  zoom = 0;
  middle = [0.15, 0.25];
  shown = "";
  picture = null;
  drag = null;
  drawn = [];
  hover = null;
  hovered = null;
  count = 0;
  redraw = nextFrame(() => this.paint());
  /** The plane's colour under the light of its set, (h, w, 4). */
  show(pixels, width, height) {
    const picture2 = document.createElement("canvas");
    picture2.width = width;
    picture2.height = height;
    const data = new ImageData(new Uint8ClampedArray(pixels), width, height);
    picture2.getContext("2d")?.putImageData(data, 0, 0);
    this.picture = picture2;
    this.redraw();
  }
  /** Shows the whole plane. */
  frame() {
    const [w, h] = this.state.plane;
    const { clientWidth, clientHeight } = this.canvas;
    this.zoom = Math.min(clientWidth / (w * 1.35), clientHeight / (h * 1.12));
    this.middle = [w / 2, h / 2];
    this.redraw();
  }
  /** Ends what is being drawn; false: forgets it. */
  finish(keep) {
    const places = this.drawn;
    this.drawn = [];
    if (places.length === 0) return false;
    if (keep && places.length >= 2) {
      if (this.state.tool === "branch") drawBranch(this.state, places);
      else drawCurve(this.state, places);
    }
    this.state.tool = "select";
    this.state.tell("look");
    return true;
  }
  /** Where a place of the plane is on the screen, in CSS pixels of the canvas. */
  toScreen(p) {
    const { clientWidth, clientHeight } = this.canvas;
    return [clientWidth / 2 + (p[0] - this.middle[0]) * this.zoom, clientHeight / 2 - (p[1] - this.middle[1]) * this.zoom];
  }
  there = (p) => this.toScreen(p);
  toPlane(s) {
    const { clientWidth, clientHeight } = this.canvas;
    return [this.middle[0] + (s[0] - clientWidth / 2) / this.zoom, this.middle[1] - (s[1] - clientHeight / 2) / this.zoom];
  }
  at(e) {
    const box = this.canvas.getBoundingClientRect();
    return [e.clientX - box.left, e.clientY - box.top];
  }
  hit(s) {
    const { state } = this;
    const p = this.toPlane(s);
    const reach = GRAB / this.zoom;
    const chosen = state.selection.wrinkle;
    const order = (state.set?.wrinkles ?? []).map((_, n) => n).sort((a, b) => +(b === chosen) - +(a === chosen));
    const handle = this.widthHandle();
    if (handle && distance(handle, p) < reach) {
      const { wrinkle, branch, point } = state.selection;
      return { wrinkle, branch, point, place: null, width: true };
    }
    for (const n of order) {
      let best = null;
      let least = reach;
      state.pointsOf(n).forEach(
        (points, branch) => points.forEach((at, point) => {
          const away = distance(at, p);
          if (away < least) {
            least = away;
            best = { wrinkle: n, branch, point, place: null, width: false };
          }
        })
      );
      if (best) return best;
    }
    for (const n of order) {
      let best = null;
      let least = reach;
      state.curvesOf(n).forEach((curve, branch) => {
        const found = nearest(curve, p);
        if (found && found.away < least) {
          least = found.away;
          best = { wrinkle: n, branch, point: -1, place: found.place, width: false };
        }
      });
      if (best) return best;
    }
    return null;
  }
  /** Where the radius at the selected point is dragged. */
  widthHandle() {
    const { selection, shape, wrinkle } = this.state;
    const points = this.state.pointsOf(selection.wrinkle)[selection.branch];
    const at = points?.[selection.point];
    const point = shape?.branches[selection.branch]?.points[selection.point];
    if (!points || !at || !point || !wrinkle) return null;
    const before = points[Math.max(0, selection.point - 1)];
    const after = points[Math.min(points.length - 1, selection.point + 1)];
    const along = sub(after, before);
    const length = Math.hypot(...along) || 1;
    const radius = Math.max(wrinkle.thickness * point.thickness, 12 / this.zoom);
    return [at[0] - along[1] / length * radius, at[1] + along[0] / length * radius];
  }
  down(e) {
    const s = this.at(e);
    this.canvas.focus();
    this.canvas.setPointerCapture(e.pointerId);
    if (e.button !== 0) {
      this.drag = { kind: "pan", last: s };
      return;
    }
    if (this.state.tool !== "select") {
      this.place(s);
      return;
    }
    const hit = this.hit(s);
    const name = `drag ${++this.count}`;
    if (!hit) {
      this.state.select({ wrinkle: -1 });
      this.drag = { kind: "pan", last: s };
    } else if (hit.width) {
      this.drag = { kind: "width", branch: hit.branch, point: hit.point, name };
    } else {
      this.state.select({ wrinkle: hit.wrinkle, branch: hit.branch, point: hit.point });
      this.drag = hit.point >= 0 ? { kind: "point", branch: hit.branch, point: hit.point, name } : { kind: "wrinkle", last: this.toPlane(s), name };
    }
  }
  /** A click with a drawing tool. */
  place(s) {
    const { state } = this;
    let p = this.toPlane(s);
    if (state.tool === "branch" && this.drawn.length === 0) {
      const hit = this.hit(s);
      if (!hit) {
        this.say("A branch begins on a curve: click on one");
        return;
      }
      const points = state.pointsOf(hit.wrinkle)[hit.branch];
      p = hit.place?.at ?? points?.[hit.point] ?? p;
      state.select({ wrinkle: hit.wrinkle, branch: hit.branch });
    } else if (state.tool === "branch") {
      p = snapped(state.pointsOf(state.selection.wrinkle), -1, p, GRAB / this.zoom);
    }
    const last = this.drawn.at(-1);
    if (last && distance(last, p) < 2 / this.zoom) return;
    this.drawn.push(this.inside(p));
    this.redraw();
  }
  inside(p) {
    const [w, h] = this.state.plane;
    return [clamp(p[0], -AROUND * w, (1 + AROUND) * w), clamp(p[1], 0, h)];
  }
  move(e) {
    const s = this.at(e);
    const p = this.toPlane(s);
    this.hover = p;
    const { drag, state } = this;
    if (!drag) {
      this.hovered = state.tool === "draw" ? null : this.hit(s);
      this.canvas.style.cursor = state.tool !== "select" ? "crosshair" : this.hovered ? "pointer" : "grab";
      this.redraw();
    } else if (drag.kind === "pan") {
      this.middle = [this.middle[0] - (s[0] - drag.last[0]) / this.zoom, this.middle[1] + (s[1] - drag.last[1]) / this.zoom];
      drag.last = s;
      this.redraw();
    } else if (drag.kind === "wrinkle") {
      shift(state, sub(p, drag.last), drag.name);
      drag.last = p;
    } else if (drag.kind === "point") {
      reshape(state, "Move point", (points) => {
        const of = points[drag.branch];
        if (!of) return;
        const from = of[drag.point];
        const end = drag.point === 0 || drag.point === of.length - 1;
        const to = end && !e.altKey ? snapped(points, drag.branch, p, GRAB / this.zoom) : p;
        const there = this.inside(to);
        points.forEach(
          (other, b) => other.forEach((q, k) => {
            const atEnd = k === 0 || k === other.length - 1;
            if (b !== drag.branch && atEnd && distance(q, from) < 1e-6) other[k] = there;
          })
        );
        of[drag.point] = there;
      }, drag.name);
    } else {
      const at = state.pointsOf(state.selection.wrinkle)[drag.branch]?.[drag.point];
      if (!at) return;
      const radius = distance(at, p);
      reshape(state, "Width", (_, shape, w) => {
        const point = shape.branches[drag.branch]?.points[drag.point];
        if (point) point.thickness = Math.round(clamp(radius / w.thickness, 0.05, 1) * 1e3) / 1e3;
      }, drag.name);
    }
  }
  up(e) {
    if (this.canvas.hasPointerCapture(e.pointerId)) this.canvas.releasePointerCapture(e.pointerId);
    if (this.drag) this.state.history.seal();
    this.drag = null;
  }
  twice(e) {
    if (this.state.tool !== "select") {
      this.finish(true);
      return;
    }
    const hit = this.hit(this.at(e));
    if (hit?.place) {
      this.state.select({ wrinkle: hit.wrinkle });
      insertPoint(this.state, hit.branch, hit.place);
    }
  }
  wheel(e) {
    e.preventDefault();
    const s = this.at(e);
    const before = this.toPlane(s);
    this.zoom = clamp(this.zoom * Math.exp(-e.deltaY * 15e-4), 60, 4e4);
    const after = this.toPlane(s);
    this.middle = [this.middle[0] + before[0] - after[0], this.middle[1] + before[1] - after[1]];
    this.redraw();
  }
  paint() {
    const ratio = fitted(this.canvas);
    const ink = this.canvas.getContext("2d");
    if (!ink) return;
    ink.setTransform(ratio, 0, 0, ratio, 0, 0);
    const { clientWidth, clientHeight } = this.canvas;
    ink.fillStyle = INK.back;
    ink.fillRect(0, 0, clientWidth, clientHeight);
    if (!this.state.set) return;
    const knots = this.state.regionOf(this.state.set)?.knots ?? [];
    paintPlane(ink, this.there, this.state.plane, this.picture, knots);
    (this.state.set.wrinkles ?? []).forEach((_, n) => {
      if (n !== this.state.selection.wrinkle) this.paintWrinkle(ink, n, false);
    });
    if (this.state.wrinkle) this.paintWrinkle(ink, this.state.selection.wrinkle, true);
    this.paintDrawing(ink);
  }
  paintWrinkle(ink, n, chosen) {
    const { state } = this;
    const w = state.set?.wrinkles[n];
    const shape = w && state.shapeOf(w);
    if (!w || !shape) return;
    const bad = state.faults.some((f) => f.set === state.selection.set || f.shape === w.shape) && chosen;
    const colour = bad ? INK.fault : w.intensity < 0 ? INK.valley : INK.ridge;
    const points = state.pointsOf(n);
    const tinted = chosen || this.hovered?.wrinkle === n;
    shape.branches.forEach((branch, b) => {
      const curve = sampled(points[b] ?? []);
      if (chosen) paintWidth(ink, this.there, branch, curve, w.thickness, colour);
      ink.lineJoin = ink.lineCap = "round";
      ink.strokeStyle = "rgba(0,0,0,0.55)";
      ink.lineWidth = chosen && b === state.selection.branch ? 4.5 : 3.5;
      path(ink, this.there, curve.map((c) => c.at));
      ink.stroke();
      ink.strokeStyle = tinted ? colour : INK.other;
      ink.lineWidth = chosen && b === state.selection.branch ? 2.2 : 1.4;
      ink.stroke();
    });
    if (!chosen) return;
    shape.branches.forEach(
      (branch, b) => (points[b] ?? []).forEach((p, k) => {
        const end = k === 0 ? branch.start : k === branch.points.length - 1 ? branch.end : null;
        paintPoint(ink, this.there, p, colour, end, b === state.selection.branch && k === state.selection.point);
      })
    );
    const handle = this.widthHandle();
    const at = points[state.selection.branch]?.[state.selection.point];
    if (handle && at) {
      path(ink, this.there, [at, handle]);
      ink.strokeStyle = INK.bright;
      ink.lineWidth = 1;
      ink.stroke();
      const [x, y] = this.toScreen(handle);
      ink.fillStyle = INK.bright;
      ink.fillRect(x - 3.5, y - 3.5, 7, 7);
    }
  }
  paintDrawing(ink) {
    if (this.state.tool === "select") return;
    const places = this.hover && this.drawn.length > 0 ? [...this.drawn, this.hover] : this.drawn;
    if (places.length >= 2) {
      path(ink, this.there, sampled(places).map((c) => c.at));
      ink.strokeStyle = INK.ridge;
      ink.lineWidth = 2;
      ink.setLineDash([6, 4]);
      ink.stroke();
      ink.setLineDash([]);
    }
    for (const p of this.drawn) paintPoint(ink, this.there, p, INK.ridge, null, false);
  }
};

// studio/wrinkles/set_list.ts
var SetList = class {
  constructor(panel, state) {
    this.panel = panel;
    this.state = state;
    state.listen(() => this.draw());
  }
  panel;
  state;
  key = "";
  bars = /* @__PURE__ */ new Map();
  draw() {
    const { form, selection, faults } = this.state;
    const key = JSON.stringify([form.sets.map((s) => [s.name, s.region, s.wrinkles.length]), selection.set, faults.map((f) => f.set)]);
    if (key !== this.key) {
      this.key = key;
      this.rows();
    }
    for (const [k, bar] of this.bars) {
      const weights = this.state.sets.filter((s) => s.set === k).map((s) => s.weight);
      bar.style.width = `${100 * Math.max(0, ...weights)}%`;
    }
  }
  rows() {
    const { state } = this;
    this.bars.clear();
    const out = [];
    for (const region of state.opened.regions) {
      const mine = state.form.sets.map((s, k) => [s, k]).filter(([s]) => s.region === region.name);
      if (mine.length === 0) continue;
      out.push(make("h3", {}, words(region.name)));
      for (const [set, k] of mine) {
        const bar = make("b", {});
        this.bars.set(k, bar);
        const bad = state.faults.some((f) => f.set === k);
        out.push(
          make(
            "button",
            { class: `row${k === state.selection.set ? " chosen" : ""}${bad ? " bad" : ""}`, click: () => state.select({ set: k, wrinkle: -1 }), "data-set": set.name },
            make("span", {}, words(set.name)),
            make("em", {}, set.wrinkles.length > 0 ? String(set.wrinkles.length) : "pull"),
            make("i", {}, bar)
          )
        );
      }
    }
    this.panel.replaceChildren(...out);
    this.panel.querySelector(".chosen")?.scrollIntoView({ block: "nearest" });
  }
};

// studio/wrinkles/history.ts
var History = class {
  constructor(start, most = 200) {
    this.most = most;
    this.current = structuredClone(start);
  }
  most;
  undone = [];
  done = [];
  current;
  last = "";
  /** Keeps a state that came of doing `label`. merge: a name that later steps of the same doing share; they become one. */
  push(label, state, merge = "") {
    if (merge === "" || merge !== this.last) {
      this.done.push({ label, state: this.current });
      if (this.done.length > this.most) this.done.shift();
    }
    this.last = merge;
    this.undone = [];
    this.current = structuredClone(state);
  }
  /** The doing that `merge` named is over. */
  seal() {
    this.last = "";
  }
  undo() {
    return this.moved(this.done, this.undone);
  }
  redo() {
    return this.moved(this.undone, this.done);
  }
  get next() {
    return { undo: this.done.at(-1)?.label ?? null, redo: this.undone.at(-1)?.label ?? null };
  }
  moved(from, to) {
    const step = from.pop();
    if (!step) return null;
    to.push({ label: step.label, state: this.current });
    this.current = step.state;
    this.last = "";
    return { label: step.label, state: structuredClone(step.state) };
  }
};

// studio/wrinkles/state.ts
var State = class {
  constructor(opened) {
    this.opened = opened;
    this.form = opened.form;
    this.history = new History(opened.form);
    this.saved = JSON.stringify(opened.form);
    for (const bend of opened.bends) this.bends[bend.name] = bend.start;
  }
  opened;
  form;
  selection = { set: -1, side: "", wrinkle: -1, branch: -1, point: -1 };
  tool = "select";
  mode = "wrinkles";
  bends = {};
  held = true;
  faults = [];
  sets = [];
  jitters = [];
  saved;
  history;
  listeners = [];
  listen(listener) {
    this.listeners.push(listener);
  }
  tell(change) {
    for (const listener of this.listeners) listener(change);
  }
  /** Changes the form; `merge` joins steps of one drag in the history. */
  edit(label, change, merge = "") {
    change(this.form);
    tidied(this.form);
    this.history.push(label, this.form, merge);
    this.tell("form");
  }
  undo() {
    return this.restored(this.history.undo());
  }
  redo() {
    return this.restored(this.history.redo());
  }
  restored(step) {
    if (!step) return null;
    this.form = step.state;
    const { set, wrinkle, branch, point } = this.selection;
    if (!this.form.sets[set]) this.select({ set: this.form.sets.length - 1, wrinkle: -1 });
    else if (!this.wrinkle) this.selection.wrinkle = -1;
    const points = this.shape?.branches[branch]?.points;
    if (wrinkle >= 0 && (!points || !points[point])) {
      this.selection.branch = -1;
      this.selection.point = -1;
    }
    this.tell("form");
    this.tell("selection");
    return step.label;
  }
  get dirty() {
    return JSON.stringify(this.form) !== this.saved;
  }
  select(part) {
    const next = { ...this.selection, ...part };
    if (part.set !== void 0 && part.set !== this.selection.set) {
      next.wrinkle = part.wrinkle ?? -1;
      next.branch = part.branch ?? -1;
      next.point = part.point ?? -1;
      const sides = Object.keys(this.regionOf(this.form.sets[next.set])?.planes ?? {});
      if (!sides.includes(next.side)) next.side = sides[0] ?? "";
    }
    if (part.wrinkle !== void 0 && part.branch === void 0) next.branch = next.point = -1;
    this.selection = next;
    this.tell("selection");
  }
  get set() {
    return this.form.sets[this.selection.set];
  }
  get wrinkle() {
    return this.set?.wrinkles[this.selection.wrinkle];
  }
  get shape() {
    return this.wrinkle && this.shapeOf(this.wrinkle);
  }
  shapeOf(w) {
    return this.form.shapes.find((s) => s.name === w.shape) ?? this.opened.shapes[w.shape];
  }
  regionOf(set) {
    return set && this.opened.regions.find((r) => r.name === set.region);
  }
  /** Width and height of the selected region [m]. */
  get plane() {
    return this.regionOf(this.set)?.planes[this.selection.side] ?? [0.3, 0.5];
  }
  /** Control points of a wrinkle of the selected set on its plane. */
  pointsOf(n) {
    const w = this.set?.wrinkles[n];
    const shape = w && this.shapeOf(w);
    if (!w || !shape) return [];
    const moved = w.wrinkledness > 0 ? this.jitters.find((j) => j.set === this.selection.set && j.wrinkle === n)?.branches : void 0;
    return controlPoints(w, shape, this.plane, moved);
  }
  curvesOf(n) {
    return this.pointsOf(n).map((points) => sampled(points));
  }
  /** How much of the selected set is there on the shown side. */
  get now() {
    return this.sets.find((s) => s.set === this.selection.set && s.side === this.selection.side);
  }
};

// studio/wrinkles/main.ts
var notice = byId("notice");
function say(text2, kind = "") {
  notice.textContent = said(text2);
  notice.className = kind;
}
async function begin() {
  const waiting = window.setInterval(() => void doing().then((text2) => text2 && say(`${said(text2)} …`, "busy")), 500);
  try {
    const { head, arrays } = await open();
    const figure = new FigureView(byId("figure"));
    figure.mesh(arrays.triangles, arrays.uv);
    await painted(figure, head.session);
    studio(new State(head), figure);
  } finally {
    clearInterval(waiting);
  }
}
async function painted(figure, session, version = 0) {
  const answer = await fetch(albedoAddress(session, version));
  if (!answer.ok) throw new Refusal("The texture did not come", answer.status);
  figure.paint(await createImageBitmap(await answer.blob(), { colorSpaceConversion: "none" }));
}
function studio(state, figure) {
  const plane = new PlaneView(byId("plane"), state, (text2) => say(text2, "busy"));
  const drive = new DriveView(byId("drive"), state);
  new Inspector(byId("inspector"), state);
  new SetList(byId("sets"), state);
  let paintings = 0;
  const repaint = () => painted(figure, state.opened.session, ++paintings);
  const link2 = new Link(state, figure, plane, () => bends, say, repaint);
  const pins = new PinsView(byId("pins"), state, figure, say);
  const bends = new BendsView(byId("bends"), state, () => {
    if (state.mode === "photograph") void pins.pose();
    else link2.ask();
  });
  const { opened } = state;
  byId("title").textContent = opened.name;
  byId("file").textContent = opened.saves;
  document.title = `${opened.name} · Wrinkle studio`;
  let drawnSet = "";
  state.listen((change) => {
    if (change === "form") link2.ask({ form: true });
    if (change === "look") link2.ask();
    const key = `${state.selection.set} ${state.selection.side}`;
    if (change === "selection" && key !== drawnSet) {
      drawnSet = key;
      link2.ask({ seek: true, focus: true });
    }
    follow();
  });
  function follow() {
    const { undo, redo } = state.history.next;
    enable("undo", undo !== null, `Undo ${undo ?? ""} (Ctrl+Z)`);
    enable("redo", redo !== null, `Redo ${redo ?? ""} (Ctrl+Shift+Z)`);
    byId("save").classList.toggle("dirty", state.dirty);
    for (const tool2 of ["select", "draw", "branch"])
      byId(`tool-${tool2}`).classList.toggle("chosen", state.tool === tool2);
    byId("held").classList.toggle("chosen", state.held);
    faults();
    head();
  }
  function enable(id, can, title) {
    const button2 = byId(id);
    button2.disabled = !can;
    button2.title = title;
  }
  function faults() {
    const said2 = new Map(state.faults.map((f) => [f.text, f.set === null && f.shape === null ? "note" : "fault"]));
    byId("faults").replaceChildren(...[...said2].slice(0, 4).map(([text2, kind]) => make("li", { class: kind }, text2)));
  }
  let headed = "";
  function head() {
    const set = state.set;
    const now = JSON.stringify([set?.name, set?.region, set?.drive, state.selection.side, state.form.sets.length]);
    if (now === headed) return;
    headed = now;
    byId("plane-title").textContent = set ? words(set.name) : said("No set");
    const sides = Object.keys(state.regionOf(set)?.planes ?? {});
    byId("sides").replaceChildren(
      ...(sides.length > 1 ? sides : []).map(
        (side) => make("button", { class: side === state.selection.side ? "chosen" : "", click: () => state.select({ side }) }, side === "left_" ? "Left" : "Right")
      )
    );
    byId("driver").replaceChildren(...driveChoices(state));
  }
  function tool(which) {
    plane.finish(true);
    if (which === "branch" && !state.wrinkle && (state.set?.wrinkles.length ?? 0) === 0) which = "draw";
    state.tool = which;
    say(HINTS[which], "");
    state.tell("look");
  }
  async function mode(which) {
    if (state.mode === which) return;
    plane.finish(false);
    state.mode = which;
    document.body.classList.toggle("photograph", which === "photograph");
    byId("mode-wrinkles").classList.toggle("chosen", which === "wrinkles");
    byId("mode-photograph").classList.toggle("chosen", which === "photograph");
    if (which === "wrinkles") {
      link2.anew();
      return;
    }
    try {
      await pins.enter();
      figure.whole();
    } catch (fault) {
      say(fault instanceof Error ? fault.message : String(fault), "fault");
    }
  }
  async function save2() {
    say(`Writing ${opened.saves} …`, "busy");
    const form = structuredClone(state.form);
    try {
      const done = await save(opened.session, form, opened.revision);
      opened.revision = done.revision;
      state.saved = JSON.stringify(form);
      say(speaksJapanese() ? `保存しました: ${done.files.join("、")}` : `Saved ${done.files.join(" and ")}`, "good");
    } catch (fault) {
      const conflict = fault instanceof Refusal && fault.status === 409;
      const text2 = fault instanceof Error ? fault.message : String(fault);
      const again = speaksJapanese() ? "ページを再読み込みすると、保存されたものが開きます。" : "Reload the page to have what was saved.";
      say(`${said("Not saved")}: ${text2}${conflict ? `. ${again}` : ""}`, "fault");
    }
    follow();
  }
  function undone(label, what) {
    if (speaksJapanese()) say(label ? `${said(what)}: ${said(label)}` : `${said(what)}: なし`);
    else say(label ? `${what} ${label.toLowerCase()}` : `Nothing to ${what.toLowerCase()}`);
  }
  const click = (id, act) => byId(id).addEventListener("click", act);
  click("undo", () => undone(state.undo(), "Undo"));
  click("redo", () => undone(state.redo(), "Redo"));
  click("save", () => void save2());
  click("help", () => byId("keys").showModal());
  click("keys-close", () => byId("keys").close());
  click("mode-wrinkles", () => void mode("wrinkles"));
  click("mode-photograph", () => void mode("photograph"));
  click("photograph", () => byId("photograph-file").click());
  click("tool-select", () => tool("select"));
  click("tool-draw", () => tool("draw"));
  click("tool-branch", () => tool("branch"));
  click("held", () => {
    state.held = !state.held;
    state.tell("look");
  });
  click("seek", () => link2.ask({ seek: true, focus: true }));
  click("whole", () => figure.whole());
  click("plain", () => {
    figure.plain = !figure.plain;
    byId("plain").classList.toggle("chosen", figure.plain);
    figure.redraw();
  });
  click("bends-reset", () => bends.reset());
  click("frame", () => plane.frame());
  const shapes = byId("add-shape");
  for (const [name, shape] of Object.entries(opened.shapes))
    shapes.append(make("option", { value: name, title: shape.about }, words(name)));
  shapes.addEventListener("change", () => {
    if (shapes.value) addShape(state, shapes.value);
    shapes.value = "";
  });
  const regions = byId("add-set");
  for (const region of opened.regions)
    if (Object.keys(region.planes).length > 0) regions.append(make("option", { value: region.name }, words(region.name)));
  regions.addEventListener("change", () => {
    if (regions.value) addSet(state, regions.value);
    regions.value = "";
  });
  const keys = {
    v: () => tool("select"),
    p: () => tool("draw"),
    b: () => tool("branch"),
    d: () => duplicate(state),
    f: () => plane.frame(),
    h: () => byId("held").click(),
    g: () => byId("seek").click(),
    "?": () => byId("help").click(),
    "[": () => turn(state, 5),
    "]": () => turn(state, -5),
    "-": () => turn(state, 0, 1 / 1.05),
    "+": () => turn(state, 0, 1.05),
    "=": () => turn(state, 0, 1.05),
    Delete: () => state.mode === "photograph" ? pins.remove() : remove(state),
    Backspace: () => state.mode === "photograph" ? pins.remove() : remove(state),
    Enter: () => void plane.finish(true),
    Escape: () => {
      if (!plane.finish(false)) state.select({ wrinkle: -1 });
      state.tool = "select";
      state.tell("look");
    }
  };
  const arrows = {
    ArrowLeft: [-1, 0],
    ArrowRight: [1, 0],
    ArrowUp: [0, 1],
    ArrowDown: [0, -1]
  };
  window.addEventListener("keydown", (e) => {
    if (byId("keys").open) return;
    const command = e.ctrlKey || e.metaKey;
    const key = e.key.length === 1 ? e.key.toLowerCase() : e.key;
    if (command && key === "s") {
      e.preventDefault();
      void save2();
    } else if (command && (key === "z" || key === "y") && !typing(e)) {
      e.preventDefault();
      if (key === "y" || e.shiftKey) undone(state.redo(), "Redo");
      else undone(state.undo(), "Undo");
    } else if (!command && !e.altKey && !typing(e)) {
      const arrow = arrows[key];
      const tabs = key === "Tab" && document.activeElement === byId("plane") && state.wrinkle;
      if (arrow && state.wrinkle && !(e.target instanceof HTMLInputElement)) {
        const step = e.shiftKey ? 5e-3 : 1e-3;
        nudge(state, [arrow[0] * step, arrow[1] * step]);
      } else if (tabs) {
        const branch = Math.max(0, state.selection.branch);
        const count = state.shape?.branches[branch]?.points.length ?? 1;
        const point = (state.selection.point + (e.shiftKey ? -1 : 1) + count) % count;
        state.select({ branch, point });
      } else if (keys[key]) keys[key]();
      else return;
      e.preventDefault();
    }
  });
  window.addEventListener("beforeunload", (e) => {
    if (state.dirty) e.preventDefault();
  });
  document.body.classList.add("ready");
  const first = state.form.sets.findIndex((s) => s.name === "sleeve_deep");
  state.select({ set: Math.max(0, first) });
  say("Drag a point, or press ? for keys", "");
  Object.assign(window, { studio: { state, plane, drive, figure, link: link2, pins } });
}
var HINTS = {
  select: "",
  draw: "Click points of the curve; Enter or double-click ends it, Esc forgets it",
  branch: "Click on a curve, then points away from it; Enter ends it"
};
sayPage(document.documentElement);
void frame("wrinkles");
begin().catch((fault) => say(fault instanceof Error ? fault.message : String(fault), "fault"));

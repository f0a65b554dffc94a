// What the map shows, from the figures that the gateway sends: parts of the conference, and what flows between them.
import { FEW_MOTIONS, FEW_PICTURES, LATE_MS, LOSSY, OLD_MS, SILENT_S } from "../thresholds";
import type { Device, Flow, Numbers, Service, Site } from "../wire";
import { mapText } from "./words";

/** absent: nothing is there, or flows, now. */
export type Health = "fine" | "bad" | "absent";
export type Kind = Flow["flow"] | "others" | "all";

/** Something that flows. kbit: 0 where it is not known; words: all that is known of it. */
export interface Link {
  id: string;
  kind: Kind;
  label: string;
  figures: string;
  kbit: number;
  back: boolean; // from the router to the part
  health: Health;
  words: string;
}
export interface Chip {
  label: string;
  health: Health;
}
export interface Part {
  id: string;
  name: string;
  beside: string; // people of a site, else what else is known
  chips: Chip[];
  services: string[];
  health: Health;
  words: string;
  links: Link[];
}
export interface Facts {
  sites: Part[];
  router: Part;
  hub: Part[];
}

export function factsOf(numbers: Numbers): Facts {
  const router: Part = { id: "router", name: mapText("router"), beside: "", chips: [], services: [], health: "fine", words: mapText("routerWords"), links: [] };
  return { sites: numbers.sites.map((site) => siteOf(site, numbers)), router, hub: [worldOf(numbers), recorderOf(numbers), consoleOf(numbers)] };
}

function siteOf(site: Site, numbers: Numbers): Part {
  const people = numbers.people.filter((p) => p.site === site.name);
  const devices = numbers.devices.filter((d) => d.site === site.name);
  const nodes = numbers.services.filter((s) => s.site === site.name);
  const services = [...new Set(nodes.flatMap((n) => n.services))];
  const names = people.map((p) => p.shown).join(", ");
  const still = people.some((p) => p.motions_per_s < FEW_MOTIONS || p.age_ms > OLD_MS);
  const muted = people.length > 0 && people.every((p) => p.muted);
  const links = (["motion", "voice", "screen", "command", "reports"] as const).map((kind) => {
    const flow = flowOf(numbers, site.name, kind);
    const old = (flow?.per_s ?? 0) > 0 && (flow?.age_ms ?? 0) > OLD_MS; // of who is shown no more
    const silent = kind === "motion" ? still || old : kind === "reports" && nodes.length > 0 && (flow?.age_ms ?? Infinity) > SILENT_S * 1e3;
    const note = kind === "voice" && muted ? mapText("muted") : undefined;
    return link(kind, site.name, mapText("router"), flow, silent, `site ${site.name} ${kind}`, note);
  });
  const health = nodes.length + people.length === 0 ? "absent" : devices.some(fails) || nodes.some(silentService) ? "bad" : "fine";
  return {
    id: `site ${site.name}`,
    name: site.name,
    beside: names,
    chips: devices.map((d) => ({ label: short(d.name, people.map((p) => p.name)), health: fails(d) ? "bad" : d.state === "absent" ? "absent" : "fine" })),
    services,
    health,
    words: mapText("siteWords", site.name, names || mapText("nobody"), devices.map(deviceWords).join(", ") || mapText("notHere"), services.join(", ") || mapText("notHere")),
    links: [...links, othersOf(site, people.map((p) => p.name))],
  };
}

/** What a site gets of the others, as its renderer and its sound tell. */
function othersOf(site: Site, own: readonly string[]): Link {
  const shows = (site.shows ?? []).filter((name) => !own.includes(name)).length;
  const few = site.pictures_per_s !== undefined && site.pictures_per_s < FEW_PICTURES;
  const silent = (site.silent_s ?? 0) > SILENT_S;
  const told = [];
  if (silent) told.push(mapText("silentFor", (site.silent_s ?? 0).toFixed(0)));
  else if (site.shows) told.push(mapText("shows", shows, (site.delay_ms ?? 0).toFixed(0), (site.pictures_per_s ?? 0).toFixed(1)));
  else if (!site.draws) told.push(mapText("noWall"));
  if (site.voices.length > 0) told.push(mapText("hears", site.voices.length));
  const figures = told.join(" · ") || mapText("unknown");
  const health: Health = site.draws && (silent || few || (site.delay_ms ?? 0) > LATE_MS) ? "bad" : shows + site.voices.length > 0 ? "fine" : "absent";
  const words = mapText("othersAt", mapText("others"), site.name, told.join(", ") || mapText("noFigure"));
  return { id: `site ${site.name} others`, kind: "others", label: mapText("others"), figures, kbit: 0, back: true, health, words };
}

function worldOf(numbers: Numbers): Part {
  const nodes = numbers.services.filter((s) => s.services.includes("world"));
  const [router, world] = [mapText("router"), mapText("world")];
  const state = flowOf(numbers, "", "world");
  const links = [
    link("command", router, world, total(numbers, "command"), false, "world command", undefined, true),
    link("world", world, router, state, state !== undefined && state.age_ms > OLD_MS, "world state"),
    link("force", world, router, flowOf(numbers, "", "force"), false, "world force"),
    link("answer", world, router, flowOf(numbers, "", "answer"), false, "world answer"),
  ];
  return hubPart("world", nodes, links, nodes.length > 0 || state !== undefined);
}

function recorderOf(numbers: Numbers): Part {
  const nodes = numbers.services.filter((s) => s.services.includes("recorder"));
  const runs = nodes.length > 0 && !nodes.some(silentService);
  const words = mapText("linkTo", mapText("all"), mapText("router"), mapText("recorder"), mapText(runs ? "noFigure" : "noneNow"));
  const all: Link = { id: "recorder all", kind: "all", label: mapText("all"), figures: "", kbit: 0, back: true, health: runs ? "fine" : "absent", words };
  return hubPart("recorder", nodes, [all], nodes.length > 0);
}

function consoleOf(numbers: Numbers): Part {
  const nodes = numbers.services.filter((s) => s.services.includes("console"));
  const flows = numbers.flows.filter((f) => f.per_s !== undefined);
  const sum = [mapText("perS", added(flows, "per_s").toFixed(0)), mapText("kbit", spell(added(flows, "kbit_s")))];
  const words = mapText("linkTo", mapText("received"), mapText("router"), mapText("console"), flows.length > 0 ? sum.join(", ") : mapText("noFigure"));
  const received: Link = { id: "console received", kind: "all", label: mapText("received"), figures: flows.length > 0 ? sum.join(" · ") : "", kbit: added(flows, "kbit_s"), back: true, health: "fine", words };
  const part = hubPart("console", nodes, [received], true);
  return { ...part, beside: mapText("viewers", numbers.viewers) };
}

function hubPart(key: "world" | "recorder" | "console", nodes: readonly Service[], links: Link[], here: boolean): Part {
  const silent = nodes.find(silentService);
  const places = nodes.map((n) => n.node).join(", ");
  const beside = silent ? mapText("silentFor", silent.silent_s.toFixed(0)) : places || (here ? "" : mapText("notHere"));
  const words = mapText("partWords", mapText(key), silent || !here ? beside : places ? mapText("runsIn", places) : mapText("unknown"));
  return { id: key, name: mapText(key), beside, chips: [], services: [], health: silent ? "bad" : here ? "fine" : "absent", words, links };
}

function link(kind: Flow["flow"], from: string, to: string, flow: Flow | undefined, silent: boolean, id: string, note?: string, back = false): Link {
  const label = mapText(kind === "world" ? "state" : kind);
  const lossy = (flow?.lost ?? 0) > LOSSY;
  const flows = flow !== undefined && (flow.per_s === undefined || flow.per_s > 0);
  const health: Health = silent || (flows && lossy) ? "bad" : flows ? "fine" : "absent";
  const figures = flows ? figuresOf(flow) : [silent ? mapText("silent") : (note ?? mapText("nothing"))];
  if (silent && flow && flow.age_ms > OLD_MS && !flows) figures.push(mapText("silentFor", (flow.age_ms * 1e-3).toFixed(0)));
  const told = flows ? wordsOf(flow) : (note ?? mapText("noneNow"));
  const shown = silent && !flows ? figures.slice(-1) : figures;
  return { id, kind, label, figures: shown.join(" · "), kbit: flow?.kbit_s ?? 0, back, health, words: mapText("linkTo", label, from, to, told) };
}

function figuresOf(flow: Flow): string[] {
  const told = [];
  if (flow.per_s !== undefined) told.push(mapText("perS", flow.per_s.toFixed(flow.per_s < 10 ? 1 : 0)));
  if (flow.kbit_s !== undefined) told.push(mapText("kbit", spell(flow.kbit_s)));
  told.push(mapText("ms", flow.age_ms.toFixed(0)));
  if ((flow.lost ?? 0) > 0) told.push(mapText("lost", ((flow.lost ?? 0) * 100).toFixed(1)));
  return told;
}

function wordsOf(flow: Flow): string {
  const told = [];
  if (flow.per_s !== undefined) told.push(mapText("messages", flow.per_s.toFixed(flow.per_s < 10 ? 1 : 0)));
  if (flow.kbit_s !== undefined) told.push(mapText("kbit", spell(flow.kbit_s)));
  told.push(mapText("age", flow.age_ms.toFixed(0)));
  if (flow.lost !== undefined) told.push(flow.lost > 0 ? mapText("lost", (flow.lost * 100).toFixed(1)) : mapText("noneLost"));
  return told.join(", ");
}

function flowOf(numbers: Numbers, site: string, flow: Flow["flow"]): Flow | undefined {
  return numbers.flows.find((f) => f.site === site && f.flow === flow);
}

/** What all sites send of a kind. */
function total(numbers: Numbers, flow: Flow["flow"]): Flow | undefined {
  const flows = numbers.flows.filter((f) => f.flow === flow && f.per_s !== undefined);
  if (flows.length === 0) return undefined;
  return { site: "", flow, age_ms: Math.min(...flows.map((f) => f.age_ms)), per_s: added(flows, "per_s"), kbit_s: added(flows, "kbit_s") };
}

function added(flows: readonly Flow[], what: "per_s" | "kbit_s"): number {
  return flows.reduce((sum, flow) => sum + (flow[what] ?? 0), 0);
}

function fails(device: Device): boolean {
  return device.state !== "streaming" && device.state !== "absent";
}

function silentService(service: Service): boolean {
  return service.silent_s > SILENT_S;
}

function deviceWords(device: Device): string {
  if (device.state === "streaming") return mapText("deviceSends", device.name, device.frames_per_s.toFixed(0));
  return device.state === "absent" ? mapText("deviceAbsent", device.name) : mapText("deviceIs", device.name, device.detail || device.state);
}

/** A device's name without that of its person, which stands beside it. */
function short(name: string, people: readonly string[]): string {
  const owner = people.length === 1 ? people.find((p) => name.startsWith(`${p}-`)) : undefined;
  return owner ? name.slice(owner.length + 1) : name;
}

function spell(kbit: number): string {
  return kbit.toFixed(kbit < 100 ? 1 : 0);
}

// How it goes: what is wrong, which stands on top, and sites, people, devices and services.
import type { ComponentChildren } from "preact";
import type { History } from "./history";
import { panelText } from "./panel_words";
import { FEW_MOTIONS, FEW_PICTURES, LATE_MS, OFF_MS, OLD_MS, SILENT_S } from "./thresholds";
import type { Device, Numbers, Site } from "./wire";

const WIDE = 56;
const HIGH = 18;

export function Goes({ numbers, history }: { numbers: Numbers; history: History }) {
  const sending = numbers.devices.filter((d) => d.state === "streaming");
  const absent = numbers.devices.filter((d) => d.state === "absent");
  const down = numbers.devices.filter((d) => d.state !== "streaming" && d.state !== "absent");
  return (
    <>
      <Rows title={panelText("sites")} heads={[panelText("site"), panelText("perS"), "", panelText("delay"), panelText("devicesHead")]}>
        {numbers.sites.map((s) => (
          <tr key={s.name}>
            <th scope="row">{s.name}</th>
            <Figure value={s.draws ? s.pictures_per_s : undefined} bad={(v) => v < FEW_PICTURES || (s.silent_s ?? 0) > SILENT_S} digits={1} />
            <Spark of={s.pictures_per_s === undefined ? [] : history.of(`${s.name} pictures`)} />
            <Figure value={s.delay_ms} bad={(v) => v > LATE_MS} unit="ms" />
            <Sending site={s} known={numbers.devices.length > 0} />
          </tr>
        ))}
      </Rows>
      <Rows title={panelText("people")} heads={[panelText("person"), panelText("motionsPerS"), "", panelText("age"), panelText("jitter"), panelText("shownAfter")]}>
        {numbers.people.map((p) => (
          <tr key={p.name}>
            <th scope="row">{p.shown}</th>
            <Figure value={p.motions_per_s} bad={(v) => v < FEW_MOTIONS} />
            <Spark of={history.of(`${p.name} motions`)} />
            <Figure value={p.age_ms} bad={(v) => v > OLD_MS} unit="ms" />
            <Figure value={p.jitter_ms} unit="ms" digits={1} />
            <Figure value={p.delay_ms} bad={(v) => v > LATE_MS} unit="ms" />
          </tr>
        ))}
      </Rows>
      {numbers.devices.length > 0 && <Rows title={panelText("devices", sending.length, sending.length + down.length)} heads={[panelText("device"), panelText("framesPerS"), panelText("state")]}>
        {[...down, ...sending, ...absent].map((d) => (
          <DeviceRow key={d.name} device={d} />
        ))}
      </Rows>}
      {numbers.services.length > 0 && <Rows title={panelText("services")} heads={[panelText("process"), panelText("runs"), panelText("up"), panelText("clock")]} words={1}>
        {numbers.services.map((s) => (
          <tr key={s.node} class={s.silent_s > SILENT_S ? "bad" : ""}>
            <th scope="row">{s.node}</th>
            <td class="words">{s.services.join(", ")}</td>
            <td class="number">{s.silent_s > SILENT_S ? panelText("silent", s.silent_s.toFixed(0)) : spell(s.up_s)}</td>
            <td class={`number ${(s.uncertainty_ms ?? 0) > OFF_MS ? "bad" : ""}`}>
              {s.clock_ms === undefined ? "–" : `${tenths(s.clock_ms)} ± ${(s.uncertainty_ms ?? 0).toFixed(1)} ms`}
            </td>
          </tr>
        ))}
      </Rows>}
    </>
  );
}

/** How many of a site's devices send; known: whether any device has told how it does, which a log may lack. */
function Sending({ site: { sending, devices }, known }: { site: Site; known: boolean }) {
  if (!known || devices === 0) return <td class="number">–</td>;
  return <td class={`number ${sending < devices ? "bad" : ""}`}>{panelText("ofAll", sending, devices)}</td>;
}

export function Troubles({ numbers: { troubles: lines, services } }: { numbers: Numbers }) {
  if (lines.length === 0) return services.length > 0 ? <p class="well">{panelText("well")}</p> : null; // of what is silent nothing is known
  return (
    <ul class="troubles" role="alert">
      {lines.map((line) => (
        <li key={line}>{line}</li>
      ))}
    </ul>
  );
}

/** words: which column beside the first one is of words, not of numbers. */
function Rows({ title, heads, words, children }: { title: string; heads: string[]; words?: number; children: ComponentChildren }) {
  return (
    <section>
      <h2>{title}</h2>
      <div class="scrolls">
        <table>
          <thead>
            <tr>
              {heads.map((head, n) => (
                <th key={n} scope="col" class={n > 0 && n !== words && head ? "number" : ""}>
                  {head}
                </th>
              ))}
            </tr>
          </thead>
          <tbody>{children}</tbody>
        </table>
      </div>
    </section>
  );
}

function Figure({ value, unit, digits, bad }: { value: number | undefined; unit?: string; digits?: number; bad?: (v: number) => boolean }) {
  if (value === undefined) return <td class="number">–</td>;
  return <td class={`number ${bad?.(value) ? "bad" : ""}`}>{value.toFixed(digits ?? 0) + (unit ? ` ${unit}` : "")}</td>;
}

function DeviceRow({ device }: { device: Device }) {
  const words = device.state === "streaming" ? panelText("sends") : device.state === "absent" ? panelText("absent") : "";
  return (
    <tr class={device.state === "absent" ? "absent" : ""}>
      <th scope="row">{device.name}</th>
      <Figure value={device.state === "absent" ? undefined : device.frames_per_s} />
      <td class={words ? "number" : "number bad"} title={device.detail}>
        {words || device.state}
      </td>
    </tr>
  );
}

/** The last ten minutes as a line; how much is in the number beside it. */
function Spark({ of }: { of: readonly number[] }) {
  if (of.length < 2) return <td class="spark" />;
  const most = Math.max(1e-9, ...of);
  const step = WIDE / Math.max(60, of.length - 1);
  const points = of.map((v, n) => `${(WIDE - (of.length - 1 - n) * step).toFixed(1)},${(HIGH - 1 - (v / most) * (HIGH - 2)).toFixed(1)}`);
  return (
    <td class="spark">
      <svg width={WIDE} height={HIGH} aria-hidden="true">
        <polyline points={points.join(" ")} />
      </svg>
    </td>
  );
}

/** To one decimal; nothing is "-0.0". */
function tenths(value: number): string {
  return (Math.round(10 * value) / 10 + 0).toFixed(1);
}

function spell(seconds: number): string {
  if (seconds < 60) return panelText("seconds", seconds.toFixed(0));
  return seconds < 3600 ? panelText("minutes", (seconds / 60).toFixed(0)) : panelText("hours", (seconds / 3600).toFixed(1));
}

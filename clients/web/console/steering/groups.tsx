// What the host can start and stop, whom they can mute, seat and remove, and which faults they can cause.
import { useState } from "preact/hooks";
import type { FaultRow, ProcessRow, SeatRow, Steering } from "../wire";
import type { Question } from "./confirm";
import { faultText, said } from "./words";

export type Action = "ask" | "move" | "fault" | "start" | "stop" | "restart" | "mute" | "seat" | "remove";
/** Asks for an action; text: what it is done to, for the list of answers. */
export type Do = (action: Action, text: string, words: Record<string, string>) => void;

interface Can {
  act: Do;
  confirm(question: Question): void;
}

const RECORDERS = ["hub/recorder", "hub/record"];

/** What the host did, as the button says that they pressed. */
export function deed(action: Action, text: string): string {
  if (action === "stop" && RECORDERS.includes(text)) return said("endRecording");
  if (action === "start" && RECORDERS.includes(text)) return said("record");
  return said(`did_${action}`, text);
}

export function Recording({ processes, act, confirm }: Can & { processes: readonly ProcessRow[] }) {
  const recorder = processes.find(({ name }) => RECORDERS.includes(name));
  if (!recorder) return null;
  const off = recorder.state === "stopped";
  const words = { process: recorder.name };
  const end = () =>
    confirm({ title: said("endRecording"), about: said("aboutEndRecording"), yes: said("endRecording"), then: () => act("stop", recorder.name, words) });
  return (
    <p class="recording">
      <span class={off ? "" : "on"}>{said(off ? "recordingOff" : "recordingOn")}</span>
      <button type="button" disabled={["starting", "ending"].includes(recorder.state)} onClick={off ? () => act("start", recorder.name, words) : end}>
        {said(off ? "record" : "endRecording")}
      </button>
    </p>
  );
}

export function Processes({ processes, act, confirm }: Can & { processes: readonly ProcessRow[] }) {
  return (
    <div class="scrolls">
      <table>
        <thead>
          <tr><th scope="col">{said("process")}</th><th scope="col">{said("state")}</th><th /></tr>
        </thead>
        <tbody>
          {processes.filter(({ name }) => name !== "hub/record").map(({ name, state, restarts }) => {
            const words = { process: name };
            const ask = (action: "stop" | "restart") =>
              confirm({ title: said(`${action}It`, name), about: said(action === "stop" ? "aboutStop" : "aboutRestart"), yes: said(action), then: () => act(action, name, words) });
            return (
              <tr key={name}>
                <th scope="row">{name}</th>
                <td class={state === "running" ? "" : "notice"}>{state === "running" && restarts ? said("startedAgain", restarts) : said(state)}</td>
                <td class="does">
                  {state === "stopped"
                    ? <button type="button" aria-label={said("startIt", name)} onClick={() => act("start", name, words)}>{said("start")}</button>
                    : <>
                        <button type="button" disabled={state !== "running"} aria-label={said("restartIt", name)} onClick={() => ask("restart")}>{said("restart")}</button>
                        <button type="button" disabled={state === "ending" || name === "hub/console"} aria-label={said("stopIt", name)} onClick={() => ask("stop")}>{said("stop")}</button>
                      </>}
                </td>
              </tr>
            );
          })}
        </tbody>
      </table>
    </div>
  );
}

/** Where the room is led, and where it can be moved to. */
export function Worlds({ worlds, act }: Pick<Can, "act"> & { worlds: Steering["worlds"] }) {
  return (
    <ul class="seats">
      {worlds.map(({ place, leads }) => (
        <li key={place}>
          <span>{place} <small>{said(leads ? "leads" : "waits")}</small></span>
          {!leads && <button type="button" aria-label={said("moveTo", place)} onClick={() => act("move", place, { place })}>{said("move")}</button>}
        </li>
      ))}
    </ul>
  );
}

export function People({ people, links, act, confirm }: Can & { people: readonly SeatRow[]; links: ReadonlyMap<string, string> }) {
  const [name, setName] = useState("");
  const guests = people.some(({ guest }) => guest);
  const seat = (event: SubmitEvent) => {
    event.preventDefault();
    if (!name.trim()) return;
    act("seat", name.trim(), { name: name.trim() });
    setName("");
  };
  return (
    <>
      <ul class="seats">
        {people.map(({ name, shown, site, guest, invited, speaks }) => {
          const words = { participant: name };
          const remove = () => confirm({ title: said("removeThem", invited), about: said("aboutRemove"), yes: said("remove"), then: () => act("remove", name, words) });
          return (
            <li key={name}>
              <span>{shown} <small>{!guest ? site : invited ? said("seatOf", invited) : said("seatFree")}</small></span>
              {(!guest || invited) && (
                <button type="button" disabled={!speaks} title={speaks ? undefined : said("noMicrophone")} aria-label={said("muteThem", invited || shown)}
                  onClick={() => act("mute", invited || shown, words)}>{said("mute")}</button>
              )}
              {invited && <button type="button" aria-label={said("removeThem", invited)} onClick={remove}>{said("remove")}</button>}
            </li>
          );
        })}
      </ul>
      {guests && (
        <form class="seat" onSubmit={seat}>
          <input name="guest" maxLength={40} required autocomplete="off" aria-label={said("guestName")} placeholder={said("guestName")} value={name}
            onInput={(event) => setName(event.currentTarget.value)} />
          <button type="submit">{said("seatThem")}</button>
        </form>
      )}
      {[...links].map(([guest, link]) => <Link key={link} guest={guest} link={link} />)}
    </>
  );
}

function Link({ guest, link }: { guest: string; link: string }) {
  const [copied, setCopied] = useState(false);
  return (
    <p class="link">
      <label>
        {said("link", guest)}
        <input readOnly value={link} onFocus={(event) => event.currentTarget.select()} />
      </label>
      <button type="button" onClick={() => void navigator.clipboard?.writeText(link).then(() => setCopied(true))}>{said(copied ? "copied" : "copy")}</button>
    </p>
  );
}

export function Faults({ faults, act, confirm }: Can & { faults: readonly FaultRow[] }) {
  const [name, setName] = useState("");
  const [target, setTarget] = useState("");
  const fault = faults.find((one) => one.name === name) ?? faults[0];
  if (!fault) return null;
  const of = fault.targets.includes(target) ? target : (fault.targets[0] ?? "");
  const about = faultText(fault.name, fault.about);
  const lasts = fault.seconds ? said("lasts", fault.seconds) : "";
  const text = `${fault.name} ${of}`.trim();
  const ask = () =>
    confirm({ title: said("strikeIt", text), about: `${about} ${lasts}`.trim(), yes: said("strikeIt", fault.name), then: () => act("fault", text, { name: fault.name, target: of }) });
  return (
    <div class="faults">
      <select name="fault" aria-label={said("fault")} value={fault.name} onChange={(event) => setName(event.currentTarget.value)}>
        {faults.map((one) => <option key={one.name} value={one.name}>{one.name}</option>)}
      </select>
      {fault.targets.length > 0 && (
        <select name="target" aria-label={said("target")} value={of} onChange={(event) => setTarget(event.currentTarget.value)}>
          {fault.targets.map((one) => <option key={one} value={one}>{one}</option>)}
        </select>
      )}
      <button type="button" class="grave" onClick={ask}>{said("strike")}</button>
      <p>{about} {lasts}</p>
    </div>
  );
}

// The page's worker: the connection, and the way of all voices, decoded for the browser's thread for sound and encoded from there.
import { ConferenceTime } from "./conference_time";
import { Hearing } from "./hearing";
import { SCREENS, VOICES } from "./kinds";
import type { FromWorker, ToWorker } from "./messages";
import { Socket } from "./socket";
import { Speaking } from "./speaking";

const TIME_AT = 4; // bytes from the beginning of a record
const tell = (said: FromWorker, transfer: Transferable[] = []) => postMessage(said, { transfer });
let socket: Socket | null = null;
let newest: ArrayBuffer | null = null; // frame that waits: a page that is slow gets the newest only
let taking = false; // the page has not yet taken the last one
let time: ConferenceTime | null = null; // of a guest, who speaks by it
const hearing = new Hearing(
  (name, port) => tell({ kind: "talker", name, port }, [port]),
  (name) => tell({ kind: "silent", name }),
);
const speaking = new Speaking(
  (ms) => time?.at(ms) ?? null,
  (record) => socket?.send(record),
  (level, bytes) => tell({ kind: "spoken", level, bytes }),
  () => tell({ kind: "speechless" }),
);

function show(frame: ArrayBuffer | null): void {
  newest = frame;
  if (!newest || taking) return;
  tell({ kind: "frame", data: newest }, [newest]);
  [newest, taking] = [null, true];
}

/** Landmarks of a picture, with the conference time at which it was taken (vistel/protocol/pages/camera_body.py). */
function see(data: ArrayBuffer, at: number): void {
  const ms = time?.at(at - performance.timeOrigin) ?? null;
  if (ms === null) return;
  new DataView(data).setFloat64(TIME_AT, ms, true);
  socket?.send(data);
}

function open(address: string, first: string | undefined): void {
  socket = new Socket(
    address,
    {
      words: (words) => {
        if (words.kind === "time") return time?.hear(words.asked, words.ms);
        if (words.kind === "invited") time ??= new ConferenceTime((asked) => socket?.send(asked));
        tell({ kind: "words", words });
      },
      data: (data) => {
        const kind = new Uint8Array(data)[0];
        if (kind === VOICES) hearing.take(data);
        else if (kind === SCREENS) tell({ kind: "screen", data }, [data]);
        else show(data);
      },
      trouble: (text) => tell({ kind: "trouble", text }),
    },
    first,
  );
}

onmessage = ({ data }: MessageEvent<ToWorker>) => {
  if (data.kind === "open") open(data.address, data.first);
  else if (data.kind === "send") socket?.send(data.data);
  else if (data.kind === "seen") see(data.data, data.at);
  else if (data.kind === "next") show(((taking = false), newest));
  else if (data.kind === "look") socket?.look();
  else if (data.kind === "hear") hearing.turn(data.hears);
  else if (data.kind === "microphone") speaking.begin(data.port, data.latencyMs);
  else speaking.on = data.speaks;
};

// The studio's server: requests, and the arrays in its answers (vistel_cli.studio.wrinkles.envelope).

import type { Form, Opened, Updated } from "./types";

export type Arrays = Record<string, Float32Array | Uint32Array | Uint8Array>;

/** What the server said against a request. */
export class Refusal extends Error {
  constructor(
    text: string,
    readonly status: number,
  ) {
    super(text);
  }
}

export interface UpdateRequest {
  form?: Form;
  bends: Record<string, number>;
  held: string[];
  plane?: { set: number; side: string };
  seek?: { set: number; side: string };
  focus?: { set: number; side: string };
  have: number;
  /** Also what never changes while the texture lies as it does. */
  whole?: boolean;
}

const page = Math.random().toString(36).slice(2);

export async function open(): Promise<{ head: Opened; arrays: Arrays }> {
  return unpacked<Opened>(await post("api/open", { page }));
}

export async function update(session: string, asked: UpdateRequest): Promise<{ head: Updated; arrays: Arrays }> {
  return unpacked<Updated>(await post("api/update", { ...asked, session, page }));
}

export async function save(
  session: string,
  form: Form,
  revision: string,
): Promise<{ revision: string; files: string[] }> {
  return (await post("api/save", { session, form, revision, page })).json();
}

/** Says what the server does for this page, "" where nothing. */
export async function doing(): Promise<string> {
  const answer = await fetch(`api/doing?page=${page}`);
  return answer.ok ? ((await answer.json()) as { doing: string }).doing : "";
}

export function albedoAddress(session: string, version: number): string {
  return `api/albedo?session=${encodeURIComponent(session)}&version=${version}`;
}

export async function post(path: string, body: unknown): Promise<Response> {
  return sent(path, JSON.stringify(body), "application/json");
}

async function sent(path: string, body: BodyInit, type: string): Promise<Response> {
  let answer: Response;
  try {
    answer = await fetch(path, { method: "POST", headers: { "Content-Type": type }, body });
  } catch {
    throw new Refusal("The studio does not answer; is it still running?", 0);
  }
  if (!answer.ok) {
    const said = (await answer.json().catch(() => ({}))) as { error?: string };
    throw new Refusal(said.error ?? `the studio said ${answer.status}`, answer.status);
  }
  return answer;
}

/** Brings a photograph for an island of the avatar `base`. */
export async function picture(
  session: string,
  island: number,
  base: number,
  file: File,
): Promise<{ base: number; notes: string[] }> {
  const address = `api/picture?session=${encodeURIComponent(session)}&island=${island}&base=${base}&page=${page}`;
  return (await sent(address, file, "application/octet-stream")).json();
}

const KINDS = { f4: Float32Array, u4: Uint32Array, u1: Uint8Array };

export async function unpacked<T>(answer: Response): Promise<{ head: T; arrays: Arrays }> {
  const data = await answer.arrayBuffer();
  const length = new DataView(data).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length))) as T & {
    arrays: { name: string; kind: keyof typeof KINDS; shape: number[] }[];
  };
  const arrays: Arrays = {};
  let at = 4 + length;
  for (const { name, kind, shape } of head.arrays) {
    const count = shape.reduce((a, b) => a * b, 1);
    const array = new KINDS[kind](data, at, count);
    arrays[name] = array;
    at += Math.ceil(array.byteLength / 4) * 4;
  }
  return { head, arrays };
}

/** Requests to the server: a token if the page was opened with one, and errors as the library's sentence. */

import { newId } from "../project/model";

/** `crypto.randomUUID` is for pages from this machine or over https alone. */
export const CLIENT = newId();
const TOKEN = new URLSearchParams(globalThis.location?.search).get("token");

/** Status of what finds no room on the server's disk. */
export const FULL = 507;

/** What the server refused; `message` is its sentence. */
export class Refused extends Error {
  constructor(
    message: string,
    readonly status: number,
    /** Keys of what was sent that are the cause, such as `segments[1].goal`; empty: not known. */
    readonly where = "",
    /** What came with the sentence. */
    readonly about: Readonly<Record<string, unknown>> = {},
  ) {
    super(message);
  }
}

/** Nobody answered. */
export class Unreachable extends Error {
  constructor() {
    super("The server does not answer; your work is kept in this page and goes on when it is back.");
  }
}

export function headers(extra: Record<string, string> = {}): Record<string, string> {
  return { "X-Client": CLIENT, ...(TOKEN ? { Authorization: `Bearer ${TOKEN}` } : {}), ...extra };
}

/** The answer, if it is a good one. */
export async function request(path: string, init: RequestInit = {}): Promise<Response> {
  let response: Response;
  try {
    response = await fetch(path, { ...init, headers: headers(init.headers as Record<string, string>) });
  } catch (error) {
    if (error instanceof DOMException && error.name === "AbortError") throw error;
    throw new Unreachable();
  }
  if (response.ok) return response;
  throw await refusal(response);
}

export async function getJson<T>(path: string, init: RequestInit = {}): Promise<T> {
  return (await request(path, init)).json() as Promise<T>;
}

/** Text as the server takes it: without control characters, and U+FFFD for half of an emoji that something cut. */
export function plainText(text: string): string {
  return text.replace(/[\0-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f]/g, "").replace(/[\ud800-\udfff]/gu, "\ufffd");
}

/** A value as JSON whose texts the server takes. */
export function plainJson(value: unknown): string {
  return JSON.stringify(value, (_, one: unknown) => (typeof one === "string" ? plainText(one) : one));
}

export function json(method: string, body: unknown): RequestInit {
  return { method, body: plainJson(body), headers: { "Content-Type": "application/json" } };
}

async function refusal(response: Response): Promise<Refused> {
  try {
    const { error, where, ...about } = (await response.json()) as Record<string, unknown>;
    if (typeof error === "string")
      return new Refused(error, response.status, typeof where === "string" ? where : "", about);
  } catch {
    /* not the server's own answer */
  }
  return new Refused(`The server answered ${response.status} ${response.statusText}.`, response.status);
}

/** Where a path of the server is as a WebSocket, which sends its token in the address. */
export function webSocketAddress(path: string): string {
  const address = new URL(path, location.href);
  address.protocol = address.protocol === "https:" ? "wss:" : "ws:";
  address.search = TOKEN ? new URLSearchParams({ token: TOKEN }).toString() : "";
  return address.href;
}

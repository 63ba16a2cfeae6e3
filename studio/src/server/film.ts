/** A film of pictures that the page draws: sent one after the other, encoded by the server as they come. */

import { Refused, Unreachable, webSocketAddress } from "./http";

export interface FilmAsked {
  readonly format: "mp4" | "gif";
  readonly width: number;
  readonly height: number;
  readonly fps: number;
  readonly count: number;
}

/** Bytes of one message. */
const PIECE = 1 << 17;

/**
 * The film of `count` pictures; `picture` draws the n-th, `seen` hears how many are done.
 *
 * Nothing is left of it anywhere if `signal` is aborted. Raises `Refused` with the server's sentence, and `Unreachable`.
 */
export function writeFilm(
  asked: FilmAsked,
  picture: (number: number) => Promise<Blob>,
  seen: (done: number) => void,
  signal: AbortSignal,
): Promise<Blob> {
  const socket = new WebSocket(webSocketAddress("film"));
  let next: Promise<Blob> | null = null;
  let missing = Infinity;
  let over = false;
  const parts: Blob[] = [];
  const heard = async (said: { done?: number; size?: number; error?: string }) => {
    if (said.error !== undefined) throw new Refused(said.error, 400);
    if (said.size !== undefined) missing = said.size;
    if (said.done === undefined) return;
    seen(said.done);
    const drawn = await (next ?? picture(0));
    if (over) return;
    send(socket, drawn);
    // The next one is drawn while this one is encoded.
    next = said.done + 1 < asked.count ? picture(said.done + 1) : null;
    next?.catch(() => undefined);
  };
  return new Promise<Blob>((done, fail) => {
    signal.addEventListener("abort", () => fail(signal.reason));
    socket.addEventListener("open", () => socket.send(JSON.stringify(asked)));
    socket.addEventListener("close", () => fail(new Unreachable()));
    socket.addEventListener("message", ({ data }: MessageEvent<string | Blob>) => {
      if (typeof data === "string") return void heard(JSON.parse(data) as object).catch(fail);
      parts.push(data);
      missing -= data.size;
      if (missing <= 0) done(new Blob(parts, { type: asked.format === "gif" ? "image/gif" : "video/mp4" }));
    });
  }).finally(() => {
    over = true;
    socket.close();
  });
}

/** A picture behind the number of its bytes. */
function send(socket: WebSocket, picture: Blob): void {
  const head = new DataView(new ArrayBuffer(4));
  head.setUint32(0, picture.size, true);
  const data = new Blob([head, picture]);
  for (let at = 0; at < data.size; at += PIECE) socket.send(data.slice(at, at + PIECE));
}

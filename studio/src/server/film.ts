/** A film of pictures of the page: sent one after the other, encoded by the server as they arrive. */

import { Refused, Unreachable, webSocketAddress } from "./http";

export interface FilmFormat {
  readonly format: "mp4" | "gif";
  readonly width: number;
  readonly height: number;
  readonly fps: number;
  readonly count: number;
}

/** Bytes of one message. */
const PIECE = 1 << 17;

/**
 * The film of `count` pictures; `picture` draws the n-th, `progress` is called with how many are done.
 *
 * Nothing is left of it anywhere if `signal` is aborted. Raises `Refused` with the server's sentence, and `Unreachable`.
 */
export function writeFilm(
  format: FilmFormat,
  picture: (number: number) => Promise<Blob>,
  progress: (done: number) => void,
  signal: AbortSignal,
): Promise<Blob> {
  const socket = new WebSocket(webSocketAddress("film"));
  let next: Promise<Blob> | null = null;
  let missing = Infinity;
  let over = false;
  const parts: Blob[] = [];
  const receive = async (message: { done?: number; size?: number; error?: string }) => {
    if (message.error !== undefined) throw new Refused(message.error, 400);
    if (message.size !== undefined) missing = message.size;
    if (message.done === undefined) return;
    progress(message.done);
    const blob = await (next ?? picture(0));
    if (over) return;
    send(socket, blob);
    // The next one is rendered while this one is encoded.
    next = message.done + 1 < format.count ? picture(message.done + 1) : null;
    next?.catch(() => undefined);
  };
  return new Promise<Blob>((done, fail) => {
    signal.addEventListener("abort", () => fail(signal.reason));
    socket.addEventListener("open", () => socket.send(JSON.stringify(format)));
    socket.addEventListener("close", () => fail(new Unreachable()));
    socket.addEventListener("message", ({ data }: MessageEvent<string | Blob>) => {
      if (typeof data === "string") return void receive(JSON.parse(data) as object).catch(fail);
      parts.push(data);
      missing -= data.size;
      if (missing <= 0) done(new Blob(parts, { type: format.format === "gif" ? "image/gif" : "video/mp4" }));
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

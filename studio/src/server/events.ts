/** Server-sent events over fetch, which can send a token where EventSource cannot. */

import { request } from "./http";

export interface ServerEvent {
  readonly name: string;
  readonly data: string;
}

/** Call `each` for every event until the stream ends or is aborted. */
export async function follow(path: string, signal: AbortSignal, each: (event: ServerEvent) => void): Promise<void> {
  const response = await request(path, { signal, headers: { Accept: "text/event-stream" } });
  const reader = response.body!.pipeThrough(new TextDecoderStream()).getReader();
  let rest = "";
  for (;;) {
    const { value, done } = await reader.read();
    if (done) return;
    const parsed = events(rest + value);
    rest = parsed.rest;
    for (const event of parsed.events) each(event);
  }
}

/** The whole events in a text, and what is left of the last one. */
export function events(text: string): { events: ServerEvent[]; rest: string } {
  const blocks = text.replaceAll("\r\n", "\n").split("\n\n");
  const rest = blocks.pop()!;
  return { events: blocks.map(event).filter((one) => one.data), rest };
}

function event(block: string): ServerEvent {
  let name = "message";
  const data: string[] = [];
  for (const line of block.split("\n")) {
    if (line.startsWith("event:")) name = line.slice(6).trim();
    else if (line.startsWith("data:")) data.push(line.slice(5).trimStart());
  }
  return { name, data: data.join("\n") };
}

/** A live session over the server's WebSocket (docs/live.md): somebody who is steered while he moves. */

import type { Vec3 } from "../project/model";
import { plainJson, webSocketAddress } from "./http";

export interface Welcome {
  readonly type: "welcome";
  readonly session: string;
  readonly fps: number;
  readonly frame: number;
  readonly parents: readonly number[];
  readonly offsets: readonly Vec3[];
}

export interface LiveFrame {
  readonly type: "frame";
  readonly frame: number;
  readonly time: number;
  readonly root: Vec3;
  readonly rotations: readonly (readonly [number, number, number, number])[];
  readonly words: string;
}

export type LiveMessage =
  | Welcome
  | LiveFrame
  | { readonly type: "health"; readonly problem: string }
  | { readonly type: "error"; readonly message: string; readonly last?: boolean }
  | { readonly type: "closed"; readonly refused: boolean };

const AGAIN = 1000;
/** Connections in a row that the server did not welcome, after which it is said that it has no live mode. */
const REFUSED = 2;

export class LiveClient {
  private socket: WebSocket | null = null;
  private hello: Record<string, unknown>;
  private over = false;
  private unwelcome = 0;

  /** `each` is called with every message of the server, and with `closed` when the connection is lost. */
  constructor(
    private readonly begin: Record<string, unknown>,
    private readonly each: (message: LiveMessage) => void,
  ) {
    this.hello = begin;
    this.open();
  }

  ask(type: string, fields: Record<string, unknown> = {}): void {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(plainJson({ type, ...fields }));
  }

  leave(): void {
    this.over = true;
    this.ask("bye");
    this.socket?.close();
  }

  private open(): void {
    this.socket = new WebSocket(webSocketAddress("live"));
    this.socket.onopen = () => this.ask("hello", this.hello);
    this.socket.onmessage = (event) => this.take(JSON.parse(String(event.data)) as LiveMessage);
    this.socket.onclose = () => {
      if (this.over) return;
      this.unwelcome += 1;
      this.each({ type: "closed", refused: this.unwelcome >= REFUSED });
      setTimeout(() => this.over || this.open(), AGAIN);
    };
  }

  /** The session is gone on with where the connection was lost, if the server still knows it. */
  private take(message: LiveMessage): void {
    if (this.over) return;
    if (message.type === "welcome") {
      this.hello = { session: message.session };
      this.unwelcome = 0;
    }
    if (message.type === "error" && message.last) this.hello = this.begin;
    this.each(message);
  }
}

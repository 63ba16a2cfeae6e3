// One live session over a WebSocket, in plain JavaScript: `new LiveClient(url, {seed: 1}, {frame: pose => ...})`.
// What is asked and answered stands in docs/live.md. A lost connection is taken up again where it was. Of two people
// (hello {people: 2}) `live.of(2).steer(90)` asks the second one; `live` itself asks both.
export class LiveClient {
  constructor(url, hello = {}, on = {}) {
    this.url = url;
    this.hello = hello;
    this.on = on;
    this.open();
  }

  open() {
    this.socket = new WebSocket(this.url);
    this.socket.onopen = () => this.send({ type: "hello", ...this.hello });
    this.socket.onmessage = (event) => this.heard(JSON.parse(event.data));
    this.socket.onclose = () => {
      this.on.closed?.();
      if (!this.over) setTimeout(() => this.open(), 1000);
    };
  }

  heard(said) {
    if (said.type === "welcome") {
      this.skeleton = { names: said.joints, parents: said.parents, offsets: said.offsets };
      this.hello = { session: said.session };
    }
    if (said.type === "error" && said.last && /no such live session/.test(said.message)) this.hello = {};
    this.on[said.type]?.(said);
  }

  of(person) {
    return Object.assign(Object.create(this), { person });
  }

  send(said) {
    const whom = this.person ? { person: this.person } : {};
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify({ ...said, ...whom }));
  }

  say(text) {
    this.send({ type: "say", text });
  }

  // Degrees: 0 is +z, 90 is +x; metres per second. Nothing given: steering ends.
  steer(direction, speed, facing) {
    const asked = Object.entries({ direction, speed, facing }).filter(([, value]) => value != null);
    this.send({ type: "steer", ...Object.fromEntries(asked) });
  }

  path(points, speed) {
    this.send({ type: "path", points, ...(speed ? { speed } : {}) });
  }

  reach(joint, position, within = 0.6) {
    this.send({ type: "reach", joint, position, within });
  }

  record() {
    this.send({ type: "record" });
  }

  bye() {
    this.over = true;
    this.send({ type: "bye" });
  }
}

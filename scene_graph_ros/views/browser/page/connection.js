// Keeps connected to the node: says what is to be shown, hands on what comes, tries again.

import { readBlocks } from "./blocks.js";

const FIRST_PAUSE = 500, LONGEST_PAUSE = 8000;  // ms

export class Connection {
  // onBlocks gets the blocks of each message, onState whether it is open and why not.
  constructor(onBlocks, onState) {
    this.onBlocks = onBlocks;
    this.onState = onState;
    this.wish = { roles: null, contacts: true, camera: "" };
    this.pause = FIRST_PAUSE;
    this.open();
  }

  open() {
    const address = new URL("scene" + location.search, location.href);
    address.protocol = address.protocol === "https:" ? "wss:" : "ws:";
    this.socket = new WebSocket(address);
    this.socket.binaryType = "arraybuffer";
    this.socket.onopen = () => {
      this.pause = FIRST_PAUSE;
      this.onState(true, "connected");
      this.say();
    };
    this.socket.onmessage = (event) => this.onBlocks(readBlocks(event.data));
    this.socket.onclose = (event) => {
      this.onState(false, event.reason || "not connected");
      setTimeout(() => this.open(), this.pause);
      this.pause = Math.min(2 * this.pause, LONGEST_PAUSE);
    };
  }

  // Asks to be shown something else.
  ask(wish) {
    this.wish = { ...this.wish, ...wish };
    if (this.socket.readyState === WebSocket.OPEN) this.say();
  }

  // Asks that a joint moves; what can't be said now is not said later.
  move(robot, joint, position) {
    if (this.socket.readyState !== WebSocket.OPEN) return;
    this.socket.send(JSON.stringify({ robot, joint, position }));
  }

  // Asks for something about a robot's motion; what can't be said now is not said later.
  request(motion) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(motion));
  }

  say() { this.socket.send(JSON.stringify(this.wish)); }
}

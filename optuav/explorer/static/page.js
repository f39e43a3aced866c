// The page of `optuav explore`: asks the server, and keeps the state in the address.
import {render} from "./explorer.js";

const SILENT = "optuav does not answer: is `optuav explore` still running?";

class Model {
  #values = read();
  #listeners = {};

  get(name) {
    return this.#values[name];
  }

  set(name, value) {
    this.#values[name] = value;
    for (const listener of this.#listeners[`change:${name}`] ?? []) listener();
  }

  on(event, listener) {
    (this.#listeners[event] ??= []).push(listener);
  }

  async save_changes() {
    const state = this.get("state");
    let answer = {number: state.number, faults: [{key: "", words: SILENT}]};
    try {
      const headers = {"Content-Type": "application/json"};
      const body = JSON.stringify(state);
      answer = await (await fetch("answers", {method: "POST", headers, body})).json();
    } catch (error) {
      console.warn(error);
    }
    this.set("answer", {number: state.number, ...answer});
  }
}

function read() {
  try {
    return {state: {}, pinned: null, ...JSON.parse(decodeURIComponent(location.hash.slice(1) || "{}"))};
  } catch {
    return {state: {}, pinned: null};
  }
}

const model = new Model();
model.set("link", (states) => {
  const hash = `#${encodeURIComponent(JSON.stringify(states))}`;
  history.replaceState(null, "", hash);
  return location.href;
});
addEventListener("hashchange", () => location.reload());
render({model, el: document.getElementById("explorer")});

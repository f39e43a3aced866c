// The page of `optuav explore`: asks the server, and keeps the state in the address.
import explorer, {Model} from "./explorer.js";

const SILENT = "optuav does not answer: is `optuav explore` still running?";
const UNREAD = "The address cannot be read, so the mission is shown unchanged";

class Served extends Model {
  #open = null;
  give_up() {
    this.#open?.abort();
  }
  async save_changes() {
    const {signal} = (this.#open = new AbortController());
    const state = this.get("state");
    let answer = {number: state.number, faults: [{key: "", words: SILENT}]};
    try {
      const headers = {"Content-Type": "application/json"};
      const body = JSON.stringify(state);
      answer = await (await fetch("answers", {method: "POST", headers, body, signal})).json();
    } catch (error) {
      if (signal.aborted) return;
      console.warn(error);
    }
    this.set("answer", {number: state.number, ...answer});
  }
}

function read() {
  try {
    const stated = JSON.parse(decodeURIComponent(location.hash.slice(1) || "{}"));
    const {state = {}, pinned = null} = stated;
    for (const each of [stated, state, pinned ?? {}]) if (each.constructor !== Object) throw new TypeError();
    return {state, pinned};
  } catch {
    return {faults: [{key: "", words: UNREAD}]};
  }
}

const model = new Served(Object.entries(read()));
model.set("link", (states) => {
  history.replaceState(null, "", `#${encodeURIComponent(JSON.stringify(states))}`);
  return location.href;
});
model.on("change:answer.title", () => {
  const {name} = model.get("answer");
  if (name) document.title = `${name} – optuav explore`;
});
addEventListener("hashchange", () => location.reload());
explorer.render({model, el: document.getElementById("explorer")});

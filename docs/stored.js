// Hands the explorer's page answers that were stored beforehand.

class Stored {
  #values = {state: {}, pinned: null};
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

  save_changes() {
    const {number, perspective, changes} = this.get("state");
    const stated = keys.map(({key, value}) => changes?.[key] ?? value);
    const found = answers[JSON.stringify([perspective ?? "available", ...stated])];
    const words = `answers are stored for ${keys.map(({key, values}) => `${key} = ${values.join(", ")}`).join("; ")}`;
    this.set("answer", {...(found ?? {faults: [{key: "", words}]}), number});
  }
}

render({model: new Stored(), el: document.getElementById("explorer")});

// Hands the explorer's page answers that were stored beforehand.

class Stored extends Model {
  save_changes() {
    const {number, perspective, changes} = this.get("state");
    const stated = keys.map(({key, value}) => changes?.[key] ?? value);
    const found = answers[JSON.stringify([perspective ?? "available", ...stated])];
    const words = `answers are stored for ${keys.map(({label, unit, values}) => `${label} = ${values.join(", ")} ${unit}`).join("; ")}`;
    this.set("answer", {...(found ?? {faults: [{key: "", words}]}), number});
  }
}

// The page around says which theme was chosen there.
addEventListener("message", ({data}) => {
  if (data === "dark" || data === "light") document.documentElement.style.colorScheme = data;
});

const state = Object.fromEntries(new URLSearchParams(location.hash.slice(1))); // Such as #perspective=battery
render({model: new Stored([["state", state]]), el: document.getElementById("explorer")});

// The explorer: it draws answers and computes nothing. `d3`, `Plot` and `LOOKS` stand above this text
// where it is served or handed to a notebook.
import {Controls, presetOf} from "./controls.js";
import {button, make} from "./drawing.js";
import {Column, gripOf, sayBinding, sayVerdict, tables, tabsOf} from "./layout.js";
import {drawing, raster, save} from "./saving.js";
import {DEFAULTS, Model, Session} from "./state.js";

const FLIGHT_MS = 8000, PHONE_PX = 700; // Of the animation of a whole plan; below it there is no lecture

function render({model, el}) {
  const root = make("div", {class: "optuav-explorer"}), frame = make("div", {class: "optuav-frame"}, root);
  const verdict = make("p", {class: "verdict"}), why = make("p", {class: "why"}), waits = make("p", {class: "waits", role: "status", "aria-live": "polite"});
  const header = make("header", {class: "panel"}, make("div", {class: "sentence", role: "status", "aria-live": "polite"}, verdict, why), waits);
  const faults = make("ul", {class: "faults", role: "alert"}), plans = make("div", {class: "plans"}), foot = make("div", {class: "panel foot"});
  const below = make("div", {class: "tables", hidden: ""}), stage = make("div", {class: "panel stage"}), chosen = make("div", {class: "chosen"}), presets = make("div", {class: "presets"});
  const session = new Session(model, {answered, busy, told, draw, save: ({name, text}) => save(name, new Blob([text]))});
  const controls = new Controls(session), columns = [new Column(session, "now", "Plan", fly), new Column(session, "pinned", "Pinned plan", fly)];
  const query = el.closest(".optuav-page") ? new URLSearchParams(location.search) : new URLSearchParams();
  let flight = null, lecture = false, shaped = false, invited = query.has("lecture"); // By the address, once

  const details = button("Details ▾", () => {
    below.hidden = !below.hidden;
    details.setAttribute("aria-expanded", !below.hidden);
    if (!below.hidden) below.scrollIntoView({behavior: "smooth", block: "nearest"});
  }, {"aria-expanded": "false"});
  const pressed = (name) => ({"aria-pressed": "false", "data-name": name});
  const pin = button("Pin to compare", () => (session.pin(), changed()), {key: "P", ...pressed("pin"), "data-stays": ""});
  const lock = button("Lock axes", () => (session.lock(!session.locked), changed()), {key: "A", ...pressed("lock")});
  const symbols = button("Symbols", () => (root.classList.toggle("symbols"), changed()), {key: "S", ...pressed("symbols")});
  const talk = button("Lecture", () => teach(!lecture), {key: "L", ...pressed("lecture")});
  const reset = button("Reset", () => (columns.forEach(rewind), session.reset(), changed()), {"data-stays": ""});
  const opener = button("Controls", () => root.classList.toggle("sheet-open"), {class: "sheet-opener", "data-stays": ""});
  const more = button("⋯", () => actions.classList.toggle("open"), {class: "more", "aria-label": "Pin, lock axes, symbols, share, reset"});
  const share = make("details", {class: "menu"}, make("summary", {}, "Share ▾"), make("div", {class: "panel"}));
  const tablesToo = button("Details", () => details.click(), {class: "narrow"});
  const actions = make("div", {class: "actions"}, opener, pin, lock, symbols, talk, share, tablesToo, reset);
  const keys = {p: pin, a: lock, s: symbols, l: talk, " ": columns[0].element.querySelector(".play")};
  header.append(actions, more);
  stage.append(chosen, presets);
  gripOf(root, controls.form);
  root.append(header, faults, tabsOf(root, draw), controls.form, plans, stage, foot);
  frame.append(below);
  plans.append(columns[0].element);
  el.replaceChildren(frame);
  if (!el.closest(".optuav-page")) frame.style.colorScheme = d3.lab(getComputedStyle(el).color).l > 50 ? "dark" : "light";
  (el.closest(".optuav-page") ? document : root).addEventListener("keydown", shortcut);
  root.addEventListener("click", ({target}) => target.closest(".menu") || (share.open = false));
  const sized = new ResizeObserver(() => requestAnimationFrame(() => (lecture && root.clientWidth < PHONE_PX ? teach(false) : draw())));
  sized.observe(plans);
  session.start();
  return () => {
    sized.disconnect();
    session.end();
    flight?.stop();
  };

  function shortcut(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key === "Escape") {
      if (lecture && !share.open) teach(false);
      share.open = false;
      root.classList.remove("sheet-open");
      actions.classList.remove("open");
    }
    const typing = /^(INPUT|SELECT|TEXTAREA)$/.test(event.target.tagName) && event.target.type !== "range", acts = /^(BUTTON|SUMMARY)$/.test(event.target.tagName);
    if (typing || (event.key === " " && acts)) return;
    const preset = lecture && [...presets.children].find(({dataset}) => dataset.digit === event.key), act = keys[event.key.toLowerCase()] ?? preset;
    if (!act) return;
    event.preventDefault();
    event.stopPropagation(); // A notebook has keys of its own
    act.click();
  }

  function busy(on, words = "") {
    root.classList.toggle("busy", on);
    if (waits.textContent !== words) waits.textContent = words;
  }

  function answered(foreign) {
    controls.fill(foreign);
    if (!share.lastChild.children.length) shares();
    if (!presets.children.length && !session.stored) {
      const begin = (state) => (columns.forEach(rewind), session.begin(state)), digit = (short) => Object.keys(WORDS.chosen).indexOf(short); // Is a preset's own, whatever others there are
      for (const {short, state} of session.shown.presets.slice(1)) presets.append(button(`${digit(short)} ${short}`, () => begin(state), {"data-digit": digit(short), "aria-pressed": "false"}));
    }
    if (invited) teach(true);
    else if (lecture) choose();
    changed();
  }

  function changed() {
    const {shown, pinnedAnswer, pinned, state} = session;
    if (!shown) return;
    if (pinnedAnswer) plans.append(columns[1].element);
    else columns[1].element.remove();
    root.classList.toggle("compares", Boolean(pinnedAnswer));
    pin.firstChild.textContent = pinned ? "Unpin" : "Pin to compare";
    for (const [one, on] of [[pin, pinned], [lock, session.locked], [symbols, root.classList.contains("symbols")], [talk, lecture]]) one.setAttribute("aria-pressed", Boolean(on));
    const differing = pinned && Object.keys(WORDS.titles).filter((name) => (pinned[name] ?? DEFAULTS[name]) !== (state[name] ?? DEFAULTS[name]));
    const also = pinned && JSON.stringify(pinned.changes ?? {}) !== JSON.stringify(state.changes ?? {}) ? ["the mission"] : [];
    sayVerdict(header, session, pinned && [...differing.map((name) => WORDS.differs[name]), ...also].join(" and "), lecture);
    details.textContent = pinned ? "Details ▾" : "Details: limits, worth, proof ▾";
    sayBinding(foot, session, details);
    below.replaceChildren(...tables(shown, () => session.repairs()));
    if (!shaped) columns.forEach((column) => column.shape(shown.map.bounds));
    shaped = true;
    draw();
  }

  function draw() { if (session.shown && root.isConnected) for (const column of columns) column.draw(); }

  function told(found, refused) {
    const pointed = (key) => ([session.state.changes?.[key]].flat().some((value) => /^[-+]?\d*,\d+$/.test(value)) ? "; a decimal point is a point, as in 1.5" : "");
    faults.replaceChildren(...found.map(({key, words}) => make("li", {}, `${controls.title(key) ? `${controls.title(key)}: ` : ""}${words}${pointed(key)}`)));
    root.classList.toggle("at-fault", refused);
    controls.mark(new Set(refused ? found.map(({key}) => key) : []));
  }

  // The playhead runs over a plan; where the available well is empty, the drone falls.
  function fly(column) {
    flight?.stop();
    const {wells} = column.answer;
    if (!wells) return;
    const end = wells.dry_s ?? wells.time_s.at(-1), still = matchMedia("(prefers-reduced-motion: reduce)").matches;
    flight = d3.timer((past) => {
      column.moment = still ? end : Math.min(end, (past / FLIGHT_MS) * wells.time_s.at(-1));
      column.tick();
      if (column.moment >= end) flight.stop();
    });
  }

  function rewind(column) {
    flight?.stop();
    column.moment = null;
  }

  // A lecture: larger, with the controls that were chosen and the presets.
  function teach(on) {
    [lecture, invited] = [on && root.clientWidth >= PHONE_PX, false];
    root.classList.toggle("lecture", lecture);
    choose();
    changed();
  }

  function choose() {
    const known = session.shown.presets, place = presetOf(session.state, known);
    if (lecture && place !== "") stage.dataset.preset = known[place].short;
    const stated = query.get("lecture")?.split(",").filter(Boolean).map((name) => controls.names().find((each) => each.split("|")[0] === name)) ?? [];
    const names = lecture ? (stated.length ? stated : WORDS.chosen[stage.dataset.preset ?? "Mission"]).filter((name) => controls.get(name)) : [];
    controls.lend(names, chosen);
    [...presets.children].forEach((each, k) => each.setAttribute("aria-pressed", k + 1 === place));
  }

  function shares() {
    const add = (words, act) => share.lastChild.append(button(words, act));
    const picture = () => drawing(root, session.shown.verdict.text), stem = session.shown.name.replace(/[^\p{L}\p{N}.-]+/gu, "-") || "mission";
    if (model.get("link")) {
      add("Copy link", async (one) => {
        const said = await navigator.clipboard.writeText(session.link()).then(() => "Link copied", () => "It is in the address bar");
        one.textContent = said;
        setTimeout(() => (one.textContent = "Copy link"), 2000);
      });
    }
    if (!session.stored) {
      add("Mission (TOML)", () => session.file("mission"));
      add("Plan (JSON)", () => session.file("plan"));
    }
    add("Picture (SVG)", () => save(`${stem}.svg`, new Blob([picture()], {type: "image/svg+xml"})));
    add("Picture (PNG)", () => raster(picture()).then((blob) => save(`${stem}.png`, blob)));
  }
}

export {Model};
export default {render};

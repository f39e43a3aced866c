// The explorer: it draws answers and computes nothing. `d3`, `Plot`, `LOOKS` and `WORDS` stand above this
// text where it is served or handed to a notebook.
import {Controls, presetOf} from "./controls.js";
import {button, make} from "./drawing.js";
import {Column, Tabs, gripOf} from "./layout.js";
import {shareMenu, save} from "./saving.js";
import {sayBinding, sayVerdict} from "./saying.js";
import {Model, Session} from "./state.js";
import {tables} from "./tables.js";

const FLIGHT_MS = 8000; // Of the animation of a whole plan
const PHONE_PX = 700; // Below it there is no lecture
const LIVE = {role: "status", "aria-live": "polite"};
const STAYS = {"data-stays": ""}; // Beside the verdict on a narrow screen too

function render({model, el}) {
  const own = Boolean(el.closest(".optuav-page")); // Whether the whole window is this page
  const query = new URLSearchParams(own ? location.search : "");
  const root = make("div", {class: "optuav-explorer"});
  const below = make("div", {class: "tables", hidden: ""});
  const frame = make("div", {class: "optuav-frame"}, root, below);
  const waits = make("p", {class: "waits", ...LIVE});
  const faults = make("ul", {class: "faults", role: "alert"});
  const plans = make("div", {class: "plans"});
  const foot = make("div", {class: "panel foot"});
  const chosen = make("div", {class: "chosen"});
  const presets = make("div", {class: "presets"});
  const view = {answered, busy, told, draw, save: ({name, text}) => save(name, new Blob([text]))};
  const session = new Session(model, view);
  const controls = new Controls(session);
  const now = new Column(session, "now", "Plan", fly);
  const columns = [now, new Column(session, "pinned", "Pinned plan", fly)];
  let flight = null;
  let lecture = false;
  let shaped = false;
  let drawn = ""; // For which size
  let phases = ""; // Of the plan that is shown
  let invited = query.has("lecture"); // By the address, once

  const press = (words, key, name, act) => button(words, () => {
    act();
    changed();
  }, {key, "aria-pressed": "false", "data-name": name, ...(name === "pin" ? STAYS : {})});
  const toggles = {
    pin: press("Pin to compare", "P", "pin", () => session.pin()),
    lock: press("Lock axes", "A", "lock", () => session.lock(!session.locked)),
    symbols: press("Symbols", "S", "symbols", () => root.classList.toggle("symbols")),
    lecture: press("Lecture", "L", "lecture", () => teach(!lecture)),
  };
  const tabs = new Tabs(openPicture); // Of a narrow screen
  const details = button("Details ▾", openTables, {"aria-expanded": "false"});
  const menu = make("div", {class: "panel"});
  const share = make("details", {class: "menu"}, make("summary", {}, "Share ▾"), menu);
  const openSheet = () => root.classList.toggle("sheet-open");
  const sheet = button("Controls", openSheet, {class: "sheet-opener", ...STAYS});
  const narrow = button("Details", () => details.click(), {class: "narrow"});
  const reset = button("Reset", () => begin(() => session.reset()), STAYS);
  const actions = make("div", {class: "actions"}, sheet, ...Object.values(toggles), share, narrow, reset);
  const more = button("⋯", () => actions.classList.toggle("open"), {
    class: "more",
    "aria-label": "Pin, lock axes, symbols, share, reset",
  });
  const sized = new ResizeObserver(() => requestAnimationFrame(resized));
  build();
  listen();
  session.start();
  return () => {
    sized.disconnect();
    session.end();
    flight?.stop();
  };

  function build() {
    const sentence = make("div", {class: "sentence", ...LIVE});
    sentence.append(make("p", {class: "verdict"}), make("p", {class: "why"}));
    const header = make("header", {class: "panel"}, sentence, waits, actions, more);
    const stage = make("div", {class: "panel stage"}, chosen, presets);
    gripOf(root, controls.form);
    root.dataset.picture = "map";
    tabs.element.classList.add("pictures");
    root.append(header, faults, tabs.element, controls.form, plans, stage, foot);
    plans.append(now.element);
    el.replaceChildren(frame);
    if (!own) frame.style.colorScheme = d3.lab(getComputedStyle(el).color).l > 50 ? "dark" : "light";
  }

  function listen() {
    (own ? document : root).addEventListener("keydown", shortcut);
    root.addEventListener("click", ({target}) => {
      if (!target.closest(".menu")) share.open = false;
    });
    sized.observe(plans);
  }

  function shortcut(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key === "Escape") escape();
    const {tagName, type} = event.target;
    const flies = lecture && event.key === " " && event.target.closest(".chosen"); // After each choice
    const typing = /^(INPUT|SELECT|TEXTAREA)$/.test(tagName) && type !== "range" && !flies;
    const acts = event.key === " " && /^(BUTTON|SUMMARY)$/.test(tagName) && !flies;
    if (typing || acts) return;
    const preset = lecture && [...presets.children].find(({dataset}) => dataset.digit === event.key);
    const {pin, lock, symbols} = toggles;
    const keys = {p: pin, a: lock, s: symbols, l: toggles.lecture, " ": now.play};
    const act = keys[event.key.toLowerCase()] ?? preset;
    if (!act) return;
    event.preventDefault();
    event.stopPropagation(); // A notebook has keys of its own
    act.click();
  }

  function escape() {
    if (lecture && !share.open) teach(false);
    share.open = false;
    root.classList.remove("sheet-open");
    actions.classList.remove("open");
  }

  // On a narrow screen one picture at a time.
  function openPicture(name) {
    const alone = name === "map" || name === "wells";
    root.dataset.picture = alone ? name : "plane";
    if (!alone) session.open(name);
    changed();
  }

  function openTables() {
    below.hidden = !below.hidden;
    details.setAttribute("aria-expanded", !below.hidden);
    if (!below.hidden) below.scrollIntoView({behavior: "smooth", block: "nearest"});
  }

  // What the session tells.

  function busy(on, words = "") {
    root.classList.toggle("busy", on);
    if (waits.textContent !== words) waits.textContent = words;
  }

  function answered(foreign) {
    controls.fill(foreign);
    const found = JSON.stringify(session.shown.wells?.phases);
    if (found !== phases) land(); // Another plan has not been flown
    phases = found;
    if (!menu.children.length) menu.append(...shareMenu(root, session, model));
    if (!presets.children.length) {
      presets.append(...session.shown.presets.slice(1).map(presetButton));
    }
    if (invited) return teach(true);
    if (lecture) choose();
    changed();
  }

  function told(found, refused) {
    faults.replaceChildren(...found.map(({key, words}) => {
      const title = controls.title(key);
      const commas = [session.state.changes?.[key]].flat().some((value) => /^[-+]?\d*,\d+$/.test(value));
      const hint = commas ? "; a decimal point is a point, as in 1.5" : "";
      return make("li", {}, `${title ? `${title}: ` : ""}${words}${hint}`);
    }));
    root.classList.toggle("at-fault", refused);
    controls.mark(new Set(refused ? found.map(({key}) => key) : []));
  }

  function changed() {
    const {shown, pinnedAnswer, pinned, locked} = session;
    if (!shown) return;
    if (pinnedAnswer) plans.append(columns[1].element);
    else columns[1].element.remove();
    root.classList.toggle("compares", Boolean(pinnedAnswer));
    toggles.pin.firstChild.textContent = pinned ? "Unpin" : "Pin to compare";
    const pressed = {pin: pinned, lock: locked, symbols: root.classList.contains("symbols"), lecture};
    for (const [name, on] of Object.entries(pressed)) toggles[name].setAttribute("aria-pressed", Boolean(on));
    sayVerdict(root.querySelector("header"), session, lecture);
    const {picture} = root.dataset;
    const opened = picture === "plane" ? session.state.picture ?? picture : picture;
    tabs.show(["map", "plane", "wells", ...shown.pictures], opened);
    details.textContent = pinned ? "Details ▾" : "Details: limits, worth, proof ▾";
    sayBinding(foot, session, details);
    below.replaceChildren(...tables(shown, () => session.repairs()));
    if (!shaped) for (const column of columns) column.shape(shown.map.bounds);
    shaped = true;
    draw();
  }

  function draw() {
    if (!session.shown || !root.isConnected) return;
    drawn = sizeOfPlans();
    for (const column of columns) column.draw();
  }

  function resized() {
    if (lecture && root.clientWidth < PHONE_PX) teach(false);
    else if (sizeOfPlans() !== drawn) draw();
  }

  function sizeOfPlans() {
    return `${plans.clientWidth} ${plans.clientHeight}`;
  }

  // The playhead runs over a plan; where the available well is empty, the drone falls.

  function fly(column) {
    flight?.stop();
    const {wells} = column.answer;
    if (!wells) return;
    const landed = wells.time_s.at(-1);
    const end = wells.dry_s ?? landed;
    const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
    flight = d3.timer((past) => {
      column.moment = still ? end : Math.min(end, (past / FLIGHT_MS) * landed);
      column.tick();
      if (column.moment >= end) flight.stop();
    });
  }

  function land() {
    flight?.stop();
    for (const column of columns) column.moment = null;
  }

  function begin(act) {
    land();
    act();
    changed();
  }

  // A lecture: larger, with the controls that were chosen and the presets.

  function presetButton({short, state}) {
    const digit = Object.keys(WORDS.chosen).indexOf(short); // Is a preset's own, whatever others there are
    const act = () => begin(() => session.begin(state));
    return button(`${digit} ${short}`, act, {"data-digit": digit, "aria-pressed": "false"});
  }

  function teach(on) {
    lecture = on && root.clientWidth >= PHONE_PX;
    invited = false;
    root.classList.toggle("lecture", lecture);
    choose();
    changed();
  }

  function choose() {
    const known = session.shown.presets;
    const preset = presetOf(session.state, known);
    if (lecture && preset !== "") chosen.dataset.preset = known[preset].short;
    const names = controls.names();
    const stated = (query.get("lecture") ?? "").split(",").filter(Boolean)
      .map((name) => names.find((full) => full.split("|")[0] === name));
    const usual = WORDS.chosen[chosen.dataset.preset ?? "Mission"];
    const wanted = stated.length ? stated : usual;
    controls.lend(lecture ? wanted.filter((name) => controls.get(name)) : [], chosen);
    [...presets.children].forEach((one, k) => one.setAttribute("aria-pressed", k + 1 === preset));
  }
}

export {Model};
export default {render};

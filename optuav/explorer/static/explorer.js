// The explorer: it draws answers and computes nothing. `d3`, `Plot`, `LOOKS`, `WORDS` and the markup `PAGE`
// stand above this text where it is served or handed to a notebook.
import {Controls, presetOf} from "./controls.js";
import {button, make} from "./drawing.js";
import {Column, showTabs} from "./layout.js";
import {copyLink, save, savePicture} from "./saving.js";
import {sayBinding, sayVerdict, tables} from "./saying.js";
import {Model, Session} from "./state.js";

const FLIGHT_MS = 8000; // Of the animation of a whole plan
const PHONE_PX = 700; // Below it there is no lecture
const SHEETS = ["half", "low", "full"]; // Heights of the controls on a phone

function render({model, el}) {
  const own = Boolean(el.closest(".optuav-page")); // Whether the whole window is this page
  const query = new URLSearchParams(own ? location.search : "");
  const frame = make("div", {class: "optuav-frame"});
  frame.innerHTML = PAGE;
  const [root, below] = frame.children;
  const part = (selector) => root.querySelector(selector);
  const copy = (name) => frame.querySelector(`template.${name}`).content.firstElementChild.cloneNode(true);
  const [actions, faults, plans, chosen, presets, share] =
    [".actions", ".faults", ".plans", ".chosen", ".presets", ".menu"].map(part);
  const session = new Session(model, {answered, busy, told, draw, save: ({name, text}) => save(name, text)});
  const controls = new Controls(session, root, copy);
  const columns = [["now", "Plan"], ["pinned", "Pinned plan"]]
    .map(([kind, title]) => new Column(session, kind, title, copy("plan")));
  const sized = new ResizeObserver(() => requestAnimationFrame(resized));
  let flight = null;
  let lecture = false;
  let drawn = ""; // For which size
  let phases = ""; // Of the plan that is shown
  let invited = query.has("lecture"); // By the address, once

  const acts = {
    pin: () => session.pin(),
    lock: () => session.lock(!session.locked),
    symbols: () => root.classList.toggle("symbols"),
    lecture: () => teach(!lecture),
    sheet: () => root.classList.toggle("sheet-open"),
    more: () => actions.classList.toggle("open"),
    grip: () => (root.dataset.sheet = SHEETS[(SHEETS.indexOf(root.dataset.sheet) + 1) % SHEETS.length]),
    previous: () => controls.begin(-1),
    next: () => controls.begin(1),
    reset: () => begin(() => session.reset()),
    link: (pressed) => copyLink(pressed, session),
    mission: () => session.change({file: "mission"}),
    plan: () => session.change({file: "plan"}),
    svg: () => savePicture("svg", root, session.shown),
    png: () => savePicture("png", root, session.shown),
    details: openTables,
    play: (pressed) => fly(columns.find(({play}) => play === pressed)),
  };
  plans.append(columns[0].element);
  el.replaceChildren(frame);
  if (!own) frame.style.colorScheme = d3.lab(getComputedStyle(el).color).l > 50 ? "dark" : "light";
  (own ? document : root).addEventListener("keydown", shortcut);
  root.addEventListener("click", ({target}) => {
    if (!target.closest(".menu")) share.open = false;
    const pressed = target.closest("button[data-name]");
    if (!pressed) return;
    acts[pressed.dataset.name](pressed);
    if (pressed.ariaPressed) changed();
  });
  sized.observe(plans);
  session.start();
  return () => {
    sized.disconnect();
    session.end();
    flight?.stop();
  };

  function shortcut(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key === "Escape") escape();
    const {tagName, type} = event.target;
    const flies = lecture && event.key === " " && event.target.closest(".chosen"); // After each choice
    const typing = /^(INPUT|SELECT|TEXTAREA)$/.test(tagName) && type !== "range" && !flies;
    const presses = event.key === " " && /^(BUTTON|SUMMARY)$/.test(tagName) && !flies;
    const key = event.key.toLowerCase();
    const pressed = [...root.querySelectorAll("button")].find(({dataset: {press, digit}}) =>
      press === key || (lecture && digit === key));
    if (typing || presses || !pressed) return;
    event.preventDefault();
    event.stopPropagation(); // A notebook has keys of its own
    pressed.click();
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
    part(".foot button").ariaExpanded = !below.hidden;
    if (below.hidden) return;
    if (session.shown?.repairable) askRepairs();
    below.scrollIntoView({behavior: "smooth", block: "nearest"});
  }

  function askRepairs() {
    session.change({repairs: true});
  }

  // What the session tells.

  function busy(on, words = "") {
    root.classList.toggle("busy", on);
    const waits = part(".waits");
    if (waits.textContent !== words) waits.textContent = words;
  }

  function answered(foreign) {
    const {wells, presets: known, stored} = session.shown;
    controls.fill(foreign);
    const found = JSON.stringify(wells?.phases);
    if (found !== phases) land(); // Another plan has not been flown
    phases = found;
    part("[data-name=link]").hidden = !model.get("link");
    for (const file of ["mission", "plan"]) part(`[data-name=${file}]`).hidden = stored;
    if (!presets.children.length) presets.append(...known.slice(1).map(presetButton));
    if (invited) return teach(true);
    if (lecture) choose();
    changed();
  }

  function told(found, refused) {
    faults.replaceChildren(...found.map(({key, words}) => {
      const title = controls.title(key);
      const values = [session.now.state.changes?.[key]].flat();
      const commas = values.some((value) => /^[-+]?\d*,\d+$/.test(value));
      const hint = commas ? "; a decimal point is a point, as in 1.5" : "";
      return make("li", {}, `${title ? `${title}: ` : ""}${words}${hint}`);
    }));
    root.classList.toggle("at-fault", refused);
    controls.mark(new Set(refused ? found.map(({key}) => key) : []));
  }

  function changed() {
    const {shown, pinned, locked, now: {state}} = session;
    if (!shown) return;
    if (pinned?.answer) plans.append(columns[1].element);
    else columns[1].element.remove();
    root.classList.toggle("compares", Boolean(pinned?.answer));
    part("[data-name=pin]").firstChild.textContent = pinned ? "Unpin" : "Pin to compare";
    const pressed = {pin: pinned, lock: locked, symbols: root.classList.contains("symbols"), lecture};
    for (const [name, on] of Object.entries(pressed)) part(`[data-name=${name}]`).ariaPressed = Boolean(on);
    sayVerdict(part("header"), session, lecture);
    const {picture} = root.dataset;
    const opened = picture === "plane" ? state.picture ?? picture : picture;
    showTabs(part(".tabs.pictures"), ["map", "plane", "wells", ...shown.pictures], opened, openPicture);
    sayBinding(part(".binding"), session);
    part(".foot button").textContent = pinned ? "Details ▾" : "Details: limits, worth, proof ▾";
    below.replaceChildren(...tables(shown, askRepairs));
    for (const column of columns) column.shape(shown.map.bounds);
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

  function presetButton({words, short, state}) {
    const digit = Object.keys(WORDS.chosen).indexOf(short); // Is a preset's own, whatever others there are
    return button(`${digit} ${words}`, () => begin(() => session.begin(state)), {"data-digit": digit});
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
    const preset = presetOf(session.now.state, known);
    if (lecture && preset !== "") chosen.dataset.preset = known[preset].short;
    const stated = (query.get("lecture") ?? "").split(",").filter(Boolean);
    const first = controls.liveFirst(WORDS.chosen[chosen.dataset.preset ?? "Mission"]);
    const wanted = stated.length ? stated : first;
    controls.lend(lecture ? wanted : [], chosen);
    [...presets.children].forEach((one, k) => (one.ariaPressed = k + 1 === preset));
  }
}

export {Model};
export default {render};

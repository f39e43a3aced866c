// The controls: what to start from, the question, the mission's sliders, and places.
import {button, grouped, make} from "./drawing.js";
import {ARROWS, points} from "./map.js";
import {showTabs} from "./layout.js";
import {DEFAULTS, brief} from "./state.js";

const PLACES = ["device", "laser", "roof"];
const LONG_STEP = 10; // Steps, by Shift and an arrow
let instances = 0;

export class Controls {
  #session;
  #root;
  #copy; // Of a template, by name
  #fields = new Map(); // By name: element, inputs, and the key of the mission or of the question
  #inputs = new Map(); // Key, axis, unit and whole vector that an input sets
  #id = `optuav-${++instances}`;

  constructor(session, root, copy) {
    this.#session = session;
    this.#root = root;
    this.#copy = copy;
    const on = (type, selector, act) =>
      root.addEventListener(type, (event) => event.target.matches(selector) && act(event.target, event));
    on("input", ":is(.slider, .place) input:not([type=checkbox])", (input) => this.#enter(input));
    on("change", ".start select", () => this.begin(0));
    on("change", ".switch input", ({checked}) =>
      session.changeKey("limits.keep_soc", checked ? "always" : "end"));
    on("change", ".choice select", ({name, value}) => this.#choose(name, value || null));
    on("pointerdown", "[type=range]", () => session.hold());
    on("pointerup", "[type=range]", () => session.release());
    on("pointercancel", "[type=range]", () => session.release());
    on("keydown", "[type=range]", (range, event) => this.#press(range, event));
    on("focusin", ".slider [data-key]", (input) => this.#hand(input));
    on("focusout", "[type=text]", (field) => field.ariaInvalid !== "true" && this.fill(false));
  }

  // Fills all fields but the one that is being changed; or all.
  fill(all) {
    const {shown: answer, now: {state}} = this.#session;
    if (!this.#fields.size) this.#build(answer);
    const active = all ? null : this.#root.getRootNode().activeElement;
    const free = (input) => !this.#session.waiting && active !== input;
    for (const control of answer.controls) this.#fillSlider(control, free);
    const whys = fixed(state);
    for (const name of Object.keys(answer.options)) {
      this.#fillChoice(name, answer.options[name], whys[name] || "");
    }
    if (!answer.stored) this.#fillPlaces(free);
    this.#start.value = presetOf(state, answer.presets);
  }

  #build({options, controls, presets, stored}) {
    const names = Object.keys(WORDS.titles).filter((name) => options[name]);
    this.#section("Question").append(...names.map((name) => this.#choice(name)));
    this.#section("Mission").append(...controls.map((control) => this.#slider(control)));
    if (stored) this.#section("Places").remove();
    else this.#section("Places").append(...PLACES.map((name) => this.#place(name)));
    this.#start.append(...presets.map(({words}, value) => make("option", {value}, words)));
    this.#show("Mission");
  }

  #section(name) {
    return this.#root.querySelector(`[data-section=${name}]`);
  }

  #show(name) {
    const sections = [...this.#root.querySelectorAll("[data-section]")];
    for (const {dataset, classList} of sections) classList.toggle("on", dataset.section === name);
    const names = sections.map(({dataset}) => dataset.section);
    showTabs(this.#root.querySelector(".tabs.sections"), names, name, (opened) => this.#show(opened));
  }

  // What to start from: what is selected, or some presets on.

  get #start() {
    return this.#root.querySelector(".start select");
  }

  begin(by) {
    const {presets} = this.#session.shown;
    const value = Number(this.#start.value) + by;
    this.#session.begin(presets[(value + presets.length) % presets.length].state);
  }

  // The question.

  #choice(name) {
    const element = this.#copy("choice");
    const [label, select, segments, note, differs] = element.children;
    element.dataset.name = select.name = name;
    label.firstChild.textContent = WORDS.titles[name];
    label.htmlFor = select.id = `${this.#id}-${name}`;
    segments.ariaLabel = `${WORDS.titles[name]}: one of`;
    segments.append(...(WORDS.segments[name] ?? []).map((value) =>
      button(worded(name, value), () => this.#choose(name, value), {value, "aria-pressed": "false"})));
    const parts = {mark: label.lastChild, note, differs, segments: segments.children};
    this.#fields.set(name, {key: name, element, inputs: [select], ...parts});
    return element;
  }

  #choose(name, value) {
    const changes = {[name]: value};
    if (name === "building" && value) Object.assign(changes, {trajectory: null, problem: null});
    if (name === "problem") changes.building = null;
    if (value === "P3") Object.assign(changes, {trajectory: null, order: null});
    if (value === "direct") changes.order = null;
    this.#session.last = name;
    this.#session.change(changes);
  }

  // With a mark where the pinned plan has else, and why it changes nothing.
  #fillChoice(name, values, why) {
    const {now: {state}, pinned} = this.#session;
    const {inputs: [select], segments, mark, note, differs} = this.#fields.get(name);
    const value = state[name] ?? DEFAULTS[name];
    const other = pinned ? pinned.state[name] ?? DEFAULTS[name] : value;
    d3.select(select).selectAll("option").data(DEFAULTS[name] ? values : ["", ...values]).join("option")
      .attr("value", (each) => each)
      .attr("title", (each) => WORDS.hints[each] ?? "")
      .text((each) => worded(name, each));
    Object.assign(select, {value, title: WORDS.hints[value] ?? "", disabled: Boolean(why)});
    for (const segment of segments) segment.ariaPressed = segment.value === value;
    note.textContent = why;
    mark.textContent = other === value ? "" : " •";
    differs.textContent = other === value ? "" : `• pinned: ${worded(name, other)}`;
  }

  // Sliders of the mission, each with a field.

  #slider(control) {
    const {key, axis, label: words, symbol, unit} = control;
    const element = this.#copy("slider");
    const [label, field, range] = element.querySelectorAll("label:first-child, .value, [type=range]");
    label.title = `${symbol}: ${key} [${unit}]`;
    label.htmlFor = range.id = `${this.#id}-${this.#fields.size}`;
    label.firstChild.textContent = words;
    label.lastChild.textContent = symbol;
    element.querySelector(".unit").textContent = unit;
    for (const [input, kind] of [[range, "slider"], [field, "value"]]) {
      input.dataset.key = nameOf(control);
      input.ariaLabel = `${words} [${unit}], ${kind}`;
      this.#inputs.set(input, {key, axis, unit});
    }
    this.#fields.set(nameOf(control), {key, element, inputs: [range, field]});
    return element;
  }

  // Changes a key of the mission, or one component of it.
  #enter(input) {
    const {key, axis, unit, whole} = this.#inputs.get(input);
    const slides = input.type === "range";
    const typed = slides ? Number(input.value) : decimal(input.value);
    const value = unit === "%" && !slides && typeof typed === "number" ? typed / 100 : typed;
    const [, field] = this.#fields.get(input.dataset.key)?.inputs ?? [];
    if (slides) input.ariaValueText = field.value = grouped(shown(typed, unit));
    const stated = this.#session.now.state.changes[key] ?? whole;
    this.#session.changeKey(key, whole ? stated.with(axis, value) : value, axis);
  }

  #press(range, event) {
    if (event.key !== "Tab") this.#session.holdByKey();
    if (!event.shiftKey || !ARROWS[event.key]) return;
    event.preventDefault();
    range.stepUp(LONG_STEP * d3.sum(ARROWS[event.key]));
    this.#enter(range);
  }

  // The control in hand is the one that a sheet of least height shows.
  #hand(input) {
    const fields = [...this.#fields.values()];
    for (const {element} of fields) element.classList.toggle("in-hand", element.contains(input));
  }

  // With a dashed thumb where the pinned plan has another value.
  #fillSlider(control, free) {
    const {value, whole, low, high, step, unit, idle} = control;
    const {element, inputs: [slider, field]} = this.#fields.get(nameOf(control));
    const at = d3.scaleLinear([Math.min(low, value), Math.max(high, value)], [0, 100]).clamp(true);
    const [min, max] = at.domain();
    Object.assign(slider, {min, max, step});
    if (free(slider)) Object.assign(slider, {value, ariaValueText: `${shown(value, unit)} ${unit}`});
    if (free(field)) field.value = written(control);
    for (const input of [slider, field]) this.#inputs.get(input).whole = whole;
    for (const [name, end] of [["at", value], ["from", idle?.low ?? 0], ["to", idle?.high ?? max]]) {
      element.style.setProperty(`--${name}`, `${at(end)}%`);
    }
    const [toggle, box] = element.querySelectorAll(".switch, .switch input");
    toggle.hidden = typeof control.always !== "boolean"; // Beside the charge that must stay
    box.checked = Boolean(control.always);
    element.classList.toggle("idle", Boolean(idle));
    const note = element.querySelector(".note");
    note.textContent = idle ? stillness(control, idle) : "";
    slider.setAttribute("aria-description", note.textContent);
    const ghost = element.querySelector(".ghost");
    const other = this.#session.pinned?.answer?.controls.find((each) => nameOf(each) === nameOf(control));
    ghost.hidden = !other || other.value === value;
    if (other) ghost.style.left = `${at(other.value)}%`;
  }

  // Device, laser and the building that is chosen, by numbers, which follow a drag.

  #place(name) {
    const element = this.#copy("place");
    const [, ...inputs] = element.children;
    inputs.forEach((input, axis) => {
      input.dataset.place = `${name}|${axis}`;
      this.#inputs.set(input, {axis});
    });
    this.#fields.set(`place ${name}`, {element, inputs});
    return element;
  }

  #fillPlaces(free) {
    const {shown: {map}, now: {state}} = this.#session;
    const keys = ["link.device_m", "laser.position_m", `buildings.${state.building}.position_m`];
    keys.forEach((key, k) => {
      const place = this.#fields.get(`place ${PLACES[k]}`);
      const point = points(map).find((movable) => movable.key === key);
      place.key = key;
      place.element.hidden = !point;
      if (!point) return;
      place.element.firstElementChild.textContent = point.name;
      place.inputs.forEach((input, axis) => {
        Object.assign(this.#inputs.get(input), {key, whole: point.at});
        input.ariaLabel = `${point.name}, ${"xy"[axis]} [m]`;
        if (free(input)) input.value = point.at[axis];
      });
    });
  }

  // In a lecture some fields stand in a bar of their own, and go back to where they were. A field that
  // is moved loses the focus.
  lend(names, bar) {
    if (names.join() === bar.dataset.lent) return;
    bar.dataset.lent = names.join();
    const fields = [...this.#fields.values()];
    for (const {element, home} of fields) if (home?.isConnected) home.replaceWith(element);
    for (const field of names.map((name) => fields.find(({key}) => key === name)).filter(Boolean)) {
      field.home = document.createComment("");
      field.element.replaceWith(field.home);
      bar.append(field.element);
    }
  }

  // Faults mark their fields.
  mark(keys) {
    for (const {key, inputs, element} of this.#fields.values()) {
      for (const input of inputs) input.ariaInvalid = keys.has(key);
      element.classList.toggle("wrong", keys.has(key));
    }
  }

  title(key) {
    const control = this.#session.shown?.controls.find((known) => known.key === key);
    return control?.label.replace(/, \w+ward$/, "") ?? WORDS.titles[key];
  }
}

function nameOf({key, axis}) {
  return `${key}|${axis}`;
}

function worded(name, value) {
  return WORDS.values[value] ?? (value || WORDS.any[name] || value);
}

// Why a choice of a question changes nothing.
function fixed({problem, building, trajectory}) {
  const direct = problem === "P3" || trajectory === "direct";
  return {
    problem: building && "the building is chosen",
    trajectory: building ? `via ${building}` : problem === "P3" && "the route is direct",
    building: problem && problem !== "P1" && "not in this question",
    order: direct && !building && "there is no rest",
  };
}

// A decimal number; other text as it is, for the answer to refuse.
function decimal(text) {
  const plain = text.replaceAll(/[\s\u2009]/g, "");
  return /^[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?$/i.test(plain) ? Number(plain) : text.trim();
}

// A number as a control shows it: a share in percent.
function shown(value, unit) {
  return Number((unit === "%" ? 100 * value : value).toPrecision(8));
}

// As a field has it: whole numbers of finer controls with a decimal.
function written({value, unit, step}) {
  const finer = step < 1 && unit !== "%" && Number.isInteger(value);
  return finer ? value.toFixed(1) : grouped(shown(value, unit));
}

// Over which values a control changes nothing, and why.
function stillness(control, {low, high, words}) {
  const {unit, step, value} = control;
  const said = (number) => `${grouped(Number(shown(number, unit).toPrecision(3)))} ${unit}`;
  const from = low > control.low ? ` from ${said(Math.ceil(low / step - 1e-9) * step)} up` : "";
  const range = high > value ? ` up to ${said(high)}` : ` down to ${said(Math.ceil(low))}`;
  return `no effect${high === null ? from : range}: ${words}`;
}

// Which preset a state is; an empty text if none.
export function presetOf(state, presets) {
  const bare = ({picture, ...asked}) => JSON.stringify(Object.entries({changes: {}, ...brief(asked)}).sort());
  const found = presets.findIndex((preset) => bare(preset.state) === bare(state));
  return found < 0 ? "" : found;
}

// The controls: what to start from, the question, the mission's sliders, and places.
import {button, formula, grouped, make} from "./drawing.js";
import {ARROWS, points} from "./map.js";
import {showTabs} from "./layout.js";
import {DEFAULTS, brief} from "./state.js";

const LONG_STEP = 10; // Steps, by Shift and an arrow
let instances = 0;

export class Controls {
  #session;
  #root;
  #copy; // Of a template, by name
  #fields = new Map(); // By name: element, inputs, and the key of the mission or of the question
  #inputs = new Map(); // Key, axis, unit and whole vector that an input sets
  #id = `optuav-${++instances}`;
  #still = new Set(); // Sliders that changed nothing when one began

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
    if (this.#session.last === null) this.#arrange(answer.controls); // Nothing has been moved yet
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
    this.#section("Question").append(...names.map((name) => this.#choice(name, options[name])));
    this.#section("Mission").append(...controls.map((control) => this.#slider(control)));
    if (stored) this.#section("Places").remove();
    this.#start.append(...presets.map(({words}, value) => make("option", {value}, words)));
    this.#show("Mission");
  }

  // Sliders that change something stand first; they stay where they are until one begins anew.
  #arrange(controls) {
    this.#still = new Set(controls.filter(({idle}) => idle).map(({key}) => key));
    const placed = d3.sort(controls, ({idle}) => Boolean(idle)).map((control) => {
      const {element, home} = this.#fields.get(nameOf(control));
      return home?.isConnected ? home : element;
    });
    const section = this.#section("Mission");
    const before = [...section.childNodes].filter((node) => placed.includes(node));
    if (placed.some((node, k) => node !== before[k])) section.append(...placed);
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

  #choice(name, values) {
    const element = this.#copy("choice");
    const [label, select, segments, note] = element.children;
    element.dataset.name = select.name = name;
    label.firstChild.textContent = WORDS.titles[name];
    label.htmlFor = select.id = `${this.#id}-${name}`;
    segments.ariaLabel = `${WORDS.titles[name]}: one of`;
    const shown = (WORDS.segments[name] ?? []).filter((value) => values.includes(value));
    segments.append(...shown.map((value) =>
      button(worded(name, value), () => this.#choose(name, value), {value, "aria-pressed": "false"})));
    const parts = {mark: label.lastChild, note, segments: segments.children};
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
    const {inputs: [select], segments, mark, note} = this.#fields.get(name);
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
    mark.title = other === value ? "" : `pinned: ${worded(name, other)}`;
  }

  // Sliders of the mission, each with a field.

  #slider(control) {
    const {key, axis, label: words, symbol, unit, scale, stops} = control;
    const element = this.#copy("slider");
    const [label, field, range] = element.querySelectorAll("label:first-child, .value, [type=range]");
    label.htmlFor = range.id = `${this.#id}-${this.#fields.size}`;
    label.firstChild.textContent = words;
    label.lastChild.append(...formula(symbol));
    element.classList.toggle("kept", control.kept);
    element.querySelector(".unit").textContent = unit;
    for (const [input, kind] of [[range, "slider"], [field, "value"]]) {
      input.dataset.key = nameOf(control);
      input.ariaLabel = `${words} [${unit}], ${kind}`;
      this.#inputs.set(input, {key, axis, scale, stops});
    }
    this.#fields.set(nameOf(control), {key, element, label, inputs: [range, field]});
    return element;
  }

  // Changes a key of the mission, or one component of it.
  #enter(input) {
    const {key, axis, scale = 1, stops, whole} = this.#inputs.get(input);
    const slides = input.type === "range";
    const typed = slides ? input.valueAsNumber : decimal(input.value);
    const stated = (number) => (typeof number === "number" ? exact(number * scale) : number);
    const value = slides ? (stops?.[typed] ?? typed) : stated(typed);
    const [, field] = this.#fields.get(input.dataset.key)?.inputs ?? [];
    if (slides) input.ariaValueText = field.value = grouped(exact(value / scale));
    const vector = this.#session.now.state.changes[key] ?? whole;
    this.#session.changeKey(key, whole ? vector.with(axis, value) : value, axis);
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
    const {value, whole, unit, scale, stops, idle} = control;
    const {element, label, inputs: [slider, field]} = this.#fields.get(nameOf(control));
    const {at, max, ...track} = trackOf(control);
    Object.assign(slider, {...track, max});
    const said = `${exact(value / scale)} ${unit}`;
    if (free(slider)) Object.assign(slider, {value: stops?.indexOf(value) ?? value, ariaValueText: said});
    label.title = `${control.symbol}: ${control.key} = ${value}`;
    if (free(field)) field.value = written(control);
    for (const input of [slider, field]) this.#inputs.get(input).whole = whole;
    for (const [name, end] of [["at", value], ["from", idle?.low ?? 0], ["to", idle?.high ?? Infinity]]) {
      element.style.setProperty(`--${name}`, `${at(end)}%`);
    }
    const [toggle, box] = element.querySelectorAll(".switch, .switch input");
    toggle.hidden = typeof control.always !== "boolean"; // Beside the charge that must stay
    box.checked = Boolean(control.always);
    element.classList.toggle("idle", Boolean(idle));
    const [range, reason] = idle ? stillness(control, idle) : ["", ""];
    const note = element.querySelector(".note");
    const words = [make("b", {}, range), make("span", {}, `: ${reason}`)];
    note.replaceChildren(...(idle ? [make("div", {}, ...words)] : []));
    slider.setAttribute("aria-description", idle ? `${range}: ${reason}` : "");
    const ghost = element.querySelector(".ghost");
    const other = this.#session.pinned?.answer?.controls.find((each) => nameOf(each) === nameOf(control));
    ghost.hidden = !other || other.value === value;
    if (other) ghost.style.left = `${at(other.value)}%`;
  }

  // Device, laser and the building that is chosen, by numbers, which follow a drag.

  // One row for each device and the laser, and one for whichever roof is chosen, by name.
  #place(name) {
    const known = this.#fields.get(`place ${name}`);
    if (known) return known;
    const element = this.#copy("place");
    const [, ...inputs] = element.children;
    inputs.forEach((input, axis) => {
      input.dataset.place = `${name}|${axis}`;
      this.#inputs.set(input, {axis});
    });
    const made = {element, inputs};
    this.#fields.set(`place ${name}`, made);
    this.#section("Places").append(element);
    return made;
  }

  #fillPlaces(free) {
    const {shown: {map}, now: {state}} = this.#session;
    const chosen = `buildings.${state.building}.position_m`;
    const movable = points(map).filter(({key, roof}) => !roof || key === chosen);
    for (const {key, name, at, roof} of movable) {
      const place = this.#place(roof ? "roof" : key);
      place.key = key;
      place.element.firstElementChild.textContent = name;
      place.inputs.forEach((input, axis) => {
        Object.assign(this.#inputs.get(input), {key, whole: at});
        input.ariaLabel = `${name}, ${"xy"[axis]} [m]`;
        if (free(input)) input.value = at[axis];
      });
    }
    const roof = this.#fields.get("place roof");
    if (roof) roof.element.hidden = movable.every(({key}) => key !== roof.key);
  }

  // Names of fields, those last that changed nothing when one began.
  liveFirst(names) {
    return d3.sort(names, (name) => this.#still.has(name));
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

// A number without what a change of units rounds.
function exact(number) {
  return Number(number.toPrecision(12));
}

// The ends and the step of a slider, and where a value stands [%]; one with stops counts these.
function trackOf({low, high, step, value, stops}) {
  const [min, max] = [Math.min(low, value), Math.max(high, value)];
  if (!stops) return {min, max, step, at: d3.scaleLinear([min, max], [0, 100]).clamp(true)};
  const places = stops.map((_, k) => (100 * k) / Math.max(1, stops.length - 1));
  return {min: 0, max: stops.length - 1, step: 1, at: d3.scaleLinear(stops, places).clamp(true)};
}

// As a field has it: whole numbers of finer controls with a decimal.
function written({value, unit, scale, step, stops}) {
  const number = exact(value / scale);
  const finer = !stops && exact(step / scale) < 1 && unit !== "%" && Number.isInteger(number);
  return finer ? number.toFixed(1) : grouped(number);
}

// Over which values a control changes nothing, and why.
function stillness({unit, scale, step, value, low: least}, {low, high, words}) {
  const said = (number) => `${grouped(Number((number / scale).toPrecision(3)))} ${unit}`;
  const up = (number) => said(Math.ceil(number / step - 1e-9) * step);
  if (high === null) return [low > least ? `No effect above ${up(low)}` : "No effect", words];
  return [high > value ? `No effect up to ${said(high)}` : `No effect above ${said(Math.ceil(low))}`, words];
}

// Which preset a state is; an empty text if none.
export function presetOf(state, presets) {
  const bare = ({picture, ...asked}) => JSON.stringify(Object.entries({changes: {}, ...brief(asked)}).sort());
  const found = presets.findIndex((preset) => bare(preset.state) === bare(state));
  return found < 0 ? "" : found;
}

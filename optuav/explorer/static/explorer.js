// The explorer: controls, and pictures of the answers to them. It draws, and computes nothing.
// `d3` and `Plot` stand above this text where it is served or handed to a notebook.

const COLOURS = ["#D55E00", "#0072B2", "#009E73", "#CC79A7", "#E69F00", "#56B4E9"];
const DASHES = ["none", "7 3", "2 3", "9 3 2 3", "4 2", "1 2"];
const KINDS = {flight: "#0072B2", hover: "#009E73", rest: "#E69F00"};
const BOUND = "#B9A6D3", AVAILABLE = "#75519C", LACKING = "#D55E00", LASER = "#CC79A7";
const PROBLEMS = {
  P1: "P1: longest hover",
  P2: "P2: shortest flight and rest",
  "P2-tight": "P2, the whole deadline used",
  P3: "P3: direct, no rest",
};
const TITLES = {
  problem: "Problem",
  perspective: "Perspective",
  trajectory: "Trajectory",
  building: "Rest on",
  order: "Order",
};
const DEFAULTS = {problem: "P1", perspective: "available", trajectory: "optimal", building: "", order: ""};
const HINTS = {
  available: "Counts charge; the available well is never dry nor past full",
  battery: "Counts charge: the paper's η1",
  energy: "Counts energy, against the nominal energy of the battery: the paper's η2",
  adjusted: "Counts energy, against what the battery holds at the voltage of each regime: the paper's η3",
  wells: "Counts charge, step by step through both wells",
  optimal: "The best of all routes",
  direct: "Without a rest",
  traj1: "By way of the building nearest the device",
  traj2: "By way of the building with the shortest flight time",
};
const ANY = {building: "the best", order: "the better"};
const FIGURES = ["map", "plane", "wells"];
const MOST_NAMED = 40, MOST_FOCUSED = 60;
const STEP_M = 10, LONG_STEP_M = 100;
const NARROW_PX = 704; // As in the style
const LETTER_PX = 7; // About how wide a letter is
const LONGEST_NAME = 24;
const SIDES = [
  {dx: 0, dy: 8, lineAnchor: "top", textAnchor: "middle"},
  {dx: 0, dy: -8, lineAnchor: "bottom", textAnchor: "middle"},
  {dx: 9, dy: 0, lineAnchor: "middle", textAnchor: "start"},
  {dx: -9, dy: 0, lineAnchor: "middle", textAnchor: "end"},
  {dx: 7, dy: 6, lineAnchor: "top", textAnchor: "start"},
  {dx: -7, dy: 6, lineAnchor: "top", textAnchor: "end"},
  {dx: 7, dy: -6, lineAnchor: "bottom", textAnchor: "start"},
  {dx: -7, dy: -6, lineAnchor: "bottom", textAnchor: "end"},
];
const PATIENCE_MS = 15000; // With a question that cannot be given up
const PATIENCE_WHILE_MOVED_MS = 2000; // With one that is given up where another waits
const TELL_MS = 500, STILL_MS = 5000; // After which it is told that an answer takes time
const ARROWS = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowDown: [0, -1], ArrowUp: [0, 1]};

let instances = 0;

// Values with listeners, as anywidget has them.

export class Model {
  #values;
  #listeners = {};

  constructor(values) {
    this.#values = values;
  }

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
}

function render({model, el}) {
  const id = `optuav-${++instances}`;
  let state = {changes: {}, ...model.get("state")};
  let pinned = model.get("pinned") ?? null;
  let shown = null; // The last answer that was no fault
  let pinnedAnswer = null;
  let held = null; // The bounds of the map while a point is dragged
  let layer = null, scales = null; // Of the points that can be moved
  let asked = null; // The number and moment of the question that is open
  let later = false; // Whether to ask again after it, or what
  let number = Date.now() % 1e9; // So that no two answers of a notebook are alike
  let wanted = pinned ? "pinned" : "now";
  let good = state; // The last state that was answered without a fault
  let kept = model.get("faults") ?? []; // Of the address, which are told until something is changed
  let touched = false; // Whether something was changed
  let ticking = null;
  const fields = new Map();

  const root = make("div", {class: "optuav-explorer"});
  const verdict = make("p", {class: "verdict", role: "status", "aria-live": "polite"});
  const waits = make("p", {class: "waits", role: "status", "aria-live": "polite"});
  const faults = make("ul", {class: "faults", role: "alert"});
  const form = make("form", {"aria-label": "Question and mission"});
  const panel = folded("Question and mission", form, (el.clientWidth || innerWidth) > NARROW_PX);
  const columns = make("div", {class: "columns"});
  const now = column("now", "Plan");
  const other = column("pinned", "Pinned plan");
  panel.classList.add("controls");
  form.addEventListener("submit", (event) => event.preventDefault());
  columns.append(now.element);
  root.append(make("header", {}, make("h1", {}, "optuav"), verdict, waits, faults), panel, columns);
  el.replaceChildren(make("div", {class: "optuav-frame"}, root));
  model.on("change:answer", () => received(model.get("answer")));
  const sized = new ResizeObserver(() => requestAnimationFrame(redraw));
  let width = 0;
  sized.observe(columns);
  if (wanted === "pinned") ask(pinned);
  else if (model.get("answer")?.controls) received(model.get("answer"));
  else ask();
  return () => {
    sized.disconnect();
    clearInterval(ticking);
  };

  // Questions and answers: one at a time, the last state always.

  function ask(special = null) {
    const patience = model.give_up ? PATIENCE_WHILE_MOVED_MS : PATIENCE_MS;
    if (asked && performance.now() - asked.moment < patience) {
      later = special ?? true;
      return;
    }
    model.give_up?.();
    const question = {...(special ?? state), number: ++number};
    asked = {number, moment: performance.now(), file: question.file, state};
    root.classList.add("busy");
    clearInterval(ticking);
    ticking = setInterval(tell, TELL_MS);
    model.set("state", question);
    model.save_changes();
  }

  function askLater() {
    if (!later) return;
    const next = later === true ? null : later;
    later = false;
    ask(next);
  }

  function tell() {
    askLater();
    const words = performance.now() - asked.moment < STILL_MS ? "computing …" : "still computing …";
    if (waits.textContent !== words) waits.textContent = words;
  }

  function received(answer) {
    if (!answer || (asked && answer.number !== asked.number)) return;
    const foreign = !asked; // By another view of a notebook, or the notebook itself
    if (foreign) state = {changes: {}, ...model.get("state")};
    const {file, state: stated} = asked ?? {state};
    const isPinned = wanted === "pinned";
    wanted = "now";
    asked = null;
    clearInterval(ticking);
    waits.textContent = "";
    root.classList.remove("busy");
    if (answer.faults) {
      if (isPinned) {
        kept = [{key: "", words: "The pinned plan of the address is left out:"}, ...answer.faults];
        pinned = null;
        model.set("pinned", null);
        return ask();
      }
      if (!shown && JSON.stringify(brief(state)) !== JSON.stringify(brief({changes: {}}))) {
        const words = "The mission is shown as it is, as what the address states is refused:";
        kept = [...kept, {key: "", words}, ...answer.faults];
        state = {changes: {}};
        return ask();
      }
      showFaults([...kept, ...answer.faults], true);
    } else if (isPinned) {
      pinnedAnswer = answer;
      return ask();
    } else {
      shown = answer;
      good = stated;
      if (touched) link();
      if (file && answer.file) save(answer.file.name, new Blob([answer.file.text]));
      fill(foreign);
      showFaults(kept, false);
      redraw(true);
    }
    askLater();
  }

  // The address has states that were answered alone: a link opens what was seen.

  function link() {
    return model.get("link")?.({state: brief(good), pinned: pinned && brief(pinned)});
  }

  function change(changes) {
    state = {...state, ...changes, file: null, repairs: false};
    kept = [];
    touched = true;
    ask();
  }

  function changeKey(key, value) {
    change({changes: {...state.changes, [key]: value}});
  }

  function showFaults(found, refused) {
    const told = found.map(({key, words}) => make("li", {}, `${titled(key)}${words}${pointed(key)}`));
    faults.replaceChildren(...told);
    root.classList.toggle("at-fault", refused);
    const keys = new Set(found.map((fault) => fault.key));
    for (const field of fields.values()) {
      const wrong = refused && keys.has(field.key);
      for (const input of field.inputs) input.setAttribute("aria-invalid", wrong);
      field.element.classList.toggle("wrong", wrong);
    }
  }

  function titled(key) {
    const control = shown?.controls.find((each) => each.key === key);
    const title = control?.label.replace(/, [xyz]$/, "") ?? TITLES[key];
    return title ? `${title}: ` : "";
  }

  function pointed(key) {
    const commas = [state.changes?.[key]].flat().some((value) => /^[-+]?\d*,\d+$/.test(value));
    return commas ? "; a decimal point is a point, as in 1.5" : "";
  }

  // Controls

  function fill(all) {
    if (!fields.size) build();
    const activeElement = all ? null : root.getRootNode().activeElement; // Is being changed
    for (const control of shown.controls) {
      const {inputs} = fields.get(`${control.key}|${control.axis}`);
      const [slider, field] = inputs;
      slider.min = Math.min(control.low, control.value);
      slider.max = Math.max(control.high, control.value);
      slider.setAttribute("aria-valuetext", `${control.value} ${control.unit}`);
      if (!later && activeElement !== slider) slider.value = control.value;
      if (!later && activeElement !== field) field.value = control.value;
    }
    const names = ["", ...(shown.options.building ?? [])];
    const building = fields.get("building")?.inputs[0];
    if (building && building.options.length !== names.length) choices(building, "building", names);
    for (const name of Object.keys(TITLES)) {
      const [select] = fields.get(name)?.inputs ?? [{}];
      select.value = state[name] ?? DEFAULTS[name];
      select.title = HINTS[select.value] ?? "";
    }
    if (!shown.stored) fillPlaces(activeElement);
    const problem = state.problem ?? "P1", direct = problem === "P3" || state.trajectory === "direct";
    disable("problem", Boolean(state.building));
    disable("trajectory", Boolean(state.building) || problem === "P3");
    disable("building", problem !== "P1");
    disable("order", direct && !state.building);
  }

  function disable(name, off) {
    if (fields.has(name)) fields.get(name).inputs[0].disabled = off;
  }

  function build() {
    const question = make("fieldset", {}, make("legend", {}, "Question"));
    for (const name of Object.keys(TITLES).filter((each) => shown.options[each])) {
      const select = make("select", {id: `${id}-${name}`});
      const values = shown.options[name];
      choices(select, name, DEFAULTS[name] ? values : ["", ...values]);
      select.addEventListener("change", () => choose(name, select.value || null));
      const label = make("label", {for: select.id}, TITLES[name]);
      const element = make("div", {class: "choice"}, label, select);
      fields.set(name, {key: name, element, inputs: [select]});
      question.append(element);
    }
    const mission = make("fieldset", {}, make("legend", {}, "Mission"));
    for (const control of shown.controls) mission.append(slider(control));
    form.append(question, mission, ...(shown.stored ? [] : [places()]), buttons());
  }

  // Device, laser and the building that is chosen, by numbers.

  function places() {
    const group = make("fieldset", {}, make("legend", {}, "Places: x, y [m]"));
    for (const name of ["device", "laser", "roof"]) {
      const element = make("div", {class: "place"}, make("span"));
      const inputs = [0, 1].map((axis) => {
        const input = make("input", {type: "text", inputmode: "decimal", size: 6, "data-place": `${name}|${axis}`});
        input.addEventListener("input", () => {
          const {key, at} = fields.get(`place ${name}`), stated = [...(state.changes[key] ?? at)];
          stated[axis] = decimal(input.value.trim());
          changeKey(key, stated);
        });
        return input;
      });
      element.append(...inputs);
      fields.set(`place ${name}`, {element, inputs});
      group.append(element);
    }
    return group;
  }

  function fillPlaces(activeElement) {
    const keys = {device: "link.device_m", laser: "laser.position_m", roof: `buildings.${state.building}.position_m`};
    for (const [name, key] of Object.entries(keys)) {
      const place = fields.get(`place ${name}`), point = points(shown.map).find((each) => each.key === key);
      place.element.hidden = !point;
      Object.assign(place, {key, at: point?.at});
      if (!point) continue;
      place.element.firstChild.textContent = point.name;
      place.inputs.forEach((input, axis) => {
        input.setAttribute("aria-label", `${point.name}, ${"xy"[axis]} [m]`);
        if (!later && activeElement !== input) input.value = point.at[axis];
      });
    }
  }

  function choices(select, name, values) {
    const words = (value) => (name === "problem" ? PROBLEMS[value] : value || ANY[name]);
    const options = values.map((value) => make("option", {value, title: HINTS[value] ?? ""}, words(value) ?? value));
    select.replaceChildren(...options);
  }

  function choose(name, value) {
    const changes = {[name]: value};
    if (name === "building" && value) Object.assign(changes, {trajectory: null, problem: null});
    if (name === "problem") Object.assign(changes, {building: null});
    if (value === "P3") Object.assign(changes, {trajectory: null, order: null});
    if (value === "direct") changes.order = null;
    change(changes);
  }

  function slider(control) {
    const name = `${control.key}|${control.axis}`, own = `${id}-${fields.size}`;
    const words = `${control.label}${control.unit ? ` [${control.unit}]` : ""}`;
    const range = make("input", {type: "range", id: own, min: control.low, max: control.high, step: control.step, "aria-label": `${words}, slider`});
    const field = make("input", {type: "text", inputmode: "decimal", "aria-label": `${words}, value`, size: 8});
    range.dataset.key = field.dataset.key = name;
    range.addEventListener("input", () => {
      field.value = range.value;
      stated(control, Number(range.value));
    });
    field.addEventListener("input", () => {
      const value = decimal(field.value.trim());
      stated(control, value);
      if (typeof value === "number") range.value = value;
    });
    const label = make("label", {for: own, title: control.key}, words);
    const element = make("div", {class: "slider"}, label, range, field);
    fields.set(name, {key: control.key, element, inputs: [range, field]});
    return element;
  }

  function stated(control, value) {
    if (control.axis === null) return changeKey(control.key, value);
    const current = shown.controls.find((each) => each.key === control.key).whole;
    const whole = [...(state.changes[control.key] ?? current)];
    whole[control.axis] = value;
    changeKey(control.key, whole);
  }

  function buttons() {
    const row = make("div", {class: "buttons"});
    const add = (words, act) => {
      const button = make("button", {type: "button"}, words);
      button.addEventListener("click", () => act(button));
      row.append(button);
      return button;
    };
    add("Pin to compare", pin);
    add("Reset", () => change({...DEFAULTS, building: null, order: null, changes: {}}));
    if (model.get("link")) add("Copy link", copy);
    if (!shown.stored) {
      add("Mission (TOML)", () => ask({...state, file: "mission"}));
      add("Plan (JSON)", () => ask({...state, file: "plan"}));
    }
    add("Picture (SVG)", () => save(`${stem()}.svg`, new Blob([drawing()], {type: "image/svg+xml"})));
    add("Picture (PNG)", () => raster(drawing(), (blob) => save(`${stem()}.png`, blob)));
    return row;
  }

  function pin() {
    pinned = {...good, file: null, repairs: false};
    pinnedAnswer = shown;
    model.set("pinned", pinned);
    change({});
    redraw(true);
  }

  function unpin() {
    pinned = pinnedAnswer = null;
    model.set("pinned", null);
    change({});
    redraw(true);
  }

  async function copy(button) {
    const address = link();
    try {
      await navigator.clipboard.writeText(address);
      button.textContent = "Link copied";
    } catch {
      button.textContent = "It is in the address bar";
    }
    setTimeout(() => (button.textContent = "Copy link"), 2000);
  }

  function stem() {
    return shown.name.replace(/[^\p{L}\p{N}.-]+/gu, "-") || "mission";
  }

  // Columns

  function column(kind, title) {
    const parts = Object.fromEntries(FIGURES.map((name) => [name, make("figure", {class: name})]));
    const heading = make("h2", {}, title);
    const tables = make("div", {class: "tables"});
    const element = make("section", {class: `column ${kind}`, "aria-label": title}, heading);
    const words = make("p", {class: "verdict"});
    if (kind === "pinned") {
      const button = make("button", {type: "button", class: "unpin"}, "Unpin");
      button.addEventListener("click", unpin);
      heading.append(button);
    }
    element.append(words, ...Object.values(parts), tables);
    return {element, parts, tables, words};
  }

  function redraw(anew = false) {
    if (!shown || !root.isConnected) return;
    const wide = columns.clientWidth;
    if (anew !== true && wide === width) return;
    width = wide;
    sayVerdict(verdict, shown);
    if (pinnedAnswer) columns.append(other.element);
    else other.element.remove();
    root.classList.toggle("compares", Boolean(pinnedAnswer));
    const both = [shown, pinnedAnswer].filter(Boolean);
    draw(now, shown, both, !shown.stored);
    if (pinnedAnswer) draw(other, pinnedAnswer, both, false);
  }

  function sayVerdict(element, answer) {
    element.textContent = answer.verdict.text;
    element.classList.toggle("no", !answer.verdict.good);
  }

  function draw(target, answer, both, movable) {
    const {map, plane, wells} = target.parts;
    sayVerdict(target.words, answer);
    drawMap(map, answer, movable);
    drawPlane(plane, answer.plane);
    drawWells(wells, answer.wells, both);
    drawTables(target.tables, answer, movable);
  }

  // The map

  function drawMap(figure, {map, verdict: {text}}, movable) {
    const bounds = (movable && held) || map.bounds;
    const [[x1, y1], [x2, y2]] = bounds;
    const room = 0.06 * Math.max(x2 - x1, y2 - y1, 1);
    const wide = figure.clientWidth || 300, named = map.buildings.length <= MOST_NAMED;
    const walls = map.buildings.flatMap(({name, ring}) => ring.map(([x, y]) => ({x, y, name})));
    const legs = map.route ? d3.pairs(map.route) : [];
    const stops = d3.group(map.stops, (stop) => stop.at);
    const place = (name) =>
      ({origin: map.origin, destination: map.destination, hover: map.hover})[name] ??
      map.buildings.find((each) => each.name === name).at;
    const stays = map.stops.map((stop) => ({...stop, x: place(stop.at)[0], y: place(stop.at)[1]}));
    const marked = [
      ["origin", map.origin, "diamond", "currentColor"],
      ["destination", map.destination, "diamond", "currentColor"],
      ["device", map.device, "triangle", KINDS.hover],
      ["laser", map.laser, "star", LASER],
      ["hover point", map.hover, "circle", "currentColor"],
    ].filter(([, at]) => at);
    const words = marked.map(([name, [x, y]]) => ({x, y, lines: [name], needed: true}));
    for (const {x, y, at, kind, duration_s} of stays) {
      const label = words.find((each) => each.x === x && each.y === y) ?? {x, y, lines: [short(at)], needed: true};
      label.lines.push(`${kind} ${duration_s.toFixed(1)} s`);
      if (!words.includes(label)) words.push(label);
    }
    for (const {name, at: [x, y]} of named ? map.buildings : []) {
      if (!words.some((each) => each.x === x && each.y === y)) words.push({x, y, lines: [short(name)]});
    }
    const scale = (wide - 72) / (x2 - x1 + 2 * room), sights = map.sight.length <= MOST_FOCUSED ? 0.6 : 0.1;
    const plot = picture({
      width: wide,
      aspectRatio: 1,
      marginLeft: 52,
      x: {domain: [x1 - room, x2 + room], label: "x [m]", ticks: 5},
      y: {domain: [y1 - room, y2 + room], label: "y [m]", ticks: 6},
      ariaLabel: `Map. ${text}. Route: ${map.stops.map((stop) => `${stop.kind} at ${stop.at}`).join(", ") || "none"}`,
      marks: [
        map.rim && Plot.line(map.rim, {fill: KINDS.hover, fillOpacity: 0.14, stroke: KINDS.hover, clip: true}),
        Plot.link(map.sight, {
          x1: ({line}) => line[0][0], y1: ({line}) => line[0][1],
          x2: ({line}) => line[1][0], y2: ({line}) => line[1][1],
          stroke: ({clear}) => (clear ? LASER : LACKING), strokeDasharray: "2 3", strokeOpacity: sights, clip: true,
        }),
        Plot.line(walls, {
          x: "x", y: "y", z: "name", curve: "linear-closed",
          fill: "currentColor", fillOpacity: 0.22, stroke: "currentColor", strokeWidth: 0.6,
        }),
        Plot.dot(map.buildings, {
          x: ({at}) => at[0], y: ({at}) => at[1], r: named ? 2.5 : 1, fill: ({lit}) => (lit ? LASER : "#7f7f7f"),
        }),
        Plot.arrow(legs, {
          x1: ([from]) => from[0], y1: ([from]) => from[1], x2: ([, to]) => to[0], y2: ([, to]) => to[1],
          stroke: KINDS.flight, strokeWidth: 2, bend: 0, headLength: 8, insetEnd: 8,
        }),
        Plot.dot(marked, {
          x: ([, at]) => at[0], y: ([, at]) => at[1], symbol: ([,, symbol]) => symbol,
          fill: ([,,, colour]) => colour, r: 5,
        }),
        Plot.dot(stays, {x: "x", y: "y", r: 6, symbol: ({kind}) => (kind === "rest" ? "square" : "circle"),
          fill: ({kind}) => KINDS[kind], stroke: "white"}),
        placed(words, scale, legs).map(([{dx, dy, lineAnchor, textAnchor}, some]) => Plot.text(some, {
          x: "x", y: "y", text: ({lines}) => lines.join("\n"), lineHeight: 1.15, dx, dy, lineAnchor, textAnchor,
          stroke: "var(--optuav-ground)", strokeWidth: 3, fill: "currentColor",
        })),
      ],
      symbol: {type: "identity"},
      color: {type: "identity"},
    });
    const legend = key([
      map.route && [KINDS.flight, "none", "route"],
      map.rim && [KINDS.hover, "none", "reach of the link when hovering"],
      map.laser && [LASER, "2 3", "sight of the laser"],
      map.sight.some(({clear}) => !clear) && [LACKING, "2 3", "blocked sight"],
    ]);
    const stage = figure.querySelector(".stage");
    if (stage) {
      // The points over the map stay where they are, as one may have the focus or be dragged.
      stage.firstChild.replaceWith(plot);
      figure.lastChild.replaceWith(legend);
    } else figure.replaceChildren(caption("Map"), make("div", {class: "stage"}, plot), legend);
    if (movable) handles(plot, map, figure.querySelector(".stage"));
  }

  // Points that can be moved lie over the map and stay while it is drawn anew.

  function handles(plot, map, stage) {
    const [x, y] = (scales = [plot.scale("x"), plot.scale("y")]);
    if (!layer) {
      layer = d3.create("svg:svg").attr("class", "handles").attr("role", "group").attr("aria-label", "Points that can be moved");
      stage.append(layer.node());
    }
    layer.attr("viewBox", plot.getAttribute("viewBox")).attr("width", plot.getAttribute("width"));
    const movable = points(map);
    const all = movable.length <= MOST_FOCUSED;
    layer.selectAll("circle").data(movable, ({key}) => key)
      .join((enter) => enter.append("circle").each(listen))
      .attr("r", ({key}) => (key.startsWith("buildings") ? 8 : 12))
      .attr("cx", ({at}) => x.apply(at[0])).attr("cy", ({at}) => y.apply(at[1]))
      .attr("role", "button").attr("data-key", ({key}) => key)
      .attr("tabindex", ({key}) => (all || !key.startsWith("buildings") ? 0 : -1))
      .attr("aria-label", ({name, at}) =>
        `${name} at x ${Math.round(at[0])} m, y ${Math.round(at[1])} m; arrow keys move it, with shift farther`);

    function listen() {
      this.addEventListener("pointerdown", (event) => {
        event.preventDefault();
        this.focus({preventScroll: true});
        this.setPointerCapture(event.pointerId);
        held = shown.map.bounds;
      });
      this.addEventListener("pointermove", (event) => {
        if (!held || !this.hasPointerCapture(event.pointerId)) return;
        const [left, top] = d3.pointer(event, layer.node());
        const [px, py] = [left, top].map((along, axis) => {
          const {domain: [low, high]} = scales[axis];
          return Math.min(Math.max(scales[axis].invert(along), low), high);
        });
        move(d3.select(this).datum(), px, py);
      });
      for (const end of ["pointerup", "pointercancel", "lostpointercapture"]) {
        this.addEventListener(end, () => {
          if (!held) return;
          held = null;
          redraw(true);
        });
      }
      this.addEventListener("keydown", (event) => {
        const step = ARROWS[event.key];
        if (!step) return;
        event.preventDefault();
        const point = d3.select(this).datum(), far = event.shiftKey ? LONG_STEP_M : STEP_M;
        const [px, py] = state.changes[point.key] ?? point.at;
        move(point, px + far * step[0], py + far * step[1]);
      });
    }
  }

  function move({key, at}, px, py) {
    changeKey(key, [Math.round(px), Math.round(py), at[2]]);
  }

  // The plane of both times

  function drawPlane(figure, plane) {
    if (plane.words) return figure.replaceChildren(caption("Times Δ and T′"), make("p", {}, plane.words));
    const {samples: n, hover_s: [y1, y2], rest_s: [x1, x2], grid} = plane;
    const dx = (x2 - x1) / (n - 1) / 2, dy = (y2 - y1) / (n - 1) / 2;
    const over = {width: n, height: n, x1: x1 - dx, x2: x2 + dx, y1: y1 - dy, y2: y2 + dy, thresholds: [0], interpolate: "none", clip: true};
    const curves = plane.constraints.map((each) => ({...each}));
    looksOf(curves.map(({name}) => name)).forEach((look, k) => Object.assign(curves[k], look));
    const points = grid.hover_s.flatMap((y, i) => grid.rest_s.map((x, j) => ({x, y, holds: grid.feasible[i][j]})));
    const best = plane.best ? [plane.best] : [];
    const plot = picture({
      width: figure.clientWidth || 300,
      height: Math.min(420, Math.max(260, 0.8 * figure.clientWidth)),
      marginLeft: 52,
      x: {domain: [x1, x2], label: plane.rests ? "rest time T′ [s]" : "no rest: T′ = 0", ticks: plane.rests ? 6 : []},
      y: {domain: [y1, y2], label: "hover time Δ [s]"},
      ariaLabel: `Times that the constraints admit on the route ${plane.route.join(", ")}: ` +
        curves.map(({name}) => name).join("; "),
      marks: [
        curves.filter(({forbids}) => forbids).map(({excess, colour}) =>
          Plot.contour(excess.map((value) => -value), {...over, fill: colour, fillOpacity: 0.13, stroke: "none"})),
        Plot.dot(points.filter(({holds}) => !holds), {x: "x", y: "y", symbol: "times", r: 1.6, stroke: "currentColor", strokeOpacity: 0.45}),
        Plot.dot(points.filter(({holds}) => holds), {x: "x", y: "y", r: 1.8, fill: "currentColor"}),
        curves.map(({excess, colour, dash}) =>
          Plot.contour(excess, {...over, fill: "none", stroke: colour, strokeWidth: 2, strokeDasharray: dash})),
        Plot.dot(best, {x: "0", y: "1", symbol: "star", r: 8, fill: "#F0E442", stroke: "black"}),
        Plot.frame({strokeOpacity: 0.4}),
      ],
    });
    const chosen = plane.chosen ? "" : " (shortest flight; no plan)";
    const thinned = grid.one_of > 1 ? `, one of ${grid.one_of} shown` : "";
    figure.replaceChildren(
      caption(`Times Δ and T′ on ${plane.route.join(" → ")}${chosen}`), plot,
      key([
        ...curves.map(({colour, dash, name, holds_nowhere}) => [colour, dash, name + (holds_nowhere ? " (holds nowhere here)" : "")]),
        points.length > 0 && ["currentColor", "dots", `feasible, × not (slots of ${grid.slot_s} s${thinned})`],
        plane.best && ["#F0E442", "star", `optimum: T′ = ${plane.best[0].toFixed(2)} s, Δ = ${plane.best[1].toFixed(2)} s`],
      ]));
  }

  // Both wells over time

  function drawWells(figure, wells, both) {
    if (!wells) return figure.replaceChildren(caption("Charge over time"), make("p", {}, "There is no plan to fly."));
    const courses = both.map((each) => each.wells).filter(Boolean);
    const end = d3.max(courses, ({time_s}) => time_s.at(-1));
    const top = d3.max(courses, ({full_As, upper_As}) => Math.max(full_As, d3.max(upper_As)));
    const low = Math.min(0, d3.min(courses, ({total_As}) => d3.min(total_As)));
    const rows = wells.time_s.map((time, k) => ({
      time, bound: wells.bound_As[k], total: wells.total_As[k], upper: wells.upper_As[k],
    }));
    const strip = [1.03 * top, 1.09 * top];
    const area = {x: "time", y1: "bound", fillOpacity: 0.85};
    const plot = picture({
      width: figure.clientWidth || 300,
      height: 260,
      marginLeft: 62,
      x: {domain: [0, end], label: "time since take-off [s]"},
      y: {domain: [low, strip[1]], label: "charge [A s]", ticks: 5},
      ariaLabel: "Charge in both wells over time: " +
        wells.phases.map(({kind, at, start_s}) => `${kind} ${kind === "flight" ? "to" : "at"} ${at} from ${start_s.toFixed(0)} s`).join("; "),
      marks: [
        Plot.areaY(rows, {x: "time", y1: 0, y2: "bound", fill: BOUND, fillOpacity: 0.85}),
        Plot.areaY(rows, {...area, y2: "upper", fill: AVAILABLE}),
        wells.lacks ? Plot.areaY(rows, {...area, y1: "total", y2: "upper", fill: LACKING}) : null,
        Plot.ruleY([wells.full_As, wells.least_As], {strokeDasharray: "4 3", strokeOpacity: 0.7}),
        Plot.text(["full B"], {x: end, y: wells.full_As, textAnchor: "end", dy: 8, strokeWidth: 3, stroke: "var(--optuav-ground)", fill: "currentColor"}),
        // At the take-off both wells are full: the words are on one of them.
        Plot.text(["to be kept η₀B"], {x: 0, y: wells.least_As, textAnchor: "start", dx: 4, dy: -7, fill: wells.least_As < wells.bound_As[0] ? "black" : "white"}),
        Plot.rectY(wells.phases, {x1: "start_s", x2: "end_s", y1: strip[0], y2: strip[1], fill: ({kind}) => KINDS[kind], title: ({kind, at}) => `${kind} ${at}`}),
        wells.dry_s === null ? null : Plot.ruleX([wells.dry_s], {stroke: LACKING, strokeWidth: 2}),
        wells.overfull_s === null ? null : Plot.ruleX([wells.overfull_s], {stroke: LACKING, strokeWidth: 2, strokeDasharray: "2 2"}),
        Plot.ruleY([0]),
      ],
    });
    figure.replaceChildren(
      caption("Charge over time"), plot,
      key([
        [AVAILABLE, "block", "available well y₁"], [BOUND, "block", "bound well y₂"],
        wells.lacks && [LACKING, "block", "not there"],
        ...Object.entries(KINDS).filter(([kind]) => wells.phases.some((each) => each.kind === kind)).map(([kind, colour]) => [colour, "block", `${kind} (strip)`]),
        wells.dry_s !== null && [LACKING, "none", `dry at ${wells.dry_s.toFixed(1)} s`],
        wells.overfull_s !== null && [LACKING, "2 2", `driven past full at ${wells.overfull_s.toFixed(1)} s`],
      ]));
  }

  // Tables

  function drawTables(target, answer, movable) {
    const parts = [];
    if (answer.reasons.length) {
      parts.push(folded("Why there is no plan", list(answer.reasons), true));
      if (answer.repairs.length) parts.push(folded("Feasible if", table(["change", ""], answer.repairs), true));
      else if (movable) {
        const button = make("button", {type: "button"}, "What would make it feasible?");
        button.addEventListener("click", () => ask({...state, repairs: true}));
        parts.push(button);
      }
    }
    if (answer.constraints.length) {
      const rows = answer.constraints.map((each) => [each.label, each.statement, each.figures, each.spare]);
      const steps = rows.some(([, statement]) => statement.includes("y1_"));
      const title = `Constraints${steps ? "; y1_k is the charge in the available well after step k" : ""}`;
      parts.push(folded(title, table(["constraint", "as stated", "in numbers", "to spare"], rows), true));
    }
    if (answer.prices.length) {
      const rows = answer.prices.map((each) => [each.key, each.value, each.less, each.more]);
      const told = list(answer.prices.map(({words}) => words).filter(Boolean));
      const title = `Shadow prices: ${answer.objective} per unit, as a slope at the margin, the others held`;
      const steps = told.children.length ? ["For whole steps, solved again:", told] : [];
      parts.push(folded(title, make("div", {}, table(["parameter", "value", "less", "more"], rows, "figures"), ...steps), true));
    }
    parts.push(folded("Question and answer", table(["", ""], answer.facts), false));
    const open = [...target.querySelectorAll("details")].map((each) => [each.firstChild.textContent, each.open]);
    for (const part of parts) {
      const known = open.find(([title]) => title === part.firstChild?.textContent);
      if (known && part.tagName === "DETAILS") part.open = known[1];
    }
    target.replaceChildren(...parts);
  }

  // The picture: all figures of all columns in one SVG, in the colours of paper.

  function drawing() {
    const drawn = [...columns.querySelectorAll(".column")];
    const wide = d3.max(drawn, (each) => each.clientWidth) + 24;
    const whole = d3.create("svg:svg").attr("xmlns", "http://www.w3.org/2000/svg").attr("color", "black")
      .attr("font-family", "system-ui, sans-serif").attr("font-size", 12);
    let tallest = 0;
    drawn.forEach((section, place) => {
      let top = 24;
      const write = (words, weight = "normal", aside = 12) => {
        const lines = [""], most = (wide - aside - 12) / LETTER_PX;
        for (const word of words.split(" ")) {
          if (lines.at(-1).length + word.length > most) lines.push("");
          lines.push(`${lines.pop()} ${word}`.trim());
        }
        for (const line of lines) {
          whole.append("text").attr("x", place * wide + aside).attr("y", top).attr("font-weight", weight).text(line);
          top += 18;
        }
      };
      const put = (svg, y) => {
        const copy = svg.cloneNode(true);
        for (const [name, value] of Object.entries({x: place * wide + 12, y, fill: "black"})) copy.setAttribute(name, value);
        for (const each of copy.querySelectorAll("[stroke^='var']")) each.setAttribute("stroke", "white");
        whole.node().append(copy);
      };
      write(`${section.getAttribute("aria-label")}: ${section.querySelector(".verdict").textContent}`, "bold");
      for (const figure of section.querySelectorAll("figure")) {
        write(figure.querySelector("figcaption").textContent, "bold");
        const plot = figure.querySelector("svg[viewBox]");
        if (plot) {
          put(plot, top - 8);
          top += Number(plot.getAttribute("height")) + 12;
        }
        for (const item of figure.querySelectorAll("li")) {
          put(item.firstChild, top - 10);
          write(item.textContent, "normal", 40);
        }
        top += 12;
      }
      tallest = Math.max(tallest, top);
    });
    whole.attr("width", wide * drawn.length).attr("height", tallest).attr("viewBox", [0, 0, wide * drawn.length, tallest]);
    whole.insert("rect", ":first-child").attr("width", "100%").attr("height", "100%").attr("fill", "white");
    return new XMLSerializer().serializeToString(whole.node());
  }
}

// Elements; every word is text, never markup.

function make(tag, attributes = {}, ...content) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...content);
  return element;
}

function picture({x, y, ...options}) {
  const plot = Plot.plot({...options, x: {tickFormat: grouped, ...x}, y: {tickFormat: grouped, ...y}});
  plot.setAttribute("role", "img");
  return plot;
}

// As in other pictures, thousands of long numbers stand apart.

function grouped(value) {
  return d3.format(Math.abs(value) < 10000 ? "~r" : ",~r")(value).replaceAll(",", "\u2009");
}

function points(map) {
  return [
    {key: "link.device_m", name: "device", at: map.device},
    ...(map.laser ? [{key: "laser.position_m", name: "laser", at: map.laser}] : []),
    ...map.buildings.map(({name, at}) => ({key: `buildings.${name}.position_m`, name: `roof of ${name}`, at})),
  ];
}

// Colours and dashes by the names of constraints, not by what was seen before: a link shows the same ones.

function looksOf(names) {
  const taken = new Set(), most = Math.max(COLOURS.length, names.length);
  return names.map((name) => {
    let look = d3.sum(name, (letter) => letter.codePointAt(0)) % COLOURS.length;
    while (taken.has(look)) look = (look + 1) % most;
    taken.add(look);
    const round = Math.floor(look / COLOURS.length);
    return {colour: COLOURS[look % COLOURS.length], dash: DASHES[(look + round) % DASHES.length]};
  });
}

// A decimal number; other text as it is, for the answer to refuse.

function decimal(text) {
  return /^[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?$/i.test(text) ? Number(text) : text;
}

function short(name) {
  return name.length > LONGEST_NAME ? `${name.slice(0, LONGEST_NAME - 1)}…` : name;
}

// Labels by side of their points, where no other label and no leg is; those that are not needed may have no place.

function placed(labels, scale, legs) {
  const onLegs = legs.flatMap(([[x1, y1], [x2, y2]]) => {
    const count = Math.ceil((Math.hypot(x2 - x1, y2 - y1) * scale) / 6);
    return d3.range(1, count).map((k) => ({x: x1 + (k / count) * (x2 - x1), y: y1 + (k / count) * (y2 - y1)}));
  });
  const taken = [...labels, ...onLegs].map(({x, y}) => [x * scale - 3, -y * scale - 3, x * scale + 3, 3 - y * scale]);
  const found = SIDES.map((side) => [side, []]);
  for (const label of labels) {
    const width = LETTER_PX * d3.max(label.lines, ({length}) => length), height = 13 * label.lines.length;
    const boxes = SIDES.map(({dx, dy}) => {
      const left = label.x * scale + (dx ? dx - (dx < 0 ? width : 0) : -width / 2);
      const top = -label.y * scale + (dy ? dy - (dy < 0 ? height : 0) : -height / 2);
      return [left, top, left + width, top + height];
    });
    const shared = boxes.map(([a, b, c, d]) =>
      d3.sum(taken, ([e, f, g, h]) => Math.max(0, Math.min(c, g) - Math.max(a, e)) * Math.max(0, Math.min(d, h) - Math.max(b, f))));
    const side = d3.minIndex(shared);
    if (shared[side] > 0 && !label.needed) continue;
    taken.push(boxes[side]);
    found[side][1].push(label);
  }
  return found;
}

function caption(words) {
  return make("figcaption", {}, words);
}

function list(lines) {
  return make("ul", {}, ...lines.map((line) => make("li", {}, line)));
}

function table(heads, rows, kind = "") {
  const cells = (tag, row) => make("tr", {}, ...row.map((cell) => make(tag, {}, cell)));
  const body = make("table", {class: kind}, ...(heads.some(Boolean) ? [cells("th", heads)] : []), ...rows.map((row) => cells("td", row)));
  return make("div", {class: "wide", tabindex: 0, role: "group", "aria-label": heads.filter(Boolean).join(", ") || "facts"}, body);
}

function folded(title, content, open) {
  const element = make("details", {}, make("summary", {}, title), content);
  element.open = open;
  return element;
}

function key(entries) {
  return make("ul", {class: "key"}, ...entries.filter(Boolean).map(([colour, look, words]) => {
    const swatch = d3.create("svg:svg").attr("width", 22).attr("height", 12).attr("aria-hidden", "true");
    if (look === "block") swatch.append("rect").attr("width", 22).attr("height", 12).attr("fill", colour);
    else if (look === "dots") swatch.append("circle").attr("cx", 11).attr("cy", 6).attr("r", 2).attr("fill", colour);
    else if (look === "star") {
      swatch.append("path").attr("d", d3.symbol(d3.symbolStar, 60)()).attr("transform", "translate(11 6)")
        .attr("fill", colour).attr("stroke", "black");
    } else {
      swatch.append("line").attr("x2", 22).attr("y1", 6).attr("y2", 6).attr("stroke", colour)
        .attr("stroke-width", 2).attr("stroke-dasharray", look);
    }
    return make("li", {}, swatch.node(), words);
  }));
}

function brief(state) {
  const kept = {...state};
  for (const name of ["number", "file", "repairs"]) delete kept[name];
  return Object.fromEntries(Object.entries(kept).filter(([name, value]) => value && value !== DEFAULTS[name]));
}

function save(name, blob) {
  const link = make("a", {href: URL.createObjectURL(blob), download: name});
  document.body.append(link);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

function raster(svg, done) {
  const image = new Image(), address = URL.createObjectURL(new Blob([svg], {type: "image/svg+xml"}));
  image.onload = () => {
    const canvas = make("canvas", {width: 2 * image.width, height: 2 * image.height});
    const context = canvas.getContext("2d");
    context.scale(2, 2);
    context.drawImage(image, 0, 0);
    URL.revokeObjectURL(address);
    canvas.toBlob(done, "image/png");
  };
  image.src = address;
}

export default {render};

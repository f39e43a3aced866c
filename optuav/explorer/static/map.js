// The map: one scale for x and y, terrain to its edges, places that can be moved, and the drone that flies.
import {Labels, around, colour, dots, grouped, picture, place, wide, write} from "./drawing.js";

const MOST_NAMED = 40, MOST_FOCUSED = 60;
const STEP_M = 10, LONG_STEP_M = 100;
const LONGEST_NAME = 24;
const ARROWS = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowDown: [0, -1], ArrowUp: [0, 1]};
const FALLEN = [[30, 0.3, 10, 0], [56, 0.55, 28, 2], [86, 1, 55, 5]]; // Steps of a fall: below, strength, turn, aside
const LEAST_S = 0.05; // Of a stay that is named
const HANDLE_PX = 12, ROOF_PX = 8;

export function drawMap(draw, answer, {window, size, u, all}) {
  const {map, verdict} = answer, width = draw.clientWidth, height = draw.clientHeight;
  const [[x1, y1], [x2, y2]] = window, named = map.buildings.length <= MOST_NAMED;
  const pad = {top: 16 * u, bottom: 30 * u, side: Math.min(0.2 * width, (u > 1 ? 38 : 42) * u)};
  const scale = Math.max(1e-9, Math.min((width - 2 * pad.side) / Math.max(x2 - x1, 1), (height - pad.top - pad.bottom) / Math.max(y2 - y1, 1)));
  const left = (x1 + x2 - width / scale) / 2, spare = height - pad.top - pad.bottom - (y2 - y1) * scale, low = y1 - (pad.bottom + spare / 2) / scale;
  const right = left + width / scale, high = low + height / scale;
  const step = d3.tickStep(0, Math.max(x2 - x1, y2 - y1), 7), grid = (a, b) => d3.range(Math.ceil(a / step) * step, b, step);
  const used = new Set(map.stops.map(({at}) => at)), rests = map.stops.filter(({kind}) => kind === "rest");
  const walls = map.buildings.flatMap(({name, ring}) => ring.map(([x, y]) => ({x, y, name})));
  const at = (name) => ({origin: map.origin, destination: map.destination, hover: map.hover})[name] ?? map.buildings.find((each) => each.name === name)?.at;
  const legs = map.route ? d3.pairs(map.route) : [], route = (look) => Plot.line(map.route ?? [], {...look, strokeLinejoin: "round"});
  const arrows = legs.filter(([a, b]) => Math.hypot(b[0] - a[0], b[1] - a[1]) * scale > 30 * u)
    .map(([[a, b], [c, d]]) => ({x: (a + c) / 2, y: (b + d) / 2, turn: 90 - (Math.atan2(d - b, c - a) * 180) / Math.PI}));
  const sight = ({line: [[a, b], [c, d]]}) => ({x1: a, y1: b, x2: c, y2: d});
  const lit = map.sight.map((each) => ({...each, ...sight(each), used: rests.some(({at: name}) => same(at(name), each.line[1]))}));
  const ends = ["origin", "destination"].map((name) => ({name, x: map[name][0], y: map[name][1]}));
  const xy = {x: ([x]) => x, y: ([, y]) => y}, edge = {stroke: colour("ink"), strokeWidth: 1.25 * u};
  const plot = picture({
    width, height, size, margin: 0,
    x: {domain: [left, right], axis: null},
    y: {domain: [low, high], axis: null},
    label: `Map. ${verdict.text}. Route: ${map.stops.map((stop) => `${stop.kind} at ${stop.at}`).join(", ") || "none"}`,
    symbol: {type: "identity"}, color: {type: "identity"},
    marks: [
      Plot.ruleX(grid(left, right), {stroke: colour("faint")}),
      Plot.ruleY(grid(low, high), {stroke: colour("faint")}),
      map.rim && Plot.line(map.rim, {fill: colour("hover"), fillOpacity: 0.13, stroke: colour("hover"), strokeWidth: 1.25 * u}),
      [true, false].map((clear) => Plot.link(lit.filter((each) => each.clear === clear), {
        x1: "x1", y1: "y1", x2: "x2", y2: "y2", stroke: colour(clear ? "laser" : "muted"),
        strokeWidth: ({used}) => (used ? 2.25 : 0.9) * u, strokeOpacity: ({used}) => (used ? 1 : named ? 0.45 : 0.1), strokeDasharray: clear ? `${2 * u} ${3 * u}` : `${u} ${6 * u}`,
      })),
      Plot.line(walls, {x: "x", y: "y", z: "name", curve: "linear-closed", fill: colour("muted"), fillOpacity: 0.18, stroke: colour("muted"), strokeWidth: 0.6}),
      route({stroke: colour("casing"), strokeWidth: 4.75 * u}),
      route({stroke: colour("flight"), strokeWidth: 2.75 * u}),
      Plot.dot(arrows, {x: "x", y: "y", rotate: "turn", symbol: "triangle", r: 5.5 * u, fill: colour("flight"), stroke: colour("casing")}),
      Plot.dot(map.buildings.filter(({name}) => !used.has(name)), {
        x: (each) => each.at[0], y: (each) => each.at[1], symbol: "square", r: (named ? 3.9 : 1) * u, fill: ({lit: sees}) => colour(sees ? "muted" : "bounds"),
      }),
      Plot.dot(rests, {x: (stop) => at(stop.at)[0], y: (stop) => at(stop.at)[1], symbol: "square", r: 6.7 * u, fill: colour("rest"), ...edge}),
      Plot.dot(ends, {x: "x", y: "y", symbol: "diamond", r: 6.5 * u, fill: colour("ink")}),
      map.laser && Plot.dot([map.laser], {...xy, symbol: "triangle", r: 7 * u, fill: colour("laser")}),
      Plot.dot([map.device], {...xy, r: 5 * u, fill: colour("ink")}),
      map.hover && Plot.dot([map.hover], {...xy, r: 6.5 * u, fill: colour("hover"), ...edge}),
    ],
  });
  const stage = draw.firstChild ? draw : (draw.append(plot), draw);
  // The points over the map stay where they are, as one may have the focus or be dragged.
  stage.firstChild.replaceWith(plot);
  const x = place(plot, "x"), y = place(plot, "y");
  d3.select(plot).append("circle").attr("cx", x(map.device[0])).attr("cy", y(map.device[1])).attr("r", 12 * u).attr("fill", "none")
    .attr("stroke", colour("muted")).attr("stroke-width", 1.25 * u).attr("stroke-dasharray", `${3 * u} ${3 * u}`); // It can be dragged
  const labels = name({plot, map, at, used, named, all, legs, ends, x, y, size, u, width, height});
  const coarse = step * Math.max(step === 500 ? 2 : 1, 2 ** Math.ceil(Math.log2((2.4 * size) / (step * scale)))); // Words keep apart
  for (const value of d3.range(Math.ceil(y1 / coarse) * coarse, high, coarse)) {
    const words = coarse % 1000 ? `${grouped(value)} m` : `${grouped(value / 1000)} km`, level = {x: 4, y: y(value) - 3, anchor: "start"};
    const found = y(value) > size * 1.5 && labels.find([words], [level], {size: size - 1, needed: false});
    if (found) write(plot, {...found, words, size: size - 1, fill: "muted"});
  }
  return {plot, x, y, at};
}

function same([a, b], [c, d]) { return Math.hypot(a - c, b - d) < 1e-6; }

// Names of the places: those that the plan uses first, others where there is room.
function name({plot, map, at, used, named, all, legs, ends, x, y, size, u, width, height}) {
  const labels = new Labels(width, height), px = ([a, b]) => [x(a), y(b)];
  labels.avoid(legs.flatMap(([a, b]) => dots([px(a), px(b)])));
  const marks = [map.device, map.hover, map.laser, map.origin, map.destination, ...map.buildings.map((each) => each.at)].filter(Boolean).map(px);
  for (const [a, b] of marks) labels.keep([a - 5 * u, b - 5 * u, a + 5 * u, b + 5 * u]);
  const put = (lines, point, {gap = 10 * u, order = null, first = 600, rest = 400, fill = "ink", needed = true, scaled = size} = {}) => {
    const [a, b] = px(point), spots = around(a, b, gap, scaled, lines.length);
    const found = labels.find(lines, order ? order.map((k, cost) => ({...spots[k], cost})) : spots, {size: scaled, weight: first, needed});
    if (found) lines.forEach((words, k) => write(plot, {...found, y: found.y + 1.25 * k * scaled, words, size: scaled, fill, weight: k ? rest : first}));
  };
  for (const {kind, at: stop, duration_s} of map.stops) {
    if (duration_s < LEAST_S) put([kind === "hover" ? "hover point" : `${short(stop)}: pass by`], at(stop));
    else if (kind === "hover") put([`hover ${duration_s.toFixed(1)} s`], at(stop), {gap: 12 * u, order: [2, 0, 1, 3, 4, 5, 6, 7]});
    else {
      const whole = `${short(stop)}: rest ${duration_s.toFixed(1)} s`, fits = x(at(stop)[0]) + 11 * u + wide(whole, size, 600) < width;
      put(fits ? [whole] : [short(stop), `rest ${duration_s.toFixed(0)} s`], at(stop));
    }
  }
  const small = {first: 400, order: [3, 0, 1, 2, 4, 5, 6, 7]};
  for (const {name: words, x: a, y: b} of ends) put([words], [a, b], {...small, gap: 11 * u});
  if (map.laser) put(["laser"], map.laser, {...small, gap: 11 * u});
  put(["device"], map.device, {first: 400, gap: 15 * u, order: [2, 0, 1, 3, 4, 5, 6, 7]});
  if (map.hover && !used.has("hover")) put(["hover point"], map.hover, {first: 400});
  if (!named || !all) return labels;
  const middle = width / 2, sides = (aside) => [...(Math.abs(aside) < 0.09 * width ? [3] : []), ...(aside < 0 ? [1, 0] : [0, 1]), 3, 2, 4, 5, 6, 7];
  for (const {name: words, at: point} of map.buildings) {
    if (!used.has(words)) put([short(words)], point, {first: 400, gap: 7 * u, fill: "muted", needed: false, scaled: size - 1, order: sides(x(point[0]) - middle)});
  }
  return labels;
}

export function short(name) { return name.length > LONGEST_NAME ? `${name.slice(0, LONGEST_NAME - 1)}…` : name; }

export function points(map) {
  return [
    {key: "link.device_m", name: "device", at: map.device},
    ...(map.laser ? [{key: "laser.position_m", name: "laser", at: map.laser}] : []),
    ...map.buildings.map(({name, at}) => ({key: `buildings.${name}.position_m`, name: `roof of ${name}`, at})),
  ];
}

// Points that can be moved lie over the map and stay while it is drawn anew.
export class Handles {
  #layer = null;
  #scales = null;
  #session;
  constructor(session) { this.#session = session; }
  draw(stage, {plot, x, y}, map) {
    this.#scales = [x, y];
    if (!this.#layer) {
      this.#layer = d3.create("svg:svg").attr("class", "handles").attr("role", "group").attr("aria-label", "Points that can be moved");
      stage.append(this.#layer.node());
    }
    const movable = points(map), all = movable.length <= MOST_FOCUSED, handles = this;
    this.#layer.attr("width", plot.getAttribute("width")).attr("height", plot.getAttribute("height"));
    this.#layer.selectAll("circle").data(movable, ({key}) => key)
      .join((enter) => enter.append("circle").each(function () { handles.#listen(this); }))
      .attr("r", ({key}) => (key.startsWith("buildings") ? ROOF_PX : HANDLE_PX))
      .attr("cx", ({at}) => x(at[0])).attr("cy", ({at}) => y(at[1]))
      .attr("role", "button").attr("data-key", ({key}) => key)
      .attr("tabindex", ({key}) => (all || !key.startsWith("buildings") ? 0 : -1))
      .attr("aria-label", ({name, at}) =>
        `${name} at x ${Math.round(at[0])} m, y ${Math.round(at[1])} m; arrow keys move it, with shift farther`);
  }
  #listen(node) {
    node.addEventListener("pointerdown", (event) => {
      event.preventDefault();
      node.focus({preventScroll: true});
      node.setPointerCapture(event.pointerId);
      this.#session.hold();
    });
    node.addEventListener("pointermove", (event) => {
      if (!node.hasPointerCapture(event.pointerId)) return;
      const at = d3.pointer(event, this.#layer.node()), ends = ["width", "height"].map((name) => Number(this.#layer.attr(name)));
      this.#move(d3.select(node).datum(), ...at.map((px, axis) => this.#scales[axis].invert(Math.min(Math.max(px, 0), ends[axis]))));
    });
    for (const end of ["pointerup", "pointercancel", "lostpointercapture"]) node.addEventListener(end, () => this.#session.release());
    node.addEventListener("keydown", (event) => {
      const step = ARROWS[event.key];
      if (!step) return;
      event.preventDefault();
      this.#session.holdByKey();
      const point = d3.select(node).datum(), far = event.shiftKey ? LONG_STEP_M : STEP_M;
      const [px, py] = this.#session.state.changes[point.key] ?? point.at;
      this.#move(point, px + far * step[0], py + far * step[1]);
    });
  }
  #move({key, at}, px, py) { this.#session.changeKey(key, [Math.round(px), Math.round(py), at[2]]); }
}

// The drone at a moment: on its way, at a stop, or falling once its available well is empty.
export function drawDrone({plot, x, y, at}, {map, wells, verdict}, moment, {size, u}) {
  d3.select(plot).selectAll(".drone").remove();
  if (moment === null || !wells) return;
  const group = d3.select(plot).append("g").attr("class", "drone"), falls = wells.dry_s !== null && moment >= wells.dry_s;
  const time = falls ? wells.dry_s : moment, k = Math.max(0, wells.phases.findIndex(({end_s}) => time <= end_s));
  const {kind, at: end, start_s, end_s} = wells.phases[k], to = at(end), from = kind === "flight" ? at(wells.phases[k - 1]?.at ?? "origin") : to;
  const share = kind === "flight" ? d3.easeQuadInOut((time - start_s) / Math.max(end_s - start_s, 1e-9)) : 0;
  const px = x(from[0] + share * (to[0] - from[0])), py = y(from[1] + share * (to[1] - from[1]));
  const one = (dx, dy, opacity, turn) => {
    const craft = group.append("g").attr("transform", `translate(${px + dx * u} ${py + dy * u}) rotate(${turn}) scale(${u})`).attr("opacity", opacity)
      .attr("stroke", colour(falls ? "dry" : "ink")).attr("stroke-width", 2.5).attr("fill", "none");
    craft.append("path").attr("d", "M-9,-6L9,6M-9,6L9,-6");
    for (const [cx, cy] of [[-11, -7], [11, -7], [-11, 7], [11, 7]]) craft.append("circle").attr("cx", cx).attr("cy", cy).attr("r", 4.5);
  };
  if (!falls) return one(0, 0, 1, 0);
  const room = Math.max(0.3, Math.min(1, (Number(plot.getAttribute("height")) - py - 2 * size) / (118 * u)));
  for (const [down, opacity, turn, aside] of FALLEN) one(aside, down * room, opacity, turn);
  write(group.node(), {x: px, y: py + 118 * room * u, words: verdict.event, size, anchor: "middle", weight: 600, fill: "dry"});
}

// The map: one scale for x and y, terrain to its edges, and the places with their names.
import {colour, grouped, picture, place, write} from "./drawing.js";
import {Labels, around, dots} from "./labels.js";

const MOST_NAMED = 40; // Buildings
const LONGEST_NAME = 24;
const LEAST_S = 0.05; // Of a stay that is named
const ARROW_PX = 30; // Of a leg that has an arrow, at least
const ENDS = ["origin", "destination", "hover"]; // Places that no building is named by
const POINT = {x: ([x]) => x, y: ([, y]) => y};
const ABOVE = [2, 0, 1, 3, 4, 5, 6, 7]; // Candidates of `around`, the preferred first
const BELOW = [3, 0, 1, 2, 4, 5, 6, 7];

export function drawMap(draw, answer, {window, size, u, all}) {
  const {map} = answer;
  const named = map.buildings.length <= MOST_NAMED;
  const frame = frameOf(draw, window, u);
  const plot = picture({
    width: frame.width,
    height: frame.height,
    size,
    margin: 0,
    x: {domain: frame.across, axis: null},
    y: {domain: frame.up, axis: null},
    symbol: {type: "identity"},
    label: mapWords(answer),
    marks: [terrain(map, frame, u), sights(map, u, named), route(map, frame.scale, u), spots(map, u, named)],
  });
  // The points over the map stay where they are, as one may have the focus or be dragged.
  if (draw.firstChild) draw.firstChild.replaceWith(plot);
  else draw.append(plot);
  const view = {...frame, plot, size, u, x: place(plot, "x"), y: place(plot, "y")};
  const labels = nameStops(view, map);
  if (named && all) nameBuildings(view, map, labels);
  nameLevels(view, window[0][1], labels);
  return view;
}

function mapWords({map, verdict}) {
  const stops = map.stops.map(({kind, at}) => `${kind} at ${at}`).join(", ");
  return `Map. ${verdict.text}. Route: ${stops || "none"}`;
}

// Ends of both axes [m] and pixels per m, so that the window is inside.
function frameOf(draw, [[x1, y1], [x2, y2]], u) {
  const [width, height] = [draw.clientWidth, draw.clientHeight];
  const side = Math.min(0.2 * width, (u > 1 ? 38 : 42) * u);
  const [top, bottom] = [16 * u, 30 * u];
  const room = [width - 2 * side, height - top - bottom];
  const fits = Math.min(room[0] / Math.max(x2 - x1, 1), room[1] / Math.max(y2 - y1, 1));
  const scale = Math.max(1e-9, fits);
  const left = (x1 + x2 - width / scale) / 2;
  const spare = room[1] - (y2 - y1) * scale;
  const low = y1 - (bottom + spare / 2) / scale;
  const step = d3.tickStep(0, Math.max(x2 - x1, y2 - y1), 7);
  return {width, height, scale, step, across: [left, left + width / scale], up: [low, low + height / scale]};
}

// Position of a place by its name [m].
export function placeOf(map, name) {
  return ENDS.includes(name) ? map[name] : map.buildings.find((building) => building.name === name)?.at;
}

function terrain(map, {step, across, up}, u) {
  const every = ([from, to]) => d3.range(Math.ceil(from / step) * step, to, step);
  const rim = {fill: colour("hover"), fillOpacity: 0.13, stroke: colour("hover"), strokeWidth: 1.25 * u};
  return [
    Plot.ruleX(every(across), {stroke: colour("faint")}),
    Plot.ruleY(every(up), {stroke: colour("faint")}),
    map.rim && Plot.line(map.rim, rim),
  ];
}

// Lines of sight of the laser, those of the plan stronger; and the walls that cut some of them.
function sights(map, u, named) {
  const rests = map.stops.filter(({kind}) => kind === "rest").map(({at}) => placeOf(map, at));
  const same = ([a, b], [c, d]) => Math.hypot(a - c, b - d) < 1e-6;
  const lines = map.sight.map(({line: [from, to], clear}) => ({
    from,
    to,
    clear,
    used: rests.some((rest) => same(rest, to)),
  }));
  const look = (clear) => ({
    x1: ({from}) => from[0],
    y1: ({from}) => from[1],
    x2: ({to}) => to[0],
    y2: ({to}) => to[1],
    stroke: colour(clear ? "laser" : "muted"),
    strokeWidth: ({used}) => (used ? 2.25 : 0.9) * u,
    strokeOpacity: ({used}) => (used ? 1 : named ? 0.45 : 0.1),
    strokeDasharray: clear ? `${2 * u} ${3 * u}` : `${u} ${6 * u}`,
  });
  const walls = map.buildings.flatMap(({name, ring: corners}) => corners.map(([x, y]) => ({x, y, name})));
  const wall = {fill: colour("muted"), fillOpacity: 0.18, stroke: colour("muted"), strokeWidth: 0.6};
  return [
    ...[true, false].map((clear) => Plot.link(lines.filter((sight) => sight.clear === clear), look(clear))),
    Plot.line(walls, {x: "x", y: "y", z: "name", curve: "linear-closed", ...wall}),
  ];
}

function route({route: way}, scale, u) {
  const legs = d3.pairs(way ?? []);
  const arrows = legs
    .filter(([[a, b], [c, d]]) => Math.hypot(c - a, d - b) * scale > ARROW_PX * u)
    .map(([[a, b], [c, d]]) => ({
      x: (a + c) / 2,
      y: (b + d) / 2,
      turn: 90 - (Math.atan2(d - b, c - a) * 180) / Math.PI,
    }));
  const arrow = {symbol: "triangle", r: 5.5 * u, fill: colour("flight"), stroke: colour("casing")};
  return [
    Plot.line(way ?? [], {stroke: colour("casing"), strokeWidth: 4.75 * u, strokeLinejoin: "round"}),
    Plot.line(way ?? [], {stroke: colour("flight"), strokeWidth: 2.75 * u, strokeLinejoin: "round"}),
    Plot.dot(arrows, {x: "x", y: "y", rotate: "turn", ...arrow}),
  ];
}

function spots(map, u, named) {
  const used = new Set(map.stops.map(({at}) => at));
  const rests = map.stops.filter(({kind}) => kind === "rest").map(({at}) => placeOf(map, at));
  const edge = {stroke: colour("ink"), strokeWidth: 1.25 * u};
  const ring = {r: 12 * u, ...edge, stroke: colour("muted"), strokeDasharray: `${3 * u} ${3 * u}`};
  return [
    Plot.dot(map.buildings.filter(({name}) => !used.has(name)), {
      x: ({at}) => at[0],
      y: ({at}) => at[1],
      symbol: "square",
      r: (named ? 3.9 : 1) * u,
      fill: ({lit}) => colour(lit ? "muted" : "bounds"),
    }),
    Plot.dot(rests, {...POINT, symbol: "square", r: 6.7 * u, fill: colour("rest"), ...edge}),
    Plot.dot([map.origin, map.destination], {...POINT, symbol: "diamond", r: 6.5 * u, fill: colour("ink")}),
    map.laser && Plot.dot([map.laser], {...POINT, symbol: "triangle", r: 7 * u, fill: colour("laser")}),
    Plot.dot([map.device], {...POINT, r: 5 * u, fill: colour("ink")}),
    Plot.dot([map.device], {...POINT, ...ring}), // It can be dragged
    map.hover && Plot.dot([map.hover], {...POINT, r: 6.5 * u, fill: colour("hover"), ...edge}),
  ];
}

// Writes lines of words beside a point [m] where they are free; the first is strong.
function put({plot, x, y, u, ...view}, labels, lines, point, options = {}) {
  const {gap = 10 * u, order = null, weight = 400, fill = "ink", needed = true, size = view.size} = options;
  const candidates = around(x(point[0]), y(point[1]), gap, size, lines.length);
  const ordered = order ? order.map((k, cost) => ({...candidates[k], cost})) : candidates;
  const found = labels.find(lines, ordered, {size, weight, needed});
  if (!found) return null;
  lines.forEach((words, k) => {
    const y_px = found.y + 1.25 * k * size;
    write(plot, {...found, y: y_px, words, size, fill, weight: k ? 400 : weight});
  });
  return found;
}

// Names of places, those that the plan uses first.
function nameStops(view, map) {
  const {x, y, u} = view;
  const labels = new Labels(view.width, view.height);
  const px = ([a, b]) => [x(a), y(b)];
  labels.avoid(dots((map.route ?? []).map(px)));
  const marks = [map.device, map.hover, ...map.buildings.map(({at}) => at)];
  for (const mark of marks.filter(Boolean)) labels.keepAround(px(mark), 5 * u);
  for (const mark of [map.origin, map.destination, map.laser].filter(Boolean)) {
    labels.keepAround(px(mark), 7 * u, 10 * u);
  }
  for (const stop of map.stops) nameStop(view, map, stop, labels);
  for (const name of ["laser", "origin", "destination"]) {
    if (map[name]) put(view, labels, [name], map[name], {order: BELOW, gap: 13 * u});
  }
  put(view, labels, ["device"], map.device, {gap: 15 * u, order: ABOVE});
  const hovers = map.stops.some(({at}) => at === "hover");
  if (map.hover && !hovers) put(view, labels, ["hover point"], map.hover);
  return labels;
}

function nameStop(view, map, {kind, at, duration_s}, labels) {
  const point = placeOf(map, at);
  const strong = (lines, options) => put(view, labels, lines, point, {weight: 600, ...options});
  if (duration_s < LEAST_S) return strong([kind === "hover" ? "hover point" : `${short(at)}: pass by`]);
  if (kind === "hover") return strong([`hover ${duration_s.toFixed(1)} s`], {gap: 12 * view.u, order: ABOVE});
  const whole = `${short(at)}: rest ${duration_s.toFixed(1)} s`;
  return strong([whole], {needed: false}) ?? strong([short(at), `rest ${duration_s.toFixed(0)} s`]);
}

// Names of the other buildings where there is room, on the outer side first.
function nameBuildings(view, map, labels) {
  const used = new Set(map.stops.map(({at}) => at));
  const small = {gap: 7 * view.u, fill: "muted", needed: false, size: view.size - 1};
  for (const {name, at} of map.buildings) {
    if (used.has(name)) continue;
    const aside = view.x(at[0]) - view.width / 2;
    const below = Math.abs(aside) < 0.09 * view.width ? [3] : [];
    const order = [...below, ...(aside < 0 ? [1, 0] : [0, 1]), 3, 2, 4, 5, 6, 7];
    put(view, labels, [short(name)], at, {...small, order});
  }
}

// Words on the lines of the grid, in steps at which they keep apart.
function nameLevels({plot, y, size, scale, step, up}, from, labels) {
  const apart = 2 ** Math.ceil(Math.log2((2.4 * size) / (step * scale)));
  const coarse = step * Math.max(step === 500 ? 2 : 1, apart);
  for (const value of d3.range(Math.ceil(from / coarse) * coarse, up[1], coarse)) {
    const words = coarse % 1000 ? `${grouped(value)} m` : `${grouped(value / 1000)} km`;
    const level = {x: 4, y: y(value) - 3, anchor: "start"};
    const options = {size: size - 1, needed: false};
    const found = y(value) > size * 1.5 && labels.find([words], [level], options);
    if (found) write(plot, {...found, words, size: size - 1, fill: "muted"});
  }
}

function short(name) {
  return name.length > LONGEST_NAME ? `${name.slice(0, LONGEST_NAME - 1)}…` : name;
}

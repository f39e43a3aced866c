// The map: one scale for x and y, terrain to its edges, the places with their names, points over it that
// can be moved, and the drone.
import {GRID, Picture, STRONG, around, colour, dots, grouped, shape} from "./drawing.js";

const MOST_NAMED = 40; // Buildings
const LONGEST_NAME = 24;
const LEAST_S = 0.05; // Of a stay that is named
const ARROW_PX = 30; // Of a leg that has an arrow, at least
const ENDS = ["origin", "destination"]; // Places that no building is named by
const MOST_TIMED = 4; // Devices that have their hovers beside their names
const POINT = {x: ([x]) => x, y: ([, y]) => y};
const ABOVE = [2, 0, 1, 3, 4, 5, 6, 7]; // Spots of `around`, the preferred first
const BELOW = [3, 0, 1, 2, 4, 5, 6, 7];
const MOST_FOCUSED = 60; // Points by the tabulator
const STEP_M = 10;
const LONG_STEP_M = 100;
export const ARROWS = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowDown: [0, -1], ArrowUp: [0, 1]};
const HANDLE_PX = 12;
const ROOF_PX = 8;
// Steps of a fall: below, aside [px], strength, and turn.
const FALL = [
  {down: 30, aside: 0, opacity: 0.3, turn: 10},
  {down: 56, aside: 2, opacity: 0.55, turn: 28},
  {down: 86, aside: 5, opacity: 1, turn: 55},
];
const FALLEN_PX = 118; // Where it says so
const ROTORS = [[-11, -7], [11, -7], [-11, 7], [11, 7]];

export function drawMap(draw, {map, verdict}, {axes, all, ...look}) {
  const {across, up, scale, step} = frameOf(axes, look);
  const named = map.buildings.length <= MOST_NAMED;
  const stops = map.stops.map(({kind, at}) => `${kind} at ${at}`).join(", ");
  const picture = new Picture(look, {
    margins: [0, 0, 0, 0],
    x: {domain: across},
    y: {domain: up},
    symbol: {type: "identity"},
    label: `Map. ${verdict.text}. Route: ${stops || "none"}`,
    marks: [
      terrain(map, step, look.u),
      sights(map, look.u, named),
      links(map, look.u),
      route(map, scale, look.u),
      spots(map, look.u, named),
    ],
  });
  // The points over the map stay where they are, as one may have the focus or be dragged.
  if (draw.firstChild) draw.firstChild.replaceWith(picture.plot);
  else draw.append(picture.plot);
  nameStops(picture, map);
  if (named && all) nameBuildings(picture, map);
  nameLevels(picture, axes[0][1], step, scale, up[1]);
  return picture;
}

// Ends of both axes [m] and pixels per m, so that the window is inside.
function frameOf([[x1, y1], [x2, y2]], {width, height, u}) {
  const side = Math.min(0.2 * width, (u > 1 ? 38 : 42) * u);
  const [top, bottom] = [16 * u, 30 * u];
  const [aside, upward] = [width - 2 * side, height - top - bottom];
  const scale = Math.max(1e-9, Math.min(aside / Math.max(x2 - x1, 1), upward / Math.max(y2 - y1, 1)));
  const left = (x1 + x2 - width / scale) / 2;
  const low = (y1 + y2 - (upward + 2 * bottom) / scale) / 2;
  const step = d3.tickStep(0, Math.max(x2 - x1, y2 - y1), 7);
  return {scale, step, across: [left, left + width / scale], up: [low, low + height / scale]};
}

// Position of a place by its name [m].
function placeOf(map, name) {
  if (ENDS.includes(name)) return map[name];
  return [...map.hovers, ...map.buildings].find((place) => place.name === name)?.at;
}

function restsOf(map) {
  return map.stops.filter(({kind}) => kind === "rest").map(({at}) => placeOf(map, at));
}

function unused({buildings, stops}) {
  return buildings.filter(({name}) => !stops.some(({at}) => at === name));
}

function terrain({devices}, step, u) {
  const reach = {fill: colour("hover"), fillOpacity: 0.13, stroke: colour("hover"), strokeWidth: 1.25 * u};
  const rules = {...GRID, interval: step};
  return [Plot.gridX(rules), Plot.gridY(rules), ...devices.map(({rim}) => rim && Plot.line(rim, reach))];
}

// Lines of sight of the laser, those of the plan stronger; and the walls that cut some of them.
function sights(map, u, named) {
  const rests = restsOf(map);
  const used = ({line: [, to]}) => rests.some(([x, y]) => Math.hypot(x - to[0], y - to[1]) < 1e-6);
  const look = (clear) => ({
    x1: ({line: [[x]]}) => x,
    y1: ({line: [[, y]]}) => y,
    x2: ({line: [, [x]]}) => x,
    y2: ({line: [, [, y]]}) => y,
    filter: (sight) => sight.clear === clear,
    stroke: colour(clear ? "laser" : "muted"),
    strokeWidth: (sight) => (used(sight) ? 2.25 : 0.9) * u,
    strokeOpacity: (sight) => (used(sight) ? 1 : named ? 0.45 : 0.1),
    strokeDasharray: clear ? `${2 * u} ${3 * u}` : `${u} ${6 * u}`,
  });
  const walls = map.buildings.flatMap(({name, ring}) => ring.map(([x, y]) => ({x, y, name})));
  const wall = {fill: colour("muted"), fillOpacity: 0.18, stroke: colour("muted"), strokeWidth: 0.6};
  return [
    Plot.link(map.sight, look(true)),
    Plot.link(map.sight, look(false)),
    Plot.line(walls, {x: "x", y: "y", z: "name", curve: "linear-closed", ...wall}),
  ];
}

// Which hover point serves which of several devices.
function links(map, u) {
  const known = several(map) ? map.devices.filter(({place}) => placeOf(map, place)) : [];
  const look = {stroke: colour("hover"), strokeWidth: 1.25 * u, strokeDasharray: `${5 * u} ${3 * u}`};
  const [x1, y1] = [0, 1].map((axis) => ({at}) => at[axis]);
  const [x2, y2] = [0, 1].map((axis) => ({place}) => placeOf(map, place)[axis]);
  return Plot.link(known, {x1, y1, x2, y2, ...look});
}

function several({devices}) {
  return devices.length > 1;
}

function route({route: way}, scale, u) {
  const legs = d3.pairs(way ?? [], ([a, b], [c, d]) => ({
    x: (a + c) / 2,
    y: (b + d) / 2,
    long: Math.hypot(c - a, d - b) * scale > ARROW_PX * u,
    turn: 90 - (Math.atan2(d - b, c - a) * 180) / Math.PI,
  }));
  const arrow = {symbol: "triangle", r: 5.5 * u, fill: colour("flight"), stroke: colour("casing")};
  return [
    Plot.line(way ?? [], {stroke: colour("casing"), strokeWidth: 4.75 * u, strokeLinejoin: "round"}),
    Plot.line(way ?? [], {stroke: colour("flight"), strokeWidth: 2.75 * u, strokeLinejoin: "round"}),
    Plot.dot(legs, {x: "x", y: "y", rotate: "turn", filter: "long", ...arrow}),
  ];
}

function spots(map, u, named) {
  const {origin, destination, laser, devices, hovers} = map;
  const linked = devices.map(({at}) => at);
  const mark = (places, symbol, r, role, edge = {}) =>
    Plot.dot(places.filter(Boolean), {...POINT, symbol, r: r * u, fill: colour(role), ...edge});
  const edge = {stroke: colour("ink"), strokeWidth: 1.25 * u};
  const ring = {strokeWidth: 1.5 * u, stroke: colour("hover"), strokeDasharray: `${3 * u} ${3 * u}`};
  return [
    Plot.dot(unused(map), {
      x: ({at: [x]}) => x,
      y: ({at: [, y]}) => y,
      symbol: "square",
      r: (named ? 3.9 : 1) * u,
      fill: ({lit}) => colour(lit ? "muted" : "bounds"),
    }),
    mark(restsOf(map), "square", 6.7, "rest", edge),
    mark([origin, destination], "diamond", 6.5, "ink"),
    mark([laser], "triangle", 7, "laser"),
    mark(linked, "circle", 5, "hover"),
    mark(linked, "circle", 10, "hover", {...ring, fill: "none"}),
    mark(hovers.map(({at}) => at), "circle", 6.5, "hover", edge),
  ];
}

// Writes lines of words beside a point [m], or at the edge beyond which it lies.
function nameAt(picture, [x, y], lines, {gap = 10 * picture.u, order, ...look} = {}) {
  const {needed = true, size = picture.size} = look;
  const at = [picture.x(x), picture.y(y)];
  if (!picture.has(at)) return needed ? picture.beyond(at, lines[0], {fill: "ink"}) : null;
  const spots = [0, ...(needed ? [1] : [])].flatMap((far) => // Farther off where words are needed
    around(at, gap * (1 + 0.8 * far), size, {lines: lines.length, order})
      .map((spot) => ({...spot, cost: spot.cost + 9 * far})));
  return picture.put(lines, spots, look);
}

// Names of places, those that the plan uses first.
function nameStops(picture, map) {
  const {u} = picture;
  const px = ([x, y]) => [picture.x(x), picture.y(y)];
  const {devices, hovers, origin, destination, laser, buildings} = map;
  picture.avoid(dots((map.route ?? []).map(px)));
  const small = [...hovers, ...devices, ...buildings].map(({at}) => at);
  for (const at of small) picture.keep(px(at), 5 * u);
  for (const at of [origin, destination, laser]) if (at) picture.keep(px(at), 7 * u, 10 * u);
  const served = several(map) ? devices.map(({place}) => place) : []; // Their stays stand at the devices
  for (const stop of map.stops) {
    if (!served.includes(stop.at)) nameStop(picture, placeOf(map, stop.at), stop);
  }
  for (const end of ["laser", "origin", "destination"]) {
    if (map[end]) nameAt(picture, map[end], [end], {order: BELOW, gap: 13 * u});
  }
  for (const {name, place, at} of devices) {
    const timed = served.length > 0 && served.length <= MOST_TIMED;
    const stays = map.stops.filter((stop) => timed && stop.at === place && stop.duration_s >= LEAST_S);
    const lines = [short(name), ...stays.map(({duration_s}) => `hover ${duration_s.toFixed(1)} s`)];
    nameAt(picture, at, lines, {gap: 15 * u, order: ABOVE});
  }
  for (const {name, at} of served.length ? [] : hovers) {
    if (map.stops.every((stop) => stop.at !== name)) nameAt(picture, at, ["hover point"]);
  }
}

function nameStop(picture, point, {kind, at, duration_s}) {
  const strong = (lines, options) => nameAt(picture, point, lines, {...STRONG, ...options});
  const hovers = kind === "hover";
  if (duration_s < LEAST_S) return strong([hovers ? "hover point" : `${short(at)}: pass by`]);
  if (hovers) return strong([`hover ${duration_s.toFixed(1)} s`], {gap: 12 * picture.u, order: ABOVE});
  const whole = `${short(at)}: rest ${duration_s.toFixed(1)} s`;
  return strong([whole], {needed: false}) ?? strong([short(at), `rest ${duration_s.toFixed(0)} s`]);
}

// Names of the other buildings where there is room, on the outer side first.
function nameBuildings(picture, map) {
  const small = {gap: 7 * picture.u, fill: "muted", needed: false, size: picture.size - 1};
  for (const building of unused(map)) {
    const aside = picture.x(building.at[0]) - picture.width / 2;
    const below = Math.abs(aside) < 0.09 * picture.width ? [3] : [];
    const order = [...below, ...(aside < 0 ? [1, 0] : [0, 1]), 3, 2, 4, 5, 6, 7];
    nameAt(picture, building.at, [short(building.name)], {...small, order});
  }
}

// Words on the lines of the grid, in steps at which they keep apart.
function nameLevels(picture, from, step, scale, most) {
  const {y, size} = picture;
  const apart = 2 ** Math.ceil(Math.log2((2.4 * size) / (step * scale)));
  const coarse = step * Math.max(step === 500 ? 2 : 1, apart);
  for (const value of d3.range(Math.ceil(from / coarse) * coarse, most, coarse)) {
    const words = coarse % 1000 ? `${grouped(value)} m` : `${grouped(value / 1000)} km`;
    const level = {x: 4, y: y(value) - 3, anchor: "start"};
    if (level.y > 1.5 * size) picture.put([words], [level], {...picture.axis, halo: true, needed: false});
  }
}

function short(words) {
  return words.length > LONGEST_NAME ? `${words.slice(0, LONGEST_NAME - 1)}…` : words;
}

// Points that can be moved lie over the map, and stay while it is drawn anew.

export function points({devices, laser, buildings}) {
  const roofs = buildings.map(({name, at}) =>
    ({key: `buildings.${name}.position_m`, name: `roof of ${name}`, at, roof: true}));
  return [
    ...devices,
    {key: "laser.position_m", name: "laser", at: laser},
    ...roofs,
  ].filter(({at}) => at);
}

export function drawHandles(draw, {x, y, width, height}, map, session) {
  const movable = points(map);
  const all = movable.length <= MOST_FOCUSED;
  const layer = d3.select(draw).selectAll(".handles").data([{x, y, width, height}])
    .join((enter) => enter.append("svg").attr("class", "handles").attr("role", "group"))
    .attr("aria-label", "Points that can be moved")
    .attr("width", width)
    .attr("height", height);
  const move = ({key, at}, ...xy) => session.changeKey(key, [...xy.map(Math.round), at[2]]);
  const within = (px, most) => Math.min(Math.max(px, 0), most); // Not beyond the edges of the map
  const drag = d3.drag()
    .container(layer.node())
    .subject((_, {at}) => ({x: layer.datum().x(at[0]), y: layer.datum().y(at[1])}))
    .on("start", ({sourceEvent}) => {
      sourceEvent.target.focus({preventScroll: true});
      session.hold();
    })
    .on("drag", (event, point) => {
      const now = layer.datum();
      move(point, now.x.invert(within(event.x, now.width)), now.y.invert(within(event.y, now.height)));
    })
    .on("end", () => session.release());
  const step = (event, point) => {
    const direction = ARROWS[event.key];
    if (!direction) return;
    event.preventDefault();
    session.holdByKey();
    const at = session.now.state.changes[point.key] ?? point.at;
    move(point, ...direction.map((sign, k) => at[k] + sign * (event.shiftKey ? LONG_STEP_M : STEP_M)));
  };
  layer.selectAll("circle").data(movable, ({key}) => key).join((enter) => enter.append("circle").call(drag))
    .attr("role", "button")
    .attr("data-key", ({key}) => key)
    .attr("r", ({roof}) => (roof ? ROOF_PX : HANDLE_PX))
    .attr("cx", ({at}) => x(at[0]))
    .attr("cy", ({at}) => y(at[1]))
    .attr("tabindex", ({roof}) => (all || !roof ? 0 : -1))
    .attr("aria-label", ({name, at: [px, py]}) =>
      `${name} at x ${Math.round(px)} m, y ${Math.round(py)} m; arrow keys move it, with shift farther`)
    .on("keydown", step);
}

// The drone at a moment: on its way, at a stop, or falling once its available well is empty.
export function drawDrone(picture, {map, wells}, moment) {
  const {plot, height, size, u} = picture;
  d3.select(plot).selectAll(".drone").remove();
  if (moment === null || !wells) return;
  const parent = d3.select(plot).insert("g", ":scope > text").attr("class", "drone").node(); // Behind words
  const falls = wells.dry_s !== null && moment >= wells.dry_s;
  const at = positionAt(map, wells.phases, falls ? wells.dry_s : moment);
  const [x, y] = [picture.x(at[0]), picture.y(at[1])];
  if (!falls) return drawCraft(parent, x, y, {opacity: 1, turn: 0}, "ink", u);
  const room = u * Math.max(0.3, Math.min(1, (height - y - 2 * size) / (FALLEN_PX * u)));
  for (const {down, aside, ...look} of FALL) {
    drawCraft(parent, x + aside * u, y + down * room, look, "dry", u);
  }
  const look = {parent, anchor: "middle", fill: "dry", ...STRONG};
  picture.write({x, y: y + FALLEN_PX * room, words: wells.event, ...look});
}

// Along the way from stop to stop, by its waypoints, slow at both ends.
function positionAt(map, phases, time) {
  const k = d3.bisector(({end_s}) => end_s).left(phases, time, 0, phases.length - 1);
  const {kind, at, by, start_s, end_s} = phases[k];
  const to = placeOf(map, at);
  if (kind !== "flight") return to;
  const points = [placeOf(map, phases[k - 1]?.at ?? "origin"), ...by, to];
  const length = (a, b) => Math.hypot(...a.map((m, axis) => b[axis] - m));
  const flown_m = [0, ...d3.cumsum(d3.pairs(points, length))];
  const share = d3.easeQuadInOut((time - start_s) / Math.max(end_s - start_s, 1e-9));
  return d3.scaleLinear(flown_m, points)(share * flown_m.at(-1));
}

function drawCraft(parent, x, y, {opacity, turn}, role, u) {
  const transform = `translate(${x} ${y}) rotate(${turn}) scale(${u})`;
  const look = {opacity, stroke: colour(role), "stroke-width": 2.5, fill: "none"};
  const craft = shape(parent, "g", {transform, ...look});
  shape(craft, "path", {d: "M-9,-6L9,6M-9,6L9,-6"});
  for (const [cx, cy] of ROTORS) shape(craft, "circle", {cx, cy, r: 4.5});
}

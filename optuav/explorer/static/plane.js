// The plane of both times: limits as lines with their forbidden sides, the optimum and its trail.
import {GRID, NUMBERS, cased, colour, explain, grouped, line, picture} from "./drawing.js";
import {place, shape, steps, wide, write} from "./drawing.js";
import {Labels, around, dots} from "./labels.js";

const FORBIDDEN = 0.09; // Strength of a forbidden side
const FAINTEST = 0.25; // Of the trail
const NARROW_PLANE_PX = 440;
const SHORT_PX = 230;
const MOST_NOWHERE = 3; // Limits that are told to hold nowhere
const OPTIMUM_SPOTS = [ // Of its words, the preferred first
  [16, -34], [16, -52], [-16, -34], [0, 20], [16, 26], [-16, 26],
  [-16, -52], [-30, 26], [16, 46], [-30, 46], [22, -10], [-16, 46],
];

export function drawPlane(draw, {plane, wells}, {axes, trail, size, u, slots}) {
  if (plane.words) return explain(draw, plane.words);
  const [width, height] = [draw.clientWidth, draw.clientHeight];
  const narrow = width < NARROW_PLANE_PX;
  const most = axes ?? [plane.rest_s[1], plane.hover_s[1]];
  const below = -plane.hover_s[0] / plane.hover_s[1]; // Both axes begin as far below 0
  const limits = plane.constraints.filter(({role}) => role !== "bounds");
  const numbers = {
    x: plane.rests ? steps(most[0], 7, narrow || width < 34 * size) : [],
    y: steps(most[1], 7, narrow || height < SHORT_PX),
  };
  // Beside the name of the axis
  const free = numbers.x.filter((value) => value < most[0] * (1 - (10.5 * size) / width));
  const plot = picture({
    width,
    height,
    size,
    marginLeft: (narrow ? 3.1 : 3.5) * size,
    marginRight: 12 * u,
    marginTop: 6 * u,
    marginBottom: 1.9 * size,
    label: planeWords(plane, limits),
    x: {domain: [-below * most[0], most[0]], axis: null},
    y: {domain: [-below * most[1], most[1]], axis: null},
    marks: [
      Plot.gridX(steps(most[0], 7), GRID),
      Plot.gridY(steps(most[1], 7), GRID),
      Plot.axisX(free, NUMBERS),
      Plot.axisY(numbers.y, NUMBERS),
      limitMarks(plane, limits, u, slots ? slotMarks(plane.grid) : []),
    ],
  });
  draw.replaceChildren(plot);
  const told = draw.closest(".symbols");
  const view = viewOf(plot, plane, most, below, {width, height, narrow, size, u, told});
  const lines = limits.map((limit) => ({...limit, ...lineOf(view, plane, limit.excess)}));
  const optimum = optimumOf(view, plane, trail);
  const under = {x: view.right, y: view.bottom + size + 4, anchor: "end", ...view.muted};
  write(plot, {...under, words: plane.rests ? "rest time, s →" : "no rest on this route", symbol: "T′"});
  keepFree(view, lines, optimum);
  nameUpward(view);
  const best = () => optimum.star && drawOptimum(view, plane, optimum, missed(wells), trail[0]?.from);
  if (narrow) best(); // Its words first where there is little room
  nameLimits(view, lines, optimum.star);
  if (!narrow) best();
  nameNowhere(view, limits);
  nameAllowed(view, plane, limits);
}

function planeWords(plane, limits) {
  const words = limits.map((limit) => limit.words).join("; ") || "no limit cuts anything off";
  const [rest, hover] = plane.best ?? [];
  const optimum = plane.best ? `. Optimum: hover ${hover.toFixed(2)} s, rest ${rest.toFixed(1)} s` : "";
  return `Times that the limits allow on the route ${plane.route.join(", ")}: ${words}${optimum}`;
}

// Scales, edges [px] and labels of a plane.
function viewOf(plot, plane, most, below, look) {
  const [x, y] = [place(plot, "x"), place(plot, "y")];
  const [left, right] = [x(-below * most[0]), x(most[0])];
  const [top, bottom] = [y(most[1]), y(-below * most[1])];
  const [across, up] = [plane.rest_s.map(x), plane.hover_s.map(y)]
    .map((ends) => d3.scaleLinear([0, plane.samples - 1], ends)); // Of columns and rows of samples
  const labels = new Labels(look.width, bottom, left);
  const muted = {size: look.size - 1, fill: "muted", halo: false};
  const inside = ([px, py]) => px >= left && px <= right && py >= top && py <= bottom;
  return {plot, x, y, across, up, left, right, top, bottom, labels, muted, inside, ...look};
}

// Forbidden sides below, bounds and slots, and the lines of the limits above.
function limitMarks({samples: n, hover_s: [y1, y2], rest_s: [x1, x2]}, limits, u, between) {
  const dx = (x2 - x1) / (n - 1) / 2;
  const dy = (y2 - y1) / (n - 1) / 2;
  const extent = {width: n, height: n, x1: x1 - dx, x2: x2 + dx, y1: y1 - dy, y2: y2 + dy};
  const field = {...extent, thresholds: [0], interpolate: "none", clip: true};
  const forbidden = (role) => ({...field, fill: colour(role), fillOpacity: FORBIDDEN, stroke: "none"});
  return [
    ...limits.filter(({forbids}) => forbids).map(({excess, role}) =>
      Plot.contour(excess.map((value) => -value), forbidden(role))),
    Plot.ruleX([0], line("bounds", u)),
    Plot.ruleY([0], line("bounds", u)),
    ...between,
    ...limits.flatMap(({excess, role}) =>
      cased(role, u).map((look) => Plot.contour(excess, {...field, fill: "none", ...look}))),
  ];
}

// The times that slots allow: those where all limits hold, and the others.
function slotMarks({hover_s, rest_s, feasible}) {
  const points = hover_s.flatMap((y, i) => rest_s.map((x, j) => ({x, y, holds: feasible[i][j]})));
  const holding = points.filter(({holds}) => holds);
  const others = points.filter(({holds}) => !holds);
  return [
    Plot.dot(others, {x: "x", y: "y", symbol: "times", r: 1.6, stroke: colour("muted")}),
    Plot.dot(holding, {x: "x", y: "y", r: 1.8, fill: colour("ink")}),
  ];
}

// The points of the line of a limit [px], and points along it for words to avoid.
function lineOf({across, up, inside}, {samples: n}, excess) {
  const edge = d3.contours().size([n, n]).contour(excess, 0).coordinates.flat(2); // Around a region
  const crossed = edge.map(([j, i]) => [across(j - 0.5), up(i - 0.5)]).filter(inside);
  const [width, height] = [0, 1].map((axis) => d3.extent(crossed, (point) => point[axis]))
    .map(([low, high]) => high - low);
  const points = d3.sort(crossed, (point) => point[width >= height ? 0 : 1]);
  return {points, along: dots(points)};
}

// The star and the optima before it [px].
function optimumOf({x, y, inside}, {best}, trail) {
  const px = ([rest, hover]) => [x(rest), y(hover)];
  const before = trail.slice(0, -1).map((point) => px(point.best)).filter(inside);
  return {star: best && px(best), before};
}

function nameUpward({plot, x, right, top, labels, size, u, muted}) {
  const words = "↑ hover time, s";
  const spots = [0, 0.15, 0.3, 0.45, 0.6].map((share, k) => ({
    x: x(0) + 8 * u + share * (right - x(0)),
    y: top + size + 4,
    anchor: "start",
    cost: 4 * k,
  }));
  write(plot, {...labels.find([words], spots, {size}), words, symbol: "Δ", ...muted});
}

// Words leave lines and points free.
function keepFree({x, y, left, right, top, bottom, labels, u}, lines, {star, before}) {
  labels.avoid(lines.flatMap(({along}) => along));
  labels.avoid([...dots([[left, y(0)], [right, y(0)]]), ...dots([[x(0), top], [x(0), bottom]])]);
  for (const point of before) labels.keepAround(point, 5 * u);
  if (star) labels.keepAround(star, 17 * u);
}

// A limit is named on its line, once.
function nameLimits(view, lines, star) {
  const {plot, labels, size, narrow, told} = view;
  const said = new Set();
  for (const {role, words, short, symbol, points, along} of lines) {
    const text = narrow ? short : words;
    if (!text || said.has(text) || points.length < 2) continue;
    said.add(text);
    const whole = told ? `${text}  ${symbol}` : text;
    const others = lines.flatMap((other) => (other.along === along ? [] : other.along));
    const spots = beside(view, points, whole).map((spot) => {
      const box = labels.box(spot, [whole], size, 600);
      const met = near(box, others) + (star && onOptimum(box, star, view) ? 3 : 0);
      return {...spot, cost: spot.cost + 4 * met};
    });
    const found = labels.find([whole], spots, {size, weight: 600});
    if (!found) continue;
    const label = write(plot, {...found, words: text, size, weight: 600, fill: role, symbol});
    shape(label, "title", {}, `${words} ${symbol}`);
  }
}

function near([a, b, c, d], points) {
  return points.filter(([x, y]) => x > a - 6 && x < c + 6 && y > b - 8 && y < d + 8).length;
}

// Whether a box lies where the words of the optimum are wished.
function onOptimum([a, b, c, d], [x, y], {size, u}) {
  const [left, level] = [x + 16 * u, y - 34 * u];
  return a < left + 9 * size && c > left && b < level + 1.5 * size && d > level - size;
}

// Candidates for words along a line: over and under it where it is flat, at its sides where it is steep.
function beside({left, right, top, bottom, size, u}, points, words) {
  const across = wide(words, size, 600);
  const gap = 5 * u;
  const found = d3.range(0.05, 1.001, 0.05).flatMap((share) => {
    const [x, y] = points[Math.floor(share * (points.length - 1))];
    const [high, low] = d3.extent(points.filter(([a]) => a >= x - across && a <= x), ([, b]) => b);
    const [first, last] = d3.extent(points.filter(([, b]) => Math.abs(b - y) < size), ([a]) => a);
    const flat = low - high < 2.5 * size && x - across > left;
    const cost = 14 * (1 - share) + (3 * (low - high)) / size;
    const steep = 8 + 10 * Math.abs(share - 0.68);
    const level = y + 0.3 * size;
    return [
      flat && {x: x - 6, y: high - gap, anchor: "end", cost},
      flat && {x: x - 6, y: low + gap + 0.8 * size, anchor: "end", cost: cost + 2},
      last + across + gap < right && {x: last + gap, y: level, anchor: "start", cost: steep},
      first - across > left && {x: first - gap, y: level, anchor: "end", cost: steep + 3},
    ];
  });
  return found.filter((spot) => spot && spot.y - size > top && spot.y < bottom);
}

// What a plan misses that cannot be flown, and the role of that limit.
function missed(wells) {
  if (wells && wells.dry_s !== null) return {words: "✕ falls", role: "dry"};
  if (wells && wells.overfull_s !== null) return {words: "✕ overfills", role: "overfull"};
  return null;
}

// The star, a ring where the plan falls, the optima before it, and their words.
function drawOptimum(view, plane, {star: [cx, cy], before}, mark, from) {
  const {plot, narrow, u} = view;
  const yellow = {fill: colour("optimum"), stroke: colour("edge")};
  const trail = shape(plot, "g", {class: "trail"});
  before.forEach(([x, y], k) => {
    const opacity = FAINTEST + ((1 - FAINTEST) * k) / before.length;
    shape(trail, "circle", {cx: x, cy: y, r: 4.5 * u, "stroke-width": u, opacity, ...yellow});
  });
  const star = d3.symbol(d3.symbolStar, 105 * u * u)();
  const at = `translate(${cx} ${cy})`;
  shape(plot, "path", {d: star, transform: at, class: "optimum", "stroke-width": 1.5 * u, ...yellow});
  if (mark) {
    const ring = {fill: "none", stroke: colour(mark.role), "stroke-width": 2.5 * u};
    shape(plot, "circle", {cx, cy, r: 15 * u, ...ring});
  }
  nameOptimum(view, plane, [cx, cy], narrow ? null : mark);
  if (before.length && from && !narrow) nameTrail(view, before[0], from);
}

function nameOptimum({plot, labels, size, u}, {best: [rest_s, hover_s], rests}, [cx, cy], mark) {
  const spots = OPTIMUM_SPOTS.map(([across, down], k) => ({
    x: cx + across * u,
    y: cy + down * u + (down > 0 ? size / 2 : 0),
    anchor: across >= 0 || across === -30 ? "start" : "end",
    cost: 3 * k,
  }));
  const hover = `hover ${hover_s.toFixed(2)} s`;
  const rest = `rest ${rest_s.toFixed(1)} s`;
  const lines = [mark ? `${hover} ${mark.words}   ` : hover, ...(rests ? [rest] : [])];
  const found = labels.find(lines, spots, {size, weight: 700});
  const first = write(plot, {...found, words: hover, size, weight: 700});
  if (mark) shape(first, "tspan", {dx: 1.2 * size, fill: colour(mark.role)}, mark.words);
  if (rests) write(plot, {...found, y: found.y + 1.25 * size, words: rest, size});
}

// Where the control stood from which the trail comes.
function nameTrail({plot, labels, size, u}, [x, y], [value, unit]) {
  const words = `trail: from ${grouped(unit === "%" ? 100 * value : value)} ${unit}`;
  const found = labels.find([words], around(x, y, 10 * u, size), {size: size - 1, needed: false});
  if (found) write(plot, {...found, words, size: size - 1, fill: "muted"});
}

// Limits that forbid all of the plane.
function nameNowhere({plot, left, right, top, bottom, size}, limits) {
  const nowhere = limits.filter(({forbids, excess}) => forbids && excess.every((value) => value < 0));
  const middle = {x: (left + right) / 2, anchor: "middle", size, weight: 600};
  nowhere.slice(0, MOST_NOWHERE).forEach(({role, words}, k) => {
    const y = (top + bottom) / 2 + 1.5 * k * size;
    write(plot, {...middle, y, words: `${words} – kept nowhere here`, fill: role});
  });
}

// Words where all limits hold.
function nameAllowed(view, plane, limits) {
  const {plot, x, y, right, top, labels, size} = view;
  if (!plane.chosen || !plane.grid.feasible.flat().some(Boolean)) return;
  const words = "every limit is kept here";
  const left = x(0) + 0.05 * (right - x(0));
  const spots = d3.range(1, 12)
    .map((k) => ({x: left, y: y(0) - (k / 12) * (y(0) - top), anchor: "start", cost: Math.abs(k - 2)}))
    .filter((spot) => allowed(view, plane, limits, spot, wide(words, size)));
  const found = labels.find([words], spots, {size: size - 1, needed: false});
  if (found) write(plot, {...found, words, size: size - 1, fill: "muted"});
}

// Whether all limits hold along a stretch to the right of a spot.
function allowed({across, up}, {samples: n}, limits, spot, width) {
  const i = Math.round(up.invert(spot.y));
  return [0, 0.5, 1].every((share) => {
    const j = Math.round(across.invert(spot.x + share * width));
    const within = i >= 0 && j >= 0 && i < n && j < n;
    return within && limits.every(({excess}) => excess[i * n + j] >= 0);
  });
}

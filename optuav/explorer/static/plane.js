// The plane of both times: limits as lines with their forbidden sides, the optimum and its trail.
import {GRID, NUMBERS, Picture, STRONG, around, cased} from "./drawing.js";
import {colour, dots, grouped, line, shape, steps, wide} from "./drawing.js";

const FORBIDDEN = 0.09; // Strength of a forbidden side
const FAINTEST = 0.25; // Of the trail
const NARROW_PLANE_PX = 440;
const SHORT_PX = 230;
const MOST_NOWHERE = 3; // Limits that are told to hold nowhere
const OUTWARD = {start: 1, middle: 0, end: -1}; // By where words begin
const CORNERS = [4, 5, 6, 7, 0, 1, 3, 2]; // Spots of `around` for the words of the optimum

export function drawPlane(draw, {plane, verdict}, {axes, trail, slots, ...look}) {
  const {width, height, size, u} = look;
  const narrow = width < NARROW_PLANE_PX;
  const [most_x, most_y] = axes ?? [plane.rest_s[1], plane.hover_s[1]];
  const below = plane.hover_s[0] / plane.hover_s[1]; // Both axes begin as far below 0
  const {limits} = plane;
  const rests = plane.rests ? steps(most_x, 7, narrow || width < 34 * size) : [];
  const picture = new Picture(look, {
    margins: [14 * u, 14 * u, 1.9 * size, (narrow ? 3.1 : 3.5) * size],
    label: planeWords(plane),
    x: {domain: [below * most_x, most_x]},
    y: {domain: [below * most_y, most_y]},
    marks: [
      Plot.gridX(steps(most_x, 7), GRID),
      Plot.gridY(steps(most_y, 7), GRID),
      // Beside the name of the axis
      Plot.axisX(rests.filter((value) => value < most_x * (1 - (10.5 * size) / width)), NUMBERS),
      Plot.axisY(steps(most_y, 7, narrow || height < SHORT_PX), NUMBERS),
      limitMarks(plane, u, slots ? slotMarks(plane.grid) : []),
    ],
  });
  draw.replaceChildren(picture.plot);
  // Columns and rows of samples [px]
  const [across, up] = [plane.rest_s.map(picture.x), plane.hover_s.map(picture.y)]
    .map((ends) => d3.scaleLinear([0, plane.samples - 1], ends));
  const points = ({excess}) => lineOf(excess, plane.samples, across, up, picture);
  const lines = limits.map((limit) => ({...limit, points: points(limit)}));
  keepFree(picture, plane, lines);
  nameTimes(picture, plane.rests);
  if (plane.best) drawOptimum(picture, plane, trail, missed(verdict), narrow);
  nameLimits(picture, lines, narrow);
  nameNowhere(picture, limits);
  if (plane.chosen) nameAllowed(picture, plane, across, up);
}

function planeWords({best, route, limits}) {
  const words = limits.map((limit) => limit.words).join("; ") || "no limit cuts anything off";
  const optimum = best ? `. Optimum: hover ${best[1].toFixed(2)} s, rest ${best[0].toFixed(1)} s` : "";
  return `Times that the limits allow on the route ${route.join(", ")}: ${words}${optimum}`;
}

// Forbidden sides below, bounds and slots, and the lines of the limits above.
function limitMarks({samples: n, hover_s: [y1, y2], rest_s: [x1, x2], limits}, u, between) {
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
  const [place, crossed] = [{x: "x", y: "y"}, {symbol: "times", r: 1.6, stroke: colour("muted")}];
  return [
    Plot.dot(points, {...place, ...crossed, filter: ({holds}) => !holds}),
    Plot.dot(points, {...place, filter: "holds", r: 1.8, fill: colour("ink")}),
  ];
}

// Points of the line of a limit [px], in order along the longer side that it has.
function lineOf(excess, n, across, up, picture) {
  const edge = d3.contours().size([n, n]).contour(excess, 0).coordinates.flat(2); // Around a region
  const crossed = edge.map(([j, i]) => [across(j - 0.5), up(i - 0.5)]).filter((at) => picture.has(at));
  const [width, height] = [0, 1].map((axis) => d3.extent(crossed, (point) => point[axis]))
    .map(([low, high]) => high - low);
  return d3.sort(crossed, (point) => point[width >= height ? 0 : 1]);
}

// Words leave lines and the optimum free.
function keepFree(picture, {best}, lines) {
  const {x, y, left, right, top, bottom, u} = picture;
  for (const {points} of lines) picture.avoid(dots(points));
  picture.avoid([...dots([[left, y(0)], [right, y(0)]]), ...dots([[x(0), top], [x(0), bottom]])]);
  if (best) picture.keep([x(best[0]), y(best[1])], 17 * u);
}

function nameTimes(picture, rests) {
  const {x, right, top, bottom, size, u, axis} = picture;
  const words = rests ? "rest time, s →" : "no rest on this route";
  picture.write({...axis, x: right, y: bottom + size + 4, anchor: "end", words, symbol: "T′"});
  const upward = {y: top + size + 4, anchor: "start"};
  const spots = d3.range(0, 0.7, 0.15)
    .map((share) => ({...upward, x: x(0) + 8 * u + share * (right - x(0)), cost: 26 * share}));
  picture.put(["↑ hover time, s"], spots, {...axis, symbol: "Δ"});
}

// A limit is named on its line, once, and not beside the line of another one.
function nameLimits(picture, lines, narrow) {
  const {size, u} = picture;
  const said = new Set();
  for (const {role, words, short, symbol, points} of lines) {
    const text = narrow ? short : words;
    if (!text || said.has(text) || points.length < 2) continue;
    said.add(text);
    const look = {...STRONG, fill: role, symbol};
    const others = lines.flatMap((other) => (other.points === points ? [] : dots(other.points)));
    const extent = picture.extent([text], look);
    const spots = d3.range(0.1, 1, 0.08).flatMap((share) => {
      const point = points[Math.floor(share * points.length)];
      return around(point, 6 * u, size).map((spot) => {
        const [a, b, c, d] = picture.box(spot, extent);
        const near = others.filter(([x, y]) => x > a - 6 && x < c + 6 && y > b - 8 && y < d + 8);
        return {...spot, cost: spot.cost + 14 * (1 - share) + 4 * near.length};
      });
    });
    const found = picture.put([text], spots, look);
    if (found) shape(found.text, "title", {}, `${words} ${symbol}`);
  }
}

// What a plan misses that cannot be flown, and the role of that limit.
function missed({event, good}) {
  const words = `✕ ${event.replace(/ at .*/, "")}`;
  return good ? null : {words, role: event.startsWith("overfills") ? "overfull" : "dry"};
}

// The star, a ring where the plan falls, the optima before it, and their words.
function drawOptimum(picture, {best: [rest_s, hover_s], rests}, trail, mark, narrow) {
  const {plot, x, y, size, u} = picture;
  const [cx, cy] = [x(rest_s), y(hover_s)];
  const yellow = {fill: colour("optimum"), stroke: colour("edge")};
  const px = ({best: [rest, hover]}) => [x(rest), y(hover)];
  const before = trail.slice(0, -1).map(px).filter((at) => picture.has(at));
  const group = shape(plot, "g", {class: "trail"});
  before.forEach(([px, py], k) => {
    const opacity = FAINTEST + ((1 - FAINTEST) * k) / before.length;
    shape(group, "circle", {cx: px, cy: py, r: 4.5 * u, "stroke-width": u, opacity, ...yellow});
    picture.keep([px, py], 5 * u);
  });
  const lines = [`hover ${hover_s.toFixed(2)} s`, ...(rests ? [`rest ${rest_s.toFixed(1)} s`] : [])];
  if (!picture.has([cx, cy])) return picture.beyond([cx, cy], lines.join(", "), {fill: "ink", mark});
  const star = d3.symbol(d3.symbolStar, 105 * u * u)();
  const at = {transform: `translate(${cx} ${cy})`, class: "optimum"};
  shape(plot, "path", {d: star, ...at, "stroke-width": 1.5 * u, ...yellow});
  const ring = {fill: "none", stroke: colour(mark?.role), "stroke-width": 2.5 * u};
  if (mark) shape(plot, "circle", {cx, cy, r: 15 * u, ...ring});
  const spots = d3.cross([20, 36], [0, 50, 100]).flatMap(([gap, out]) =>
    around([cx, cy], gap * u, size, {lines: lines.length, order: CORNERS}).map((spot) =>
      ({...spot, x: spot.x + out * u * OUTWARD[spot.anchor], cost: 3 * spot.cost + gap / 6 + out / 8})));
  picture.put(lines, spots, {weight: 700, mark: narrow ? null : mark});
  if (narrow || !before.length || !trail[0].from) return;
  const [value, unit] = trail[0].from; // Of the control that was moved
  const words = `trail: from ${grouped(value)} ${unit}`;
  picture.put([words], around(before[0], 10 * u, size), {fill: "muted", size: size - 1, needed: false});
}

// Limits that forbid all of the plane.
function nameNowhere(picture, limits) {
  const {left, right, top, bottom, size} = picture;
  const nowhere = limits.filter(({forbids, excess}) => forbids && d3.max(excess) < 0);
  if (!nowhere.length) return;
  const lines = [{role: "ink", words: "violated everywhere:"}, ...nowhere.slice(0, MOST_NOWHERE)];
  lines.forEach(({role, words}, k) => {
    const y = (top + bottom) / 2 + 1.5 * (k - 1) * size;
    picture.write({...STRONG, x: (left + right) / 2, y, words, anchor: "middle", fill: role});
  });
}

// Words where all limits hold.
function nameAllowed(picture, {samples: n, grid, limits}, across, up) {
  const {x, y, right, top, size} = picture;
  if (!grid.feasible.flat().some(Boolean)) return;
  const words = "feasible";
  const holds = (px, py) => {
    const [i, j] = [Math.round(up.invert(py)), Math.round(across.invert(px))];
    return i >= 0 && j >= 0 && i < n && j < n && limits.every(({excess}) => excess[i * n + j] >= 0);
  };
  const left = x(0) + 0.05 * (right - x(0));
  const spots = d3.range(1, 12)
    .map((k) => ({x: left, y: y(0) - (k / 12) * (y(0) - top), anchor: "start", cost: Math.abs(k - 2)}))
    .filter((spot) => [0, 0.5, 1].every((share) => holds(spot.x + share * wide(words, size), spot.y)));
  picture.put([words], spots, {fill: "muted", size: size - 1, needed: false});
}

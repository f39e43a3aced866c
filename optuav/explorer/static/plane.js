// The plane of both times: limits as lines with their forbidden sides, the optimum and its trail.
import {Labels, casing, colour, dots, grouped, line, picture, place, steps, wide, write} from "./drawing.js";

const FORBIDDEN = 0.09; // Strength of a forbidden side
const FAINTEST = 0.25;
const NARROW_PX = 440, SHORT_PX = 230;

export function drawPlane(draw, {plane, wells}, {axes, trail, size, u, slots}) {
  const width = draw.clientWidth, height = draw.clientHeight;
  if (plane.words) return draw.replaceChildren(Object.assign(document.createElement("p"), {textContent: plane.words}));
  const narrow = width < NARROW_PX, {samples: n, hover_s: [y1, y2], rest_s: [x1, x2], grid} = plane;
  const [most_x, most_y] = axes ?? [x2, y2], below = -y1 / y2;
  const dx = (x2 - x1) / (n - 1) / 2, dy = (y2 - y1) / (n - 1) / 2;
  const over = {width: n, height: n, x1: x1 - dx, x2: x2 + dx, y1: y1 - dy, y2: y2 + dy, thresholds: [0], interpolate: "none", clip: true};
  const limits = plane.constraints.filter(({role}) => role !== "bounds");
  const points = slots ? grid.hover_s.flatMap((y, i) => grid.rest_s.map((x, j) => ({x, y, holds: grid.feasible[i][j]}))) : [];
  const margins = {marginLeft: (narrow ? 3.1 : 3.5) * size, marginRight: 12 * u, marginTop: 6 * u, marginBottom: 1.9 * size};
  const [across, up] = [plane.rests ? steps(most_x, 7, narrow || width < 34 * size) : [0], steps(most_y, 7, narrow || height < SHORT_PX)];
  const plot = picture({
    width, height, size, ...margins,
    label: `Times that the limits allow on the route ${plane.route.join(", ")}: ` +
      (limits.map(({words}) => words).join("; ") || "no limit cuts anything off") +
      (plane.best ? `. Optimum: hover ${plane.best[1].toFixed(2)} s, rest ${plane.best[0].toFixed(1)} s` : ""),
    x: {domain: [-below * most_x, most_x], axis: null},
    y: {domain: [-below * most_y, most_y], axis: null},
    marks: [
      Plot.gridX(steps(most_x, 7), {stroke: colour("faint"), strokeOpacity: 1}),
      Plot.gridY(steps(most_y, 7), {stroke: colour("faint"), strokeOpacity: 1}),
      limits.filter(({forbids}) => forbids).map(({excess, role}) =>
        Plot.contour(excess.map((value) => -value), {...over, fill: colour(role), fillOpacity: FORBIDDEN, stroke: "none"})),
      Plot.ruleX([0], line("bounds", u)),
      Plot.ruleY([0], line("bounds", u)),
      Plot.dot(points.filter(({holds}) => !holds), {x: "x", y: "y", symbol: "times", r: 1.6, stroke: colour("muted")}),
      Plot.dot(points.filter(({holds}) => holds), {x: "x", y: "y", r: 1.8, fill: colour("ink")}),
      limits.flatMap(({excess, role}) => [casing(role, u), line(role, u)].map((look) => Plot.contour(excess, {...over, fill: "none", ...look}))),
    ],
  });
  draw.replaceChildren(plot);
  const x = place(plot, "x"), y = place(plot, "y"), [left, right, top, bottom] = [x(-below * most_x), x(most_x), y(most_y), y(-below * most_y)];
  const muted = {size: size - 1, fill: "muted", halo: false};
  const end = "rest time, s →", labels = new Labels(width, bottom, left);
  for (const value of up) {
    write(plot, {x: left - 5, y: Math.max(y(value) + size / 3, top + size * 0.75), words: grouped(value), anchor: "end", ...muted});
  }
  for (const value of across) {
    if (plane.rests && x(value) < right - size * 9.5) write(plot, {x: x(value), y: bottom + size + 4, words: grouped(value), anchor: "middle", ...muted});
  }
  write(plot, {x: right, y: bottom + size + 4, words: plane.rests ? end : "no rest on this route", anchor: "end", symbol: "T′", ...muted});
  const lines = limits.map((limit) => ({...limit, ways: crossings(limit.excess, n, (k) => x(x1 + (k / (n - 1)) * (x2 - x1)), (k) => y(y1 + (k / (n - 1)) * (y2 - y1)))
    .map((way) => way.filter(([a, b]) => a >= left && a <= right && b >= top && b <= bottom))}));
  for (const limit of lines) limit.dots = limit.ways.flatMap((way) => dots(way));
  labels.avoid([...lines.flatMap((limit) => limit.dots), ...dots([[left, y(0)], [right, y(0)]]), ...dots([[x(0), top], [x(0), bottom]])]);
  const star = plane.best && [x(plane.best[0]), y(plane.best[1])];
  const before = trail.slice(0, -1).map((each) => [x(each.best[0]), y(each.best[1])]).filter(([a, b]) => a >= left && a <= right && b >= top && b <= bottom);
  for (const [[a, b], reach] of [...before.map((each) => [each, 5 * u]), ...(star ? [[star, 17 * u]] : [])]) labels.keep([a - reach, b - reach, a + reach, b + reach]);
  const upward = [0, 0.15, 0.3, 0.45, 0.6].map((share, k) => ({x: x(0) + 8 * u + share * (right - x(0)), y: top + size + 4, anchor: "start", cost: 4 * k}));
  write(plot, {...labels.find(["↑ hover time, s"], upward, {size}), words: "↑ hover time, s", symbol: "Δ", ...muted});
  const best = () => drawOptimum(plot, {plane, star, before, from: trail[0]?.from, mark: missed(wells), u, size, labels, narrow}); // First where there is little room
  const said = new Set(), told = draw.closest(".symbols");
  if (narrow) best();
  for (const {role, words, short, symbol, ways, dots: own} of lines) {
    const text = narrow ? short : words, whole = told ? `${text}  ${symbol}` : text, points = ways.flat();
    if (!text || said.has(text) || points.length < 2) continue;
    said.add(text);
    const others = lines.flatMap((each) => (each.dots === own ? [] : each.dots));
    const near = (spot) => {
      const [a, b, c, d] = labels.box(spot, [whole], size, 600);
      const wished = star && a < star[0] + 16 * u + 9 * size && c > star[0] + 16 * u && b < star[1] - 34 * u + 1.5 * size && d > star[1] - 34 * u - size;
      return others.filter(([x, y]) => x > a - 6 && x < c + 6 && y > b - 8 && y < d + 8).length + (wished ? 3 : 0); // Words of the optimum
    };
    const spots = beside(points, whole, size, u, [left, right, top, bottom]).map((spot) => ({...spot, cost: spot.cost + 4 * near(spot)}));
    const found = labels.find([whole], spots, {size, weight: 600});
    if (found) write(plot, {...found, words: text, size, weight: 600, fill: role, symbol}).append("title").text(`${words} ${symbol}`);
  }
  if (!narrow) best();
  limits.filter(({forbids, excess}) => forbids && excess.every((value) => value < 0)).slice(0, 3).forEach(({role, words}, k) =>
    write(plot, {x: (left + right) / 2, y: (top + bottom) / 2 + 1.5 * k * size, words: `${words} – kept nowhere here`, anchor: "middle", size, weight: 600, fill: role}));
  if (plane.chosen && grid.feasible.flat().some(Boolean)) {
    const room = {x: x(0) + 0.05 * (right - x(0)), anchor: "start"};
    const spots = d3.range(1, 12).map((k) => ({...room, y: y(0) - (k / 12) * (y(0) - top), cost: Math.abs(k - 2)}));
    const words = "every limit is kept here", found = labels.find([words], spots.filter((spot) => allowed(limits, n, spot, words, size, {x, y, x1, x2, y1, y2})), {size: size - 1, needed: false});
    if (found) write(plot, {...found, words, size: size - 1, fill: "muted"});
  }
}

// What a plan misses that cannot be flown, and the role of that limit.
function missed(wells) {
  if (wells && wells.dry_s !== null) return ["✕ falls", "dry"];
  return wells && wells.overfull_s !== null ? ["✕ overfills", "overfull"] : null;
}

// The star, a ring where the plan falls, the optima before it, and their words.
function drawOptimum(plot, {plane, star, before, from, mark, u, size, labels, narrow}) {
  if (!star) return;
  const svg = d3.select(plot), [sx, sy] = star;
  svg.append("g").attr("class", "trail").selectAll("circle").data(before).join("circle").attr("cx", ([a]) => a).attr("cy", ([, b]) => b)
    .attr("r", 4.5 * u).attr("fill", colour("optimum")).attr("stroke", colour("edge")).attr("stroke-width", u)
    .attr("opacity", (_, k) => FAINTEST + ((1 - FAINTEST) * k) / before.length);
  svg.append("path").attr("d", d3.symbol(d3.symbolStar, 105 * u * u)()).attr("transform", `translate(${sx} ${sy})`).attr("class", "optimum")
    .attr("fill", colour("optimum")).attr("stroke", colour("edge")).attr("stroke-width", 1.5 * u);
  if (mark) {
    svg.append("circle").attr("cx", sx).attr("cy", sy).attr("r", 15 * u).attr("fill", "none").attr("stroke", colour(mark[1])).attr("stroke-width", 2.5 * u);
  }
  const [hover, rest] = [`hover ${plane.best[1].toFixed(2)} s`, `rest ${plane.best[0].toFixed(1)} s`], also = mark && !narrow ? mark[0] : "";
  const spots = [[16, -34], [16, -52], [-16, -34], [0, 20], [16, 26], [-16, 26], [-16, -52], [-30, 26], [16, 46], [-30, 46], [22, -10], [-16, 46]]
    .map(([a, b], k) => ({x: sx + a * u, y: sy + b * u + (b > 0 ? size / 2 : 0), anchor: a >= 0 || a === -30 ? "start" : "end", cost: 3 * k}));
  const found = labels.find([also ? `${hover} ${also}   ` : hover, ...(plane.rests ? [rest] : [])], spots, {size, weight: 700});
  const first = write(plot, {...found, words: hover, size, weight: 700});
  if (also) first.append("tspan").attr("dx", 1.2 * size).attr("fill", colour(mark[1])).text(also);
  if (plane.rests) write(plot, {...found, y: found.y + 1.25 * size, words: rest, size});
  if (before.length && from && !narrow) {
    const words = `trail: from ${grouped(from[1] === "%" ? 100 * from[0] : from[0])} ${from[1]}`, [a, b] = before[0];
    const spot = labels.find([words], [[-10, 14], [10, 14], [-10, -8], [10, -8]].map(([dx, dy]) => ({x: a + dx * u, y: b + dy * u + (dy > 0 ? size / 2 : 0), anchor: dx > 0 ? "start" : "end"})), {size: size - 1, needed: false});
    if (spot) write(plot, {...spot, words, size: size - 1, fill: "muted"});
  }
}

// Where a field of samples changes its sign: points along the line, by column and by row.
function crossings(excess, n, x, y) {
  const at = (i, j) => excess[i * n + j];
  const along = (get, point) => d3.range(n).flatMap((j) => d3.range(n - 1).filter((i) => get(i, j) >= 0 !== get(i + 1, j) >= 0)
    .map((i) => point(i + get(i, j) / (get(i, j) - get(i + 1, j)), j)));
  const columns = along((i, j) => at(i, j), (i, j) => [x(j), y(i)]), rows = along((j, i) => at(i, j), (j, i) => [x(j), y(i)]);
  return [columns.length >= rows.length ? columns : d3.sort(rows, ([, b]) => b)];
}

// Candidates for words along a line: over and under it where it is flat, at its sides where it is steep.
function beside(points, words, size, u, [left, right, top, bottom]) {
  const across = wide(words, size, 600), gap = 5 * u, found = [];
  for (const share of d3.range(0.05, 1.001, 0.05)) {
    const [x, y] = points[Math.floor(share * (points.length - 1))];
    const over = points.filter(([a]) => a >= x - across && a <= x), behind = points.filter(([, b]) => Math.abs(b - y) < size);
    const ends = d3.extent(over, ([, b]) => b), sides = d3.extent(behind, ([a]) => a);
    if (ends[1] - ends[0] < 2.5 * size && x - across > left) {
      const cost = 14 * (1 - share) + (3 * (ends[1] - ends[0])) / size;
      found.push({x: x - 6, y: ends[0] - gap, anchor: "end", cost}, {x: x - 6, y: ends[1] + gap + 0.8 * size, anchor: "end", cost: cost + 2});
    }
    const cost = 8 + 10 * Math.abs(share - 0.68);
    if (sides[1] + across + gap < right) found.push({x: sides[1] + gap, y: y + 0.3 * size, anchor: "start", cost});
    if (sides[0] - across > left) found.push({x: sides[0] - gap, y: y + 0.3 * size, anchor: "end", cost: cost + 3});
  }
  return found.filter(({y}) => y - size > top && y < bottom);
}

// Whether all limits hold below words.
function allowed(limits, n, spot, words, size, {x, y, x1, x2, y1, y2}) {
  const column = (px) => Math.round(((px - x(x1)) / (x(x2) - x(x1))) * (n - 1)), row = (py) => Math.round(((py - y(y1)) / (y(y2) - y(y1))) * (n - 1));
  return [0, 0.5, 1].every((share) => {
    const j = column(spot.x + share * wide(words, size)), i = row(spot.y);
    return i >= 0 && j >= 0 && i < n && j < n && limits.every(({excess}) => excess[i * n + j] >= 0);
  });
}

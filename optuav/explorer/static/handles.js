// Points of the map that can be moved lie over it, and stay while it is drawn anew.
const MOST_FOCUSED = 60; // Points by the tabulator
const STEP_M = 10;
const LONG_STEP_M = 100;
export const ARROWS = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowDown: [0, -1], ArrowUp: [0, 1]};
const HANDLE_PX = 12;
const ROOF_PX = 8;

export function points(map) {
  return [
    {key: "link.device_m", name: "device", at: map.device},
    ...(map.laser ? [{key: "laser.position_m", name: "laser", at: map.laser}] : []),
    ...map.buildings.map(({name, at}) => ({
      key: `buildings.${name}.position_m`,
      name: `roof of ${name}`,
      at,
      roof: true,
    })),
  ];
}

export class Handles {
  #layer = null;
  #scales = null;
  #session;

  constructor(session) {
    this.#session = session;
  }

  draw(stage, {plot, x, y}, map) {
    const movable = points(map);
    const all = movable.length <= MOST_FOCUSED;
    const spoken = ({name, at: [px, py]}) =>
      `${name} at x ${Math.round(px)} m, y ${Math.round(py)} m; arrow keys move it, with shift farther`;
    this.#scales = [x, y];
    this.#layer ??= d3.select(stage).append("svg")
      .attr("class", "handles")
      .attr("role", "group")
      .attr("aria-label", "Points that can be moved");
    for (const name of ["width", "height"]) this.#layer.attr(name, plot.getAttribute(name));
    this.#layer.selectAll("circle").data(movable, ({key}) => key)
      .join((enter) => this.#enter(enter))
      .attr("r", ({roof}) => (roof ? ROOF_PX : HANDLE_PX))
      .attr("cx", ({at}) => x(at[0]))
      .attr("cy", ({at}) => y(at[1]))
      .attr("tabindex", ({roof}) => (all || !roof ? 0 : -1))
      .attr("aria-label", spoken);
  }

  #enter(enter) {
    const session = this.#session;
    return enter.append("circle")
      .attr("role", "button")
      .attr("data-key", ({key}) => key)
      .on("pointerdown", (event) => {
        event.preventDefault();
        event.target.focus({preventScroll: true});
        event.target.setPointerCapture(event.pointerId);
        session.hold();
      })
      .on("pointermove", (event, point) => this.#drag(event, point))
      .on("pointerup pointercancel lostpointercapture", () => session.release())
      .on("keydown", (event, point) => this.#step(event, point));
  }

  // Not beyond the edges of the map.
  #drag(event, point) {
    if (!event.target.hasPointerCapture(event.pointerId)) return;
    const at = d3.pointer(event, this.#layer.node());
    const ends = ["width", "height"].map((name) => Number(this.#layer.attr(name)));
    const inside = at.map((px, axis) => Math.min(Math.max(px, 0), ends[axis]));
    this.#move(point, ...inside.map((px, axis) => this.#scales[axis].invert(px)));
  }

  #step(event, point) {
    const direction = ARROWS[event.key];
    if (!direction) return;
    event.preventDefault();
    this.#session.holdByKey();
    const far = event.shiftKey ? LONG_STEP_M : STEP_M;
    const [px, py] = this.#session.state.changes[point.key] ?? point.at;
    this.#move(point, px + far * direction[0], py + far * direction[1]);
  }

  #move({key, at}, px, py) {
    this.#session.changeKey(key, [Math.round(px), Math.round(py), at[2]]);
  }
}

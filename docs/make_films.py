"""Make the moving pictures of the home page; ``python docs/make_films.py`` writes the README's.

Two plans of the mission ``paper`` are simulated and drawn side by side as SVGs that CSS moves: the
paper's optimum, which falls, and the plan that flies. Both play at one pace to their end. Readers
who ask for less motion see the fall and the rest.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
import signs

import optuav
from optuav.judge import Replay
from optuav.looks import variables

PACE = 100.0
"""Seconds of the mission in a second of the film."""
FALL_S = 90.0
"""How long the fall takes in the film [s of the mission]."""
STEPS = 4
"""Parts of a phase and of the fall, within which everything moves evenly."""
LEFT, RIGHT, GROUND, PX_PER_M = 20.0, 335.0, 214.0, 1.5
"""Frame of the scene [px], and its scale upwards."""
LASER = 110.0
"""Where the laser stands across the scene, which has one direction less than the world [px]."""
STANDS = 5.0
"""Height of a drone's middle above a roof that it rests on, and of a wreck on the ground [px]."""
ASIDE, TURN_DEG = 46.0, 24.0
"""How far a falling drone drifts [px], and how it lies."""
WELLS_LEFT, WELLS_TOP, WELLS_WIDTH, WELLS_HEIGHT, APART = 298.0, 18.0, 40.0, 66.0, 5.0
"""Place of the battery, common width of its wells, their height and the gap [px]."""
REASON_TOP, REASON_STEP = 22.0, 16.0
"""Place of the lines that say why a drone falls, above its way [px]."""
BAR_TOP, BAR_HEIGHT = 252.0, 16.0
"""Place of the bar of time [px]."""
FIGURE = """\
<figure class="films{more}">
<style>{style}</style>
{films}
<button type="button">Play</button>
<script>
{{
  const figure = document.currentScript.parentNode, button = figure.querySelector("button");
  const films = () => figure.getAnimations({{subtree: true}});
  const running = () => films().some(film => film.playState === "running");
  const say = () => {{ button.textContent = running() ? "Pause" : "Play again"; }};
  button.onclick = () => {{
    const pause = running();
    for (const film of films()) pause ? film.pause() : film.play();
    say();
  }};
  figure.addEventListener("animationend", say);
  say();
}}
</script>
</figure>
"""
FILM = """\
<div class="film {name}">
<h2>{heading} <span>{verdict}</span></h2>
<p>{words}</p>
<svg viewBox="0 0 360 296" role="img" aria-label="{told}">
{picture}
</svg>
</div>
"""
PICTURE = """\
<path class="ground" d="M{left} {ground}H{right}"/>
{scene}
<text x="{wells_left}" y="{wells_words}">battery</text>
{wells}
{bars}
<path class="now" d="M-5 {now_top}h10l-5 7z"/>
<text x="{left}" y="{bar_words}">0 s</text>
<text x="{end_x:.1f}" y="{bar_words}" class="end verdict">{end_s:.0f} s</text>"""
FILE = Path(__file__).parent / "_static" / "films.svg"
STANDALONE = """\
<svg xmlns="http://www.w3.org/2000/svg" class="films" viewBox="0 0 738 374" role="img">
<title>{title}</title>
<style>
.films {{color-scheme: light dark; font-family: system-ui, "DejaVu Sans", sans-serif}}
.frame {{fill: var(--panel); stroke: var(--line)}}
.film .heading {{fill: var(--ink); font-size: 15px; font-weight: 600}}
.film .big {{font-size: 17px; font-weight: 600}}
.film .words {{font-size: 14px}}
{style}
</style>
{films}</svg>
"""
FRAME = """\
<g class="film {name}" transform="translate({x} 1)">
<rect class="frame" width="360" height="372" rx="12"/>
<text x="16" y="28" class="heading">{heading}</text>
<text x="16" y="51" class="verdict big">{verdict}</text>
<text x="16" y="72" class="words">{words}</text>
<g transform="translate(0 76)">
{picture}
</g>
</g>
"""
STYLE = """
.films {{margin: 0; padding: 0}}
.film {{
  background: var(--panel); border: 1px solid var(--line); border-radius: 12px; color: var(--ink);
  overflow: hidden;
}}
.film h2 {{font-size: 15px; font-weight: 600; line-height: 1.4; margin: 0; padding: 10px 14px 0}}
.film h2 span {{display: block; font-size: 17px}}
.film p {{color: var(--muted); font-size: 14px; margin: 0; padding: 0 14px 6px}}
.film svg {{display: block; height: auto; overflow: hidden; width: 100%}}
.film text {{fill: var(--muted); font-size: 12px}}
.film .middle {{text-anchor: middle}}
.film .end {{text-anchor: end}}
.film text.word {{fill: var(--ink); font-size: 13px; font-weight: 600}}
.falls h2 span {{color: var(--dry)}}
.falls :is(.verdict, .word.late) {{fill: var(--dry)}}
.lands h2 span {{color: var(--flies)}}
.lands .verdict {{fill: var(--flies)}}
.film .ground {{stroke: var(--muted)}}
.film .building {{fill: var(--line)}}
.film .destination {{fill: var(--ink)}}
.film .fall {{fill: none; stroke: var(--dry); stroke-dasharray: 5 4; stroke-width: 2.5}}
.film .vessel {{fill: none; stroke: var(--muted)}}
.film .available {{fill: var(--available)}}
.film .bound {{fill: var(--bound)}}
.film :is(.available, .bound) {{transform-box: fill-box; transform-origin: 50% 100%}}
.film .empty {{stroke: var(--dry); stroke-width: 2.5}}
.film .on-bar {{font-weight: 600; text-anchor: middle}}
.film .on-hover {{fill: var(--on-dark)}}
.film .on-rest {{fill: var(--edge)}}
.film .now {{fill: var(--ink)}}
.film .drone {{color: var(--ink)}}
.films button {{
  background: none; border: 1px solid var(--line); border-radius: 6px; color: var(--muted);
  font-size: 13px; padding: 0 10px;
}}
@media (prefers-reduced-motion: reduce) {{.films button {{display: none}}}}
@media print {{.films button {{display: none}}}}
{signs}
"""


class Film(NamedTuple):
    """A plan in motion, its name in the page, and the words above it."""

    replayed: Replay
    name: str
    heading: str
    verdict: str
    words: str
    told: str


def films() -> tuple[Film, Film]:
    """The published optimum, and the best plan of optuav."""
    published, best = (optuav.solve("paper", perspective=each) for each in ("battery", "available"))
    falls, flies = optuav.replay(published), optuav.replay(best)
    dry_s, lands_s = falls.first_s("empty"), float(flies.trace.time_s[-1])
    assert dry_s is not None
    assert flies.flyable
    left = f"{published.mission.limits.min_soc:.0%}".replace("%", " %")
    return (
        Film(
            falls,
            "falls",
            "A published optimum",
            f"✕ falls at {dry_s:.0f} s",
            f"promised: {published.hover_time_s:.0f} s of hover, {left} charge left",
            "The drone rests on a roof, where a laser charges it, and flies on to hover near a "
            f"device. After {dry_s:.0f} s it falls. {' '.join(_reason(falls, dry_s))}",
        ),
        Film(
            flies,
            "lands",
            "optuav's plan",
            f"✓ lands at {lands_s:.0f} s",
            f"{best.hover_time_s:.0f} s: longest with one hover, one rest",
            f"The drone hovers near a device for {best.hover_time_s:.0f} s, rests on a roof, where "
            f"a laser charges it, and lands after {lands_s:.0f} s.",
        ),
    )


def page(*names: str) -> str:
    """The films of these names as a figure of HTML, all of them by default."""
    shown = [film for film in films() if film.name in names or not names]
    drawn, style = _together(shown)
    more = " one" if len(shown) == 1 else ""
    parts = [
        FILM.format(**film._asdict(), picture=picture)
        for film, picture in zip(shown, drawn, strict=True)
    ]
    return FIGURE.format(more=more, style=style, films="".join(parts))


def standalone() -> str:
    """Both films as one SVG, which is a file of its own."""
    shown = films()
    drawn, style = _together(shown)
    parts = [
        FRAME.format(**film._asdict(), picture=picture, x=1 + 376 * number)
        for number, (film, picture) in enumerate(zip(shown, drawn, strict=True))
    ]
    title = " ".join(f"{film.heading}: {film.told}" for film in shown)
    return STANDALONE.format(title=title, style=style, films="".join(parts))


def _together(shown: Sequence[Film]) -> tuple[list[str], str]:
    """Pictures of films that end together, and their style."""
    whole_s = max(_end_s(film) for film in shown)
    drawn, styles = zip(*(_drawn(film, whole_s) for film in shown), strict=True)
    looks = "".join(f".film {rule}\n" for rule in signs.STYLE.strip().splitlines())
    return [*drawn], variables(".films") + STYLE.format(signs=looks) + "".join(styles)


def _end_s(film: Film) -> float:
    """Moment at which nothing moves any more [s]."""
    dry_s = film.replayed.first_s("empty")
    return float(film.replayed.trace.time_s[-1]) if dry_s is None else dry_s + FALL_S


def _drawn(film: Film, whole_s: float) -> tuple[str, str]:
    """The picture of a film that plays for so long [s of the mission], and its style."""
    replayed, mission = film.replayed, film.replayed.mission
    dry_s, end_s = replayed.first_s("empty"), float(replayed.trace.time_s[-1])
    flown_s = end_s if dry_s is None else dry_s
    at, share = _place(replayed), mission.battery.available_fraction

    def along(moment_s: float) -> float:
        return LEFT + (RIGHT - LEFT) * moment_s / mission.limits.deadline_s

    moments_s = [*_moments_s(replayed, flown_s)]
    courses = {
        "drone": [(s, _moved(*at(s))) for s in moments_s],
        **_levels(replayed, moments_s),
        "now": [(s, _moved(along(s))) for s in moments_s],
    }
    stays = {phase.kind: phase for phase in replayed.phases if phase.kind != "flight"}
    lit_s = {kind: (stay.start_s, min(stay.end_s, flown_s)) for kind, stay in stays.items()}
    resting_s = [s for s in moments_s if lit_s["rest"][0] < s < lit_s["rest"][1]]
    still_s = resting_s[len(resting_s) // 2] if dry_s is None else flown_s
    still = {name: dict(moves)[still_s] for name, moves in courses.items()}
    way = dict.fromkeys(at(s) for s in _corners_s(replayed, flown_s))
    scene = _scene(at(lit_s["rest"][0]), at(lit_s["hover"][0]), way)
    bars = [
        _bar(phase.kind, along(phase.start_s), along(min(phase.end_s, flown_s)))
        for phase in replayed.phases
        if phase.start_s < flown_s
    ]
    if dry_s is None:
        scene += _destination(*at(end_s))
    else:
        steps, marks = _fall(*at(dry_s))
        marks += [
            signs.text(LEFT, REASON_TOP + REASON_STEP * number, words, "late")
            for number, words in enumerate(_reason(replayed, dry_s))
        ]
        flown = courses["drone"]
        for end in (0, -1):  # Until it falls, it has the colour of a drone that flies
            moment_s, where = flown[end]
            flown[end] = moment_s, f"{where}; color: var(--ink)"
        courses["drone"] = [*flown, *((dry_s + FALL_S * part, where) for part, where in steps)]
        still["drone"] = courses["drone"][-1][1]
        scene += marks
        bars.append(
            f'<rect x="{along(dry_s):.1f}" y="{BAR_TOP}" width="4" height="{BAR_HEIGHT}" '
            'style="fill: var(--dry)"/>'
        )
    drawn = PICTURE.format(
        left=LEFT,
        right=RIGHT,
        ground=GROUND,
        scene="\n".join([*scene, f'<g class="drone">{signs.DRONE}</g>']),
        wells_left=WELLS_LEFT,
        wells_words=WELLS_TOP - 6,
        wells=_wells(share, dry_s is not None),
        bars="\n".join(bars),
        now_top=BAR_TOP - 8,
        bar_words=BAR_TOP + BAR_HEIGHT + 18,
        end_x=along(flown_s),
        end_s=flown_s,
    )
    return drawn, _style(film.name, courses, still, lit_s, dry_s, whole_s)


def _place(replayed: Replay) -> Callable[[float], tuple[float, float]]:
    """Where the drone is in the picture [px], by the moment [s]: along its way, and up."""
    trace = replayed.trace
    passed_m = np.append(0.0, np.hypot(*np.diff(trace.position_m.T[:2])).cumsum())

    def at(moment_s: float) -> tuple[float, float]:
        share = float(np.interp(moment_s, trace.time_s, passed_m)) / float(passed_m[-1])
        up_m = float(np.interp(moment_s, trace.time_s, trace.position_m[:, 2]))
        return LEFT + (RIGHT - LEFT) * share, GROUND - PX_PER_M * up_m

    return at


def _levels(replayed: Replay, moments_s: Sequence[float]) -> dict[str, list[tuple[float, str]]]:
    """How far each well is filled at moments [s]; past full, it stands out of its vessel."""
    trace, battery = replayed.trace, replayed.mission.battery
    share, whole_As = battery.available_fraction, battery.packs * battery.capacity_As
    full_As = {"available": share * whole_As, "bound": (1.0 - share) * whole_As}
    held_As = {"available": trace.available_As[:, 0], "bound": trace.bound_As[:, 0]}
    levels = {
        name: np.interp(moments_s, trace.time_s, held_As[name]) / size_As
        for name, size_As in full_As.items()
    }
    return {
        name: [
            (s, f"scaleY({abs(round(level, 3)):.3f})")  # A zero has no sign
            for s, level in zip(moments_s, values.tolist(), strict=True)
        ]
        for name, values in levels.items()
    }


def _scene(
    roof: tuple[float, float], hover: tuple[float, float], way: Iterable[tuple[float, float]]
) -> list[str]:
    """The roof, the laser with its beams, the device and the way, by their places [px]."""
    top, below = roof[1] + STANDS, GROUND + 16
    return [
        f'<rect class="building" x="{roof[0] - 13:.1f}" y="{top:.1f}" width="26" '
        f'height="{GROUND - top:.1f}"/>',
        signs.text(roof[0], below, "roof", "middle"),
        signs.line("beam rest", (LASER, GROUND - 19), roof),
        signs.line("beam hover", (LASER, GROUND - 19), hover),
        signs.laser(LASER, GROUND - 10),
        signs.text(LASER, below, "laser", "middle"),
        signs.device(hover[0], GROUND - 9),
        signs.text(hover[0], below, "device", "middle"),
        signs.line("way", *way),
        signs.text(max(roof[0], 46.0), roof[1] - 20, "charging", "middle word rest"),
    ]


def _destination(x: float, y: float) -> list[str]:
    """The end of the way, a point in the air [px] below the drone, and its name."""
    sign = f'<path class="destination" d="M{x:.1f} {y + 4:.1f}l6 9 -6 9 -6 -9z"/>'
    return [sign, signs.text(x + 8, y + 37, "destination", "end")]


def _fall(x: float, y: float) -> tuple[list[tuple[float, str]], list[str]]:
    """A parabola from a place [px] to the ground: the drone on it by its share, and its marks."""
    down = GROUND - STANDS - y
    steps = [
        (
            part,
            f"{_moved(x + ASIDE * part, y + down * part**2)} rotate({TURN_DEG * part:.0f}deg); "
            "color: var(--dry)",
        )
        for part in np.linspace(0.0, 1.0, STEPS + 1)[1:].tolist()
    ]
    bend = f"M{x:.1f} {y:.1f}Q{x + ASIDE / 2:.1f} {y:.1f} {x + ASIDE:.1f} {GROUND - STANDS}"
    words = signs.text(x + ASIDE + 26, GROUND - 24, "falls", "word late")
    return steps, [f'<path class="fall late" d="{bend}"/>', words]


def _reason(replayed: Replay, dry_s: float) -> tuple[str, ...]:
    """Why a drone falls at a moment [s], in short lines."""
    trace, battery = replayed.trace, replayed.mission.battery
    bound_As = float(np.interp(dry_s, trace.time_s, trace.bound_As[:, 0]))
    share = bound_As / (battery.packs * battery.capacity_As)
    return (
        "The well that feeds the rotors",
        f"is empty; {share:.0%}".replace("%", " %") + " of the charge",
        "is left in the other.",
    )


def _moments_s(replayed: Replay, flown_s: float) -> Iterator[float]:
    """Moments [s] between which everything moves nearly evenly, until the plan ends or falls."""
    ends = [0.0, *(phase.end_s for phase in replayed.phases if phase.end_s < flown_s), flown_s]
    parts = (np.linspace(a, b, STEPS + 1).tolist() for a, b in pairwise(ends))
    yield from dict.fromkeys(moment_s for part in parts for moment_s in part)


def _corners_s(replayed: Replay, flown_s: float) -> Iterator[float]:
    """Moments at the ends of the flights [s]."""
    for phase in replayed.phases:
        if phase.kind == "flight" and phase.end_s <= flown_s:
            yield from (phase.start_s, phase.end_s)


def _moved(x: float, y: float = 0.0) -> str:
    return f"translate({x:.1f}px, {y:.1f}px)"


def _wells(share: float, dry: bool) -> str:
    """Both wells as vessels, wide as their shares of the capacity."""
    wide = share * WELLS_WIDTH
    bottom = WELLS_TOP + WELLS_HEIGHT
    drawn = "".join(
        f'<rect class="{name}" x="{x}" y="{WELLS_TOP}" width="{width:.1f}" '
        f'height="{WELLS_HEIGHT}"/><rect class="vessel" x="{x}" y="{WELLS_TOP}" '
        f'width="{width:.1f}" height="{WELLS_HEIGHT}"/>\n'
        for name, x, width in (
            ("available", WELLS_LEFT, wide),
            ("bound", WELLS_LEFT + wide + APART, WELLS_WIDTH - wide),
        )
    )
    return drawn + f'<path class="empty late" d="M{WELLS_LEFT} {bottom}h{wide}"/>' * dry


def _bar(kind: str, first: float, last: float) -> str:
    bar = (
        f'<rect x="{first:.1f}" y="{BAR_TOP}" width="{last - first:.1f}" height="{BAR_HEIGHT}" '
        f'style="fill: var(--{kind})"/>'
    )
    middle = (first + last) / 2.0
    words = signs.text(middle, BAR_TOP + 12.5, kind, f"on-bar on-{kind}")
    return bar + words * (kind != "flight")


def _style(
    name: str,
    courses: dict[str, list[tuple[float, str]]],
    still: dict[str, str],
    lit: dict[str, tuple[float, float]],
    dry_s: float | None,
    whole_s: float,
) -> str:
    """What a film shows if it stands still, and how it moves for readers who do not mind motion."""

    def at(moment_s: float) -> str:
        return f"{100.0 * moment_s / whole_s:.2f}%"

    frames = {
        part: "".join(f"{at(s)} {{transform: {where}}} " for s, where in moves)
        + f"100% {{transform: {moves[-1][1]}}}"
        for part, moves in courses.items()
    }
    for kind, (first_s, last_s) in lit.items():
        frames[kind] = (
            f"0%, {at(first_s)}, {at(last_s)}, 100% {{visibility: hidden}} "
            f"{at(first_s + 1.0)}, {at(last_s - 1.0)} {{visibility: visible}}"
        )
    if dry_s is not None:
        begins, seen = at(dry_s), at(dry_s + 5.0)
        hidden = f"0%, {begins} {{visibility: hidden}}"
        frames["late"] = f"{hidden} {seen}, 100% {{visibility: visible}}"
    shown = "rest" if dry_s is None else ""
    rules = [
        *(f".{part} {{transform: {where}}}" for part, where in still.items()),
        *(f".{kind} {{visibility: {'visible' if kind == shown else 'hidden'}}}" for kind in lit),
    ]
    moved = [f".{part} {{animation: {name}-{part} {whole_s / PACE:g}s linear both}}"
             for part in frames]  # fmt: skip
    keys = "\n".join(f"@keyframes {name}-{part} {{{steps}}}" for part, steps in frames.items())
    still_css = "\n".join(f".{name} {rule}" for rule in rules)
    moving = "\n".join(f".{name} {rule}" for rule in moved)
    return f"{still_css}\n@media (prefers-reduced-motion: no-preference) {{\n{moving}\n}}\n{keys}\n"


if __name__ == "__main__":
    FILE.write_text(standalone(), "utf-8")

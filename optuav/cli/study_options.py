"""Options that every study shares: changes of the mission, and where its results go."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path
from typing import TYPE_CHECKING

from optuav.cli.options import mission_of
from optuav.cli.output import check_places, deliver
from optuav.errors import Fault, collected, refuse
from optuav.presentation.blocks import Note

if TYPE_CHECKING:
    from optuav.mission import Mission
    from optuav.studies.results import Result

WORKERS = min(os.cpu_count() or 1, 4)  # Processes that share work: each takes a second to start


@dataclass(frozen=True)
class StudyOptions:
    """Options of every study: changes of the mission, and where the results go."""

    settings: list[str] | None = None
    as_json: bool = False
    save: Path | None = None
    plot: Path | None = None

    def mission(self, source: str) -> Mission | str:
        """The mission that is studied; refused with it are places that cannot be written to.

        A mission without changes is left for the study to load, which refuses it with its options.
        """
        faults = list[Fault]()
        mission: Mission | str = source
        with collected(faults):
            check_places(self.save, self.plot, ".csv", ".json")
        with collected(faults):
            if self.settings or faults:
                mission = mission_of(source, self.settings)
        refuse(faults)
        return mission

    def deliver(
        self,
        found: Result,
        more: Mapping[str, object] | None = None,
        below: Sequence[str] = (),
        already: Sequence[Path] = (),
    ) -> None:
        """Write the files asked for of a result, with more figures; print it, more lines below.

        It also names files that were written already.
        """

        def data() -> dict[str, object]:
            whole = found.to_dict()
            figures = takewhile(lambda item: item[0] != "units", whole.items())
            return {**dict(figures), **(more or {}), **whole}

        written = [*already]
        if self.save is not None:
            from optuav.mission.files import write_text

            text = f"{json.dumps(data(), indent=2, ensure_ascii=False)}\n"
            is_csv = self.save.suffix.lower() == ".csv"
            write_text(self.save, found.to_csv() if is_csv else text)
            written.append(self.save)
        if self.plot is not None:
            written += found.save_pictures(self.plot)
        blocks = [*found.blocks(), Note(below)]
        deliver(data, blocks, as_json=self.as_json, written=written)

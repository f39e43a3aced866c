"""Parts of a sweep as Parquet files: one row for each scenario and perspective."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from optuav.mission.files import refusal
from optuav.studies.batch import CHARGES, CODED, TIMES, batch_arrays, units
from optuav.studies.study import Study

VARIABLES = (*TIMES, *CHARGES, *CODED, "proved")
STAMP = b"optuav"
"""Where the metadata of a file say which part of which sweep it is."""


def part_of(study: Study, stamp: str, number: int) -> bytes:
    """A part of a study as a file, the same bytes wherever it is made.

    Perspectives vary faster than scenarios. Numbers of words are stored as these words.
    """
    import pyarrow as pa
    from pyarrow import parquet

    scenarios, asked = study.part(number), study.perspectives
    keys = study.values(scenarios)
    found = batch_arrays(study.mission, keys, study.problem, perspective=asked, paired=True)
    words: dict[str, list[str]] = {"perspective": [*asked]}
    columns: dict[str, Any] = {key: np.repeat(each, len(asked)) for key, each in keys.items()}
    columns["perspective"] = np.tile(np.arange(len(asked), dtype=np.int8), len(scenarios))
    for name in VARIABLES:
        columns[name] = found[name].T.ravel()
        if name in CODED:
            words[name] = found[f"{name}_words"].tolist()
    words["building"].pop()  # None is null
    for name, each in words.items():
        numbers = pa.array(columns[name], mask=columns[name] < 0)
        columns[name] = pa.DictionaryArray.from_arrays(numbers, pa.array(each, pa.string()))
    table, unit_of = pa.table(columns), {**units(), **dict.fromkeys(TIMES, "s")}
    fields = [
        field.with_metadata({"units": unit_of[field.name]}) if field.name in unit_of else field
        for field in table.schema
    ]
    metadata, content = {STAMP: f"{stamp} {number}"}, io.BytesIO()
    # What the library might choose otherwise in time is stated.
    parquet.write_table(
        table.cast(pa.schema(fields, metadata)),
        content,
        version="2.6",
        compression="zstd",
        compression_level=1,
        use_dictionary=[*study.grid, *words],
        use_byte_stream_split=[
            name for name in (*keys, *TIMES, *CHARGES) if name not in study.grid
        ],
        row_group_size=table.num_rows,
        data_page_size=1 << 20,
        write_page_checksum=True,
    )
    return content.getvalue()


def is_whole(path: Path, stamp: str, number: int) -> bool:
    """Whether a file is this part of this study, and has its end."""
    import pyarrow as pa
    from pyarrow import parquet

    try:
        metadata = parquet.read_metadata(path).metadata or {}
    except (OSError, pa.ArrowException):
        return False
    return metadata.get(STAMP) == f"{stamp} {number}".encode()


def read_part(
    path: Path, words: Mapping[str, Sequence[str]], columns: list[str] | None = None
) -> dict[str, npt.NDArray[Any]]:
    """The numbers of a part by column, all or some; of words their places among all words."""
    import pyarrow as pa
    from pyarrow import parquet

    found = dict[str, npt.NDArray[Any]]()
    try:
        table = parquet.read_table(path, columns=columns, page_checksum_verification=True)
        for name, column in zip(table.column_names, table.itercolumns(), strict=True):
            values = column.combine_chunks()
            if name == "perspective":
                continue
            if name in words:
                place = {word: number for number, word in enumerate(words[name])}
                places = [*(place[word] for word in values.dictionary.to_pylist()), -1]
                found[name] = np.take(places, values.indices.fill_null(-1))
            else:
                found[name] = values.to_numpy(zero_copy_only=False)
    except (OSError, KeyError, pa.ArrowException):
        raise refusal(path, "is damaged, or from another version of optuav") from None
    return found

"""Tables as CSV: the first line names the columns with their units; numbers have enough digits to read back the
same double."""

import csv
import io
import math

from milltools.base.extras import needs
from milltools.base.text import cell

needs("export", "pyarrow")
import pyarrow as pa
from pyarrow.csv import CSVWriter, WriteOptions

ROWS = math.inf  # as many as there are


def write(path, tables):
    """Writes one table {name: tables.Table} into a file."""
    (table,) = tables.values()
    with open(path, "wb") as file:
        fill(file, table.blocks)


def fill(file, blocks) -> int:
    """Writes blocks, {head: (rows,) numbers or texts}, as one table and returns the number of rows."""
    writer, rows = None, 0
    for block in blocks:
        columns = [pa.array(values, from_pandas=True) for values in block.values()]  # NaN: empty
        batch = pa.record_batch(columns, names=list(block))
        if writer is None:
            csv.writer(head := io.StringIO(), lineterminator="\n").writerow(map(cell, block))
            file.write(head.getvalue().encode(errors="replace"))
            writer = CSVWriter(file, batch.schema, write_options=WriteOptions(include_header=False))
        writer.write_batch(batch)
        rows += len(batch)
    return rows

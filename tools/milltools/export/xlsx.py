"""Tables as a workbook of Excel, a sheet for each table. It needs no decision about commas and decimal points."""

import datetime
import math
import tempfile

import numpy as np

from milltools.base.extras import needs

needs("export", "xlsxwriter")
import xlsxwriter
from xlsxwriter.exceptions import FileCreateError

ROWS = 1_048_575  # of a sheet of Excel, below its head


def write(path, tables):
    """Writes {name of a sheet: tables.Table}; numbers that are not finite are empty cells."""
    with tempfile.TemporaryDirectory(prefix="mill-") as folder:  # a library's drafts, also after Ctrl-C
        options = {"constant_memory": True, "tmpdir": folder, "strings_to_formulas": False, "strings_to_urls": False}
        book = xlsxwriter.Workbook(str(path), options)
        book.set_properties({"created": datetime.datetime(1980, 1, 1)})  # the same run gives the same file
        bold = book.add_format({"bold": True, "text_wrap": True, "valign": "top"})
        for name, table in tables.items():
            _sheet(book.add_worksheet(name), table.blocks, bold)
        try:
            book.close()
        except FileCreateError as fault:
            raise fault.args[0] from None


def _sheet(sheet, blocks, bold):
    row = 0
    sheet.freeze_panes(1, 0)
    for block in blocks:
        if row == 0:
            sheet.set_column(0, len(block) - 1, 14)
            sheet.write_row(0, 0, block, bold)
        columns = [_column(np.asarray(values)) for values in block.values()]
        for values in zip(*columns):
            row += 1
            for place, value in enumerate(values):
                if isinstance(value, str):
                    sheet.write_string(row, place, value)
                elif value is not None and math.isfinite(value):
                    sheet.write_number(row, place, value)


def _column(values) -> list:
    """Single precision as the shortest decimal that gives it, not with the digits that a double adds."""
    return values.astype(str).astype(float).tolist() if values.dtype == np.float32 else values.tolist()

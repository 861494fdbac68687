"""The power that the field's formulas give to a tumbling mill, beside the power of a run."""

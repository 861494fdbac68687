"""Studies: many runs in one table (docs/studies.md)."""

from milltools.base.extras import needs

needs("study")

"""Packages that only some commands need: what is missing is one line that says how to install it."""

import importlib.util

from milltools.base.engine import ROOT
from milltools.base.errors import UserError

# what is imported of an extra of pyproject.toml, with the package that brings it where that has another name
EXTRAS = {
    "render": {"psutil": "psutil", "vtkmodules": "vtk"},
    "study": {
        "optuna": "optuna",
        "pyarrow": "pyarrow",
        "SALib": "SALib",
        "scipy": "scipy",
        "sklearn": "scikit-learn",
        "sqlalchemy": "sqlalchemy",
        "threadpoolctl": "threadpoolctl",
    },
    "cluster": {"dask": "dask", "distributed": "distributed", "psycopg": "psycopg"},
    "export": {"gsd": "gsd", "pyarrow": "pyarrow"},
    "dem": {"scipy": "scipy"},
}


def needs(extra: str, *modules: str):
    """A UserError if one of the modules of an extra, all by default, is not installed."""
    brings = EXTRAS[extra]
    missing = [brings[module] for module in modules or brings if not _found(module)]
    if missing:
        checkout = (ROOT / "tools/setup").exists()
        mend = f"run 'make mill EXTRAS={extra}' in {ROOT}" if checkout else f"pip install 'milltools[{extra}]'"
        raise UserError(f"this needs the Python package {', '.join(missing)}: {mend}", status=1)


def _found(module) -> bool:
    try:
        return importlib.util.find_spec(module) is not None
    except ImportError:
        return False

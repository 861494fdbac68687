"""Packages and programs that only some commands need: a missing one is an error that says how to install it."""

import importlib.util
import shutil

from milltools.base import engine
from milltools.base.errors import UserError

# extra of pyproject.toml -> {module to import: package that contains it}
EXTRAS = {
    "render": {"psutil": "psutil", "vtkmodules": "vtk"},
    "study": {
        name: {"sklearn": "scikit-learn"}.get(name, name)
        for name in ("optuna", "pyarrow", "SALib", "scipy", "sklearn", "sqlalchemy", "threadpoolctl")
    },
    "cluster": {"dask": "dask", "distributed": "distributed", "psycopg": "psycopg"},
    "export": {"gsd": "gsd", "pyarrow": "pyarrow", "xlsxwriter": "xlsxwriter"},
    "dem": {"scipy": "scipy"},
    "mesh": {"manifold3d": "manifold3d", "scipy": "scipy"},
    "contour": {"ezdxf": "ezdxf"},
}


def needs(extra: str, *modules: str):
    """A UserError if one of the given modules of an extra (default: of all of them) is not installed."""
    brings = EXTRAS[extra]
    missing = [brings[module] for module in modules or brings if not _found(module)]
    if missing:
        make, pip = f"run 'make mill EXTRAS={extra}' in {engine.ROOT}", f"pip install {' '.join(missing)}"
        mend = make if engine.IN_CHECKOUT else pip
        raise UserError(f"this needs the Python package {', '.join(missing)}: {mend}", status=1)


def program(name: str, package: str, title: str = "") -> str:
    """The path of a program from a Debian package; a UserError if it is not installed."""
    found = shutil.which(name)
    if not found:
        raise UserError(f"{title or name} is not installed; {on_debian(package)}", status=1)
    return found


def on_debian(package: str) -> str:
    """How a package of the system is installed."""
    return f"on Debian: sudo apt-get install {package}"


def _found(module) -> bool:
    try:
        return importlib.util.find_spec(module) is not None
    except ImportError:
        return False

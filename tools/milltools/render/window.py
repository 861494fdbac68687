"""A window without a screen: VTK draws into memory with Mesa's OSMesa, or with EGL if there is no OSMesa.

If VTK finds neither of them, it only warns and draws nothing; here that is an error.
"""

import contextlib
import ctypes
import os

from milltools.base.errors import UserError
from milltools.base.extras import needs, on_debian

# VTK's name of a kind of window, and the library it loads for it
WINDOWS = (
    ("vtkOSOpenGLRenderWindow", "libOSMesa.so.8"),
    ("vtkOSOpenGLRenderWindow", "libOSMesa.so"),
    ("vtkEGLRenderWindow", "libEGL.so.1"),
)
CHOICE = "VTK_DEFAULT_OPENGL_WINDOW"
MEND = f"libosmesa6 is not installed; {on_debian('libosmesa6')}"


def choose() -> str:
    """Chooses a kind of window that works here, and sets it for VTK. Call it before vtk is imported. UserError if there
    is none."""
    for kind, library in WINDOWS:
        with contextlib.suppress(OSError):
            ctypes.CDLL(library)
            os.environ[CHOICE] = kind
            os.environ.setdefault("EGL_PLATFORM", "surfaceless")  # never asks for a display
            return kind
    raise UserError(f"no library to draw with: {MEND}", status=1)


def open_window(size):
    """A vtkRenderWindow of `size` (width, height) pixels that has been tested. UserError if it draws nothing."""
    kind = choose()
    try:
        import vtkmodules.vtkRenderingOpenGL2  # noqa: F401 (registers the windows)
        from vtkmodules.vtkCommonCore import vtkObject, vtkVersion
        from vtkmodules.vtkRenderingCore import vtkRenderWindow
    except ImportError as fault:
        needs("render", "vtkmodules")
        raise UserError(f"pictures need VTK: {fault}", 1) from None
    if (vtkVersion.GetVTKMajorVersion(), vtkVersion.GetVTKMinorVersion()) < (9, 4):
        raise UserError(f"pictures need VTK 9.4 or later, this is {vtkVersion.GetVTKVersion()}", 1)
    vtkObject.GlobalWarningDisplayOff()  # VTK would print its own warnings; the errors below replace them
    window = vtkRenderWindow(off_screen_rendering=True, multi_samples=0, size=size)
    if window.GetClassName() != kind or not _draws(window):
        raise UserError(f"VTK draws nothing with {kind}: {MEND}", status=1)
    return window


def _draws(window) -> bool:
    """Whether the window draws a coloured background correctly."""
    from vtkmodules.vtkCommonCore import vtkUnsignedCharArray
    from vtkmodules.vtkRenderingCore import vtkRenderer

    probe, pixel = vtkRenderer(background=(1.0, 0.2, 0.6)), vtkUnsignedCharArray()
    window.AddRenderer(probe)
    window.Render()
    window.GetPixelData(0, 0, 0, 0, True, pixel, 0)
    window.RemoveRenderer(probe)
    return [pixel.GetValue(k) for k in range(pixel.GetNumberOfValues())] == [255, 51, 153]

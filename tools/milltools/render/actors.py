"""The objects that VTK draws: balls, rotor, rims, glass, lights; and how to read their pictures. Import it after
window.choose()."""

import math

import numpy as np
import vtkmodules.vtkRenderingOpenGL2  # noqa: F401 (registers what draws)
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkFloatArray, vtkPoints, vtkUnsignedCharArray
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
from vtkmodules.vtkCommonMath import vtkMatrix4x4
from vtkmodules.vtkFiltersCore import vtkCellDataToPointData, vtkCleanPolyData, vtkPolyDataNormals
from vtkmodules.vtkRenderingCore import vtkActor, vtkLight, vtkPolyDataMapper, vtkProperty, vtkRenderer
from vtkmodules.vtkRenderingOpenGL2 import vtkOpenGLSphereMapper

from milltools.geometry.bodies import inverse, moved
from milltools.render.camera import FILL, MAIN, Camera
from milltools.render.shade import View

SHARP = 35.0  # degrees between two faces, above which their edge is sharp
BALL = {"ambient": 0.26, "diffuse": 0.86, "specular": 0.24, "specular_power": 45}
METAL = {"color": (0.74, 0.76, 0.79), "ambient": 0.12, "diffuse": 0.72, "specular": 0.45, "specular_power": 18}
RIM = {"color": (0.20, 0.25, 0.33), "ambient": 0.2, "diffuse": 0.7, "specular": 0.4, "specular_power": 25}
LINE = {"color": (0.04, 0.05, 0.07), "ambient": 1.0, "diffuse": 0.0}
COAT = {"ambient": 0.5, "diffuse": 0.55, "specular": 0.1, "specular_power": 20}
GLASS = {"ambient": 0.55, "diffuse": 0.45, "specular_power": 30}
# of glass: colour, opacity seen face on, and opacity seen edge on
TINT, CLEAR, EDGE = (0.80, 0.87, 0.94), 0.08, 0.75


def _renderer(window, **settings):
    made = vtkRenderer(automatic_light_creation=False, **settings)
    made.cullers.RemoveAllItems()  # they test the centres of balls, so balls at the edge of a tile would be missing
    window.AddRenderer(made)
    return made


class Eye:
    """The view of the camera, in `count` x `count` tiles of the window's size, because VTK needs much more memory per
    pixel than the finished picture. `background`: colours below and above."""

    def __init__(self, window, tile, count, background):
        self._window, self._tile, self._count, self._background = window, tile, count, np.array(background)
        self.renderer = _renderer(window, gradient_background=True)
        for place, strength in (((0, 0, 1), MAIN), *FILL):
            lamp = vtkLight(position=place, intensity=strength)
            lamp.SetLightTypeToCameraLight()
            self.renderer.AddLight(lamp)

    def look(self, camera, mill):
        """Sets the view for a camera.Camera; returns its shade.View."""
        self._camera = camera
        clipping = aim(self.renderer, camera, mill)
        self.renderer.lights.GetItemAsObject(0).position = camera.lamp
        return View(camera, tuple(self._count * side for side in self._tile), clipping)

    def tiles(self):
        """Draws tile by tile: (rows, columns) as slices, colours (h, w, 3) uint8 and depth buffer (h, w) of each, top
        row first; views of VTK's arrays."""
        width, height = self._tile
        for row in range(self._count):
            for column in range(self._count):
                self._turn_to(row, column)
                self._window.Render()
                place = (slice(row * height, (row + 1) * height), slice(column * width, (column + 1) * width))
                found = vtkUnsignedCharArray()
                self._window.GetPixelData(0, 0, width - 1, height - 1, True, found, 0)
                colours = vtk_to_numpy(found).reshape(height, width, 3)[::-1]
                yield place, colours, depths(self._window, width, height)

    def _turn_to(self, row, column):
        view, count, camera = self.renderer.active_camera, self._count, self._camera
        view.window_center = 2 * column + 1 - count, count - 1 - 2 * row  # in half tiles
        if camera.angle == 0:
            view.parallel_scale = camera.height / 2 / count
        else:
            view.view_angle = 2 * math.degrees(math.atan(math.tan(math.radians(camera.angle) / 2) / count))
        below, above = self._background
        self.renderer.background = below + (count - row - 1) / count * (above - below)
        self.renderer.background2 = below + (count - row) / count * (above - below)


def aim(renderer, camera, mill):
    """Sets the renderer's camera to a camera.Camera; returns its clipping range [m]."""
    view = renderer.active_camera
    view.position, view.focal_point, view.view_up = camera.eye, camera.target, camera.axes[1]
    view.parallel_projection = camera.angle == 0
    reach = mill.reach * 1.05
    middle = -camera.eye @ camera.axes[2]
    view.clipping_range = max(middle - reach, reach / 500), middle + reach
    return view.clipping_range


def depths(window, width, height):
    """The depth buffer of what has been drawn, 0..1 float32 (h, w), top row first; a view of VTK's array."""
    found = vtkFloatArray()
    window.GetZbufferData(0, 0, width - 1, height - 1, found)
    return vtk_to_numpy(found).reshape(height, width)[::-1]


class Shadow:
    """The view of the strongest lamp: a square picture of depths in a corner of the window."""

    def __init__(self, window, size):
        self._window, self._side = window, min(size)
        self.renderer = _renderer(window, viewport=(0, 0, self._side / size[0], self._side / size[1]), draw=False)

    def look(self, camera, mill):
        """Sets the lamp for a camera.Camera; returns its shade.View."""
        right, up, forward = camera.axes
        towards = camera.lamp @ np.array([right, up, -forward])
        reach = mill.reach * 1.05
        lamp = Camera(2 * reach * towards, np.zeros(3), up, 0.0, 2 * reach)
        self.renderer.active_camera.parallel_scale = reach
        return View(lamp, (self._side, self._side), aim(self.renderer, lamp, mill))

    def render(self):
        """The depth buffer (side, side) for the present places of the balls and the rotor."""
        renderers = list(self._window.renderers)
        for one in renderers:
            one.draw = one is self.renderer
        self._window.Render()
        found = depths(self._window, self._side, self._side)
        for one in renderers:
            one.draw = one is not self.renderer
        return found


class Balls:
    """One actor for all balls of `radius` (N,) [m]; move() sets their places and colours, and which are not seen."""

    def __init__(self, radius):
        count = len(radius)
        # in single precision: the mapper crashes with doubles
        self._place = np.zeros((count, 3), np.float32)
        self._colour = np.zeros((count, 3), np.uint8)
        self._radius = np.ascontiguousarray(radius, np.float32)
        self._size = self._radius.copy()
        self._points, self._scalars = vtkPoints(data=numpy_to_vtk(self._place)), numpy_to_vtk(self._colour)
        self._sizes = numpy_to_vtk(self._size)
        self._sizes.SetName("radius")
        self._data = vtkPolyData(points=self._points, verts=_cells(count, 1))  # without cells it has no bounds
        self._data.point_data.AddArray(self._sizes)
        self._data.point_data.SetScalars(self._scalars)
        self.actor = _actor(vtkOpenGLSphereMapper(input_data=self._data, scale_array="radius"), BALL)

    def move(self, place, colour, hidden=None):
        self._place[:], self._colour[:] = place, colour
        self._size[:] = self._radius if hidden is None else np.where(hidden, 0, self._radius)
        for changed in (self._points.data, self._points, self._scalars, self._sizes, self._data):
            changed.Modified()


def solid(triangles, look):
    """The actor of triangles (T, 3, 3) that looks like METAL, RIM or LINE."""
    return _actor(vtkPolyDataMapper(input_data=_smooth(triangles)), look)


def coat(triangles, value, rgb, hollow):
    """The actor of triangles (T, 3, 3) in colours rgb(values) of a value for each, smooth except at SHARP edges;
    `hollow`: they are seen from the side of the balls only."""
    values = numpy_to_vtk(np.nan_to_num(value), deep=True)
    values.SetName("value")
    data = vtkCellDataToPointData()(_smooth(triangles, values))
    data.point_data.SetScalars(numpy_to_vtk(rgb(vtk_to_numpy(data.point_data.GetArray("value"))), deep=True))
    mapper = vtkPolyDataMapper(input_data=data, scalar_mode=1)  # colours of points
    return _actor(mapper, COAT | {"backface_culling": hollow})


def place(actor, pose):
    """Moves an actor to a pose (3, 4)."""
    matrix = vtkMatrix4x4()
    matrix.DeepCopy([*pose.ravel(), 0, 0, 0, 1])
    actor.user_matrix = matrix


class Glass:
    """The container's walls, like glass: transparent seen face on, more opaque seen edge on. `actors`: their far side,
    then their near side."""

    def __init__(self, triangles):
        self.actors = []
        if not len(triangles):
            return
        self._data = _smooth(triangles)
        self._points = vtk_to_numpy(self._data.points.data).astype(float)
        self._normal = vtk_to_numpy(self._data.point_data.GetNormals())
        self._rgba = np.empty((len(self._points), 4), np.uint8)
        self._rgba[:, :3] = np.round(255 * np.array(TINT))
        self._scalars = numpy_to_vtk(self._rgba)
        self._data.point_data.SetScalars(self._scalars)
        self.actors = [self._side(front) for front in (False, True)]

    def _side(self, front):
        mapper = vtkPolyDataMapper(input_data=self._data)
        # where a body ends at a wall, the wall is drawn behind the end of the body
        mapper.SetResolveCoincidentTopologyToPolygonOffset()
        mapper.SetRelativeCoincidentTopologyPolygonOffsetParameters(0, 4)
        look = {"specular": 0.9 if front else 0.0, "frontface_culling": not front, "backface_culling": front}
        actor = _actor(mapper, GLASS | look)
        actor.ForceTranslucentOn()
        return actor

    def look(self, camera, pose):
        """Sets the opacity of all points, seen from a camera.Camera, for the container at a pose (3, 4)."""
        if not self.actors:
            return
        sight = self._points - moved(inverse(pose), camera.eye)
        if camera.angle == 0:
            sight = np.broadcast_to(camera.axes[2] @ pose[:, :3], self._points.shape)
        across = np.abs(np.einsum("ij,ij->i", sight, self._normal)) / np.linalg.norm(sight, axis=1)
        self._rgba[:, 3] = np.round(255 * (CLEAR + (EDGE - CLEAR) * (1 - across) ** 4))
        self._scalars.Modified()
        self._data.Modified()


# ---- triangles


def _cells(count, size):
    """A vtkCellArray of `count` cells of `size` points each, one after the other."""
    cells = vtkCellArray()
    cells.SetData(size, numpy_to_vtk(np.arange(count * size), deep=True))
    return cells


def _smooth(triangles, values=None):
    """Triangles (T, 3, 3) as vtkPolyData with normals, smooth except at SHARP edges; `values`: an array of VTK."""
    corners = numpy_to_vtk(triangles.reshape(-1, 3).astype(np.float32), deep=True)
    data = vtkPolyData(points=vtkPoints(data=corners), polys=_cells(len(triangles), 3))
    if values:
        data.cell_data.AddArray(values)
    joined = vtkCleanPolyData(tolerance=1e-7)(data)  # corners that meet become one point
    return vtkPolyDataNormals(feature_angle=SHARP, consistency=False)(joined)


def _actor(mapper, look):
    return vtkActor(mapper=mapper, property=vtkProperty(**look))

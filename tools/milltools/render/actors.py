"""What VTK draws: balls, rotor, rims, glass; light, shade, and the way to the pixels. Imported after window.choose()."""

import math

import numpy as np
import vtkmodules.vtkRenderingOpenGL2  # noqa: F401 (registers what draws)
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkFloatArray, vtkPoints, vtkUnsignedCharArray
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
from vtkmodules.vtkCommonMath import vtkMatrix4x4
from vtkmodules.vtkFiltersCore import vtkCleanPolyData, vtkPolyDataNormals
from vtkmodules.vtkRenderingCore import vtkActor, vtkLight, vtkPolyDataMapper, vtkRenderer
from vtkmodules.vtkRenderingOpenGL2 import vtkOpenGLSphereMapper

from milltools.geometry.bodies import inverse, moved
from milltools.render.camera import FILL, MAIN, Camera
from milltools.render.shade import View

SHARP = 35.0  # degrees between faces, from which on their edge is one


def _lamps(renderer):
    renderer.AutomaticLightCreationOff()
    renderer.GetCullers().RemoveAllItems()  # it goes by the balls' centres: of few a tile would lack halves
    for place, strength in (((0, 0, 1), MAIN), *FILL):
        lamp = vtkLight()
        lamp.SetLightTypeToCameraLight()
        lamp.SetPosition(*place)
        lamp.SetIntensity(strength)
        renderer.AddLight(lamp)


class Eye:
    """What the camera sees, in `count` x `count` tiles of the window's size: what VTK holds for a pixel is many times what the
    finished picture does. `background`: colours below and above."""

    def __init__(self, window, tile, count, background, transparent):
        self._window, self._tile, self._count = window, tile, count
        self._background, self._transparent = np.array(background), transparent
        self.renderer = vtkRenderer()
        self.renderer.SetGradientBackground(background[0] != background[1])
        if transparent:
            self.renderer.SetBackgroundAlpha(0.0)
        _lamps(self.renderer)
        window.AddRenderer(self.renderer)

    def look(self, camera, mill):
        """Sets the view for a camera.Camera; returns its shade.View."""
        self._camera = camera
        clipping = aim(self.renderer, camera, mill)
        self.renderer.GetLights().GetItemAsObject(0).SetPosition(*camera.lamp)
        return View(camera, tuple(self._count * side for side in self._tile), clipping)

    def tiles(self):
        """Draws tile by tile: (rows, columns) as slices, colours (h, w, 3 or 4) uint8 and depth buffer (h, w) of each."""
        width, height = self._tile
        for row in range(self._count):
            for column in range(self._count):
                self._turn_to(row, column)
                self._window.Render()
                place = (slice(row * height, (row + 1) * height), slice(column * width, (column + 1) * width))
                colours = pixels(self._window, self._tile, self._transparent)
                yield place, colours, depths(self._window, self._tile)

    def _turn_to(self, row, column):
        view, count, camera = self.renderer.GetActiveCamera(), self._count, self._camera
        view.SetWindowCenter(2 * column + 1 - count, count - 1 - 2 * row)  # in half tiles
        if camera.angle == 0:
            view.SetParallelScale(camera.height / 2 / count)
        else:
            half = math.tan(math.radians(camera.angle) / 2) / count
            view.SetViewAngle(2 * math.degrees(math.atan(half)))
        below, above = self._background
        shares = (count - row - 1) / count, (count - row) / count
        for share, setter in zip(shares, (self.renderer.SetBackground, self.renderer.SetBackground2), strict=True):
            setter(*(below + share * (above - below)))


def aim(renderer, camera, mill):
    """Sets the renderer's camera as a camera.Camera says; returns its clipping range [m]."""
    view = renderer.GetActiveCamera()
    view.SetPosition(*camera.eye)
    view.SetFocalPoint(*camera.target)
    view.SetViewUp(*camera.axes[1])
    view.SetParallelProjection(camera.angle == 0)
    if camera.angle == 0:
        view.SetParallelScale(camera.height / 2)
    else:
        view.SetViewAngle(camera.angle)
    reach = mill.reach * 1.05
    middle = -camera.eye @ camera.axes[2]
    clipping = max(middle - reach, reach / 500), middle + reach
    view.SetClippingRange(*clipping)
    return clipping


def pixels(window, size, transparent):
    """What has been drawn: (h, w, 3 or 4) uint8, top row first; a view of VTK's array."""
    found = vtkUnsignedCharArray()
    last = size[0] - 1, size[1] - 1
    if transparent:
        window.GetRGBACharPixelData(0, 0, *last, True, found, 0)
    else:
        window.GetPixelData(0, 0, *last, True, found, 0)
    return vtk_to_numpy(found).reshape(size[1], size[0], -1)[::-1]


def depths(window, size):
    """The depth buffer of what has been drawn, 0..1 float32 (h, w), top row first; a view of VTK's array."""
    found = vtkFloatArray()
    window.GetZbufferData(0, 0, size[0] - 1, size[1] - 1, found)
    return vtk_to_numpy(found).reshape(size[1], size[0])[::-1]


class Shadow:
    """What the strongest lamp sees: a square picture of depths in a corner of the window."""

    def __init__(self, window, size, mill):
        self._window, self._mill, self._side = window, mill, min(size)
        self.renderer = vtkRenderer()
        self.renderer.SetViewport(0, 0, self._side / size[0], self._side / size[1])
        self.renderer.AutomaticLightCreationOff()
        self.renderer.GetCullers().RemoveAllItems()
        self.renderer.DrawOff()
        window.AddRenderer(self.renderer)

    def look(self, camera):
        """Sets the lamp for a camera.Camera; returns its shade.View."""
        right, up, forward = camera.axes
        towards = camera.lamp @ np.array([right, up, -forward])
        reach = self._mill.reach * 1.05
        lamp = Camera(2 * reach * towards, np.zeros(3), up, 0.0, 2 * reach)
        clipping = aim(self.renderer, lamp, self._mill)
        return View(lamp, (self._side, self._side), clipping)

    def render(self):
        """The depth buffer (side, side) as the balls and the rotor stand."""
        others = [r for r in self._window.GetRenderers() if r is not self.renderer]
        for other in others:
            other.DrawOff()
        self.renderer.DrawOn()
        self._window.Render()
        found = depths(self._window, (self._side, self._side))
        self.renderer.DrawOff()
        for other in others:
            other.DrawOn()
        return found


class Balls:
    """One actor for all balls of `radius` (N,) [m]; move() sets their places and colours."""

    def __init__(self, radius):
        count = len(radius)
        # single precision is what the mapper takes: it crashes with doubles
        self._place = np.zeros((count, 3), np.float32)
        self._colour = np.zeros((count, 3), np.uint8)
        self._radius = np.ascontiguousarray(radius, np.float32)
        self._points, self._scalars = vtkPoints(), numpy_to_vtk(self._colour)
        self._points.SetData(numpy_to_vtk(self._place))
        size = numpy_to_vtk(self._radius)
        size.SetName("radius")
        self._data = vtkPolyData()
        self._data.SetPoints(self._points)
        self._data.SetVerts(_cells(np.arange(count).reshape(-1, 1)))  # without cells it has no bounds
        self._data.GetPointData().AddArray(size)
        self._data.GetPointData().SetScalars(self._scalars)
        mapper = vtkOpenGLSphereMapper()
        mapper.SetInputData(self._data)
        mapper.SetScaleArray("radius")
        self.actor = vtkActor()
        self.actor.SetMapper(mapper)
        _surface(self.actor, ambient=0.16, diffuse=0.86, specular=0.28, power=45)

    def move(self, place, colour):
        self._place[:], self._colour[:] = place, colour
        for changed in (self._points.GetData(), self._points, self._scalars, self._data):
            changed.Modified()


def metal(triangles, colour):
    """The actor of a body."""
    return _solid(triangles, colour, ambient=0.12, diffuse=0.72, specular=0.45, power=18)


def rims(triangles, colour):
    """Actors of the bars along the container's edges; [] of one without edges."""
    if not len(triangles):
        return []
    return [_solid(triangles, colour, ambient=0.2, diffuse=0.7, specular=0.4, power=25)]


def place(actor, pose):
    """Moves an actor to a pose (3, 4)."""
    matrix = vtkMatrix4x4()
    matrix.DeepCopy([*pose.ravel(), 0, 0, 0, 1])
    actor.SetUserMatrix(matrix)


class Glass:
    """The container's walls: clear where they are looked through, denser where they are seen edge on, as glass is. `actors`: their
    far side, then their near side."""

    def __init__(self, triangles, colour, clear=0.08, edge=0.75):
        self.actors, self._clear, self._edge = [], clear, edge
        if not len(triangles):
            return
        self._data = _normals(triangles, SHARP)
        points = vtk_to_numpy(self._data.GetPoints().GetData()).astype(float)
        self._points, self._normal = points, vtk_to_numpy(self._data.GetPointData().GetNormals())
        self._rgba = np.empty((len(points), 4), np.uint8)
        self._rgba[:, :3] = np.round(255 * np.array(colour))
        self._scalars = numpy_to_vtk(self._rgba)
        self._data.GetPointData().SetScalars(self._scalars)
        self.actors = [self._side(front) for front in (False, True)]

    def _side(self, front):
        mapper, actor = vtkPolyDataMapper(), vtkActor()
        mapper.SetInputData(self._data)
        # a wall that a body ends at lies behind that end
        mapper.SetResolveCoincidentTopologyToPolygonOffset()
        mapper.SetRelativeCoincidentTopologyPolygonOffsetParameters(0, 4)
        actor.SetMapper(mapper)
        actor.ForceTranslucentOn()
        _surface(actor, ambient=0.55, diffuse=0.45, specular=0.9 if front else 0.0, power=30)
        actor.GetProperty().SetFrontfaceCulling(not front)
        actor.GetProperty().SetBackfaceCulling(front)
        return actor

    def look(self, camera, pose):
        """How clear it is everywhere, seen from a camera.Camera, where it is at a pose (3, 4)."""
        if not self.actors:
            return
        sight = self._points - moved(inverse(pose), camera.eye)
        if camera.angle == 0:
            sight = np.broadcast_to(camera.axes[2] @ pose[:, :3], self._points.shape)
        across = np.abs(np.einsum("ij,ij->i", sight, self._normal)) / np.linalg.norm(sight, axis=1)
        alpha = self._clear + (self._edge - self._clear) * (1 - across) ** 4
        self._rgba[:, 3] = np.round(255 * alpha)
        self._scalars.Modified()
        self._data.Modified()


# ---- triangles


def _cells(index):
    """A vtkCellArray of cells (K, n) of n points each."""
    cells, count = vtkCellArray(), index.shape[1]
    offsets = np.arange(0, index.size + 1, count, dtype=np.int64)
    cells.SetData(numpy_to_vtk(offsets, deep=True), numpy_to_vtk(index.ravel().astype(np.int64), deep=True))
    return cells


def _normals(triangles, sharp):
    """Triangles (T, 3, 3) as vtkPolyData with normals, smooth but for edges sharper than `sharp` [degrees]."""
    data, points = vtkPolyData(), vtkPoints()
    points.SetData(numpy_to_vtk(triangles.reshape(-1, 3).astype(np.float32), deep=True))
    data.SetPoints(points)
    data.SetPolys(_cells(np.arange(3 * len(triangles)).reshape(-1, 3)))
    joined = vtkCleanPolyData()  # corners that meet become one point
    joined.SetInputData(data)
    joined.PointMergingOn()
    joined.SetTolerance(1e-7)
    normals = vtkPolyDataNormals()
    normals.SetInputConnection(joined.GetOutputPort())
    normals.SetFeatureAngle(sharp)
    normals.ConsistencyOff()
    normals.Update()
    return normals.GetOutput()


def _solid(triangles, colour, **surface):
    mapper, actor = vtkPolyDataMapper(), vtkActor()
    mapper.SetInputData(_normals(triangles, SHARP))
    actor.SetMapper(mapper)
    actor.GetProperty().SetColor(*colour)
    _surface(actor, **surface)
    return actor


def _surface(actor, ambient, diffuse, specular, power):
    look = actor.GetProperty()
    look.SetAmbient(ambient)
    look.SetDiffuse(diffuse)
    look.SetSpecular(specular)
    look.SetSpecularPower(power)

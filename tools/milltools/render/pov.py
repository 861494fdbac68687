"""Scenes for POV-Ray with true shadows and reflections, similar to Figure 4 of the paper.

scene() makes the text of a scene, trace() runs povray on it, draw() does both and adds colour bar and time. POV-Ray
accepts any right, up and direction, so the scene keeps the right-handed frame of the deck. Its colours are linear light
(assumed_gamma 1). A scene contains only numbers, no texts from a deck.
"""

import os
import pathlib
import subprocess
import tempfile

import numpy as np
from PIL import Image

from milltools.base import extras
from milltools.base.errors import UserError
from milltools.geometry.bodies import Mill, moved
from milltools.render.camera import FILL
from milltools.render.scene import STUDIO, written_over

FLAGS = ("-D", "-GD", "-GR", "-GS", "-GW", "+FN8", "+UA", "+A0.3", "+AM1", "+R2")
THREADS = "MILL_POVRAY_THREADS"
# strengths of the lamps in linear light, where sums look brighter than in the other pictures
POV_MAIN, POV_FILL = 0.95, 0.35
LAMP = 2.5  # radius of the main lamp, which stands at a distance of 12, in reaches of the mill: its shadows are soft

HEAD = """\
// A mill at t = {time:.9g} s, made by millsim; POV-Ray 3.7. Lengths in m, frame as in the deck.
// povray +I{{this file}} +W{width} +H{height} {flags}
#version 3.7;
global_settings {{ assumed_gamma 1 max_trace_level 5 }}
camera {{ {camera} }}
{lights}
// the studio: seen only in reflections
sphere {{ 0, {studio:.6g} inverse hollow no_image no_shadow
  pigment {{ gradient {up} scale {twice:.6g} translate -{studio:.6g} * {up}
    color_map {{ [0 rgb 0.25] [0.45 rgb 0.5] [0.62 rgb 1.1] [0.8 rgb 0.75] [1 rgb 1.5] }} }}
  finish {{ emission 1 diffuse 0 }} }}
#declare Steel = texture {{ pigment {{ rgb <0.42, 0.43, 0.45> }}
  finish {{ ambient 0.1 diffuse 0.6 specular 0.4 roughness 0.03 metallic
    reflection {{ 0.03, 0.25 falloff 3 metallic }} }} }}
#declare Rim = texture {{ pigment {{ rgb <0.030, 0.045, 0.070> }}
  finish {{ ambient 0.1 diffuse 0.7 specular 0.4 roughness 0.02 reflection {{ 0.01, 0.12 falloff 4 }} }} }}
#declare Glass = texture {{ pigment {{ rgbt <0.84, 0.91, 0.97, 0.88> }}
  finish {{ ambient 0.02 diffuse 0.15 specular 0.5 roughness 0.008 reflection {{ 0, 0.12 falloff 5 }} }} }}
#declare Ball = finish {{ ambient 0.07 diffuse 0.82 specular 0.5 roughness 0.012
  reflection {{ 0.03, 0.35 falloff 4 }} }}
#macro B(X, Y, Z, Radius, Red, Green, Blue)
sphere {{ <X, Y, Z>, Radius pigment {{ rgb <Red, Green, Blue> }} finish {{ Ball }} }}
#end
"""


# ---- the scene


def scene(run, state, camera, colour, size) -> str:
    """The scene of a trajectory.State of a milltools.read.runfile.Run, for a picture of `size` pixels."""
    mill = Mill.of(run)
    placed = camera.placed(size, written_over(run, camera, colour, size).frame)
    head = HEAD.format(
        time=state.time,
        width=size[0],
        height=size[1],
        flags=" ".join(FLAGS),
        camera=_camera(placed, size),
        lights=_lights(placed, mill),
        studio=40 * mill.reach,
        twice=80 * mill.reach,
        up=_vector(placed.axes[1]),
    )
    return "\n".join([head, *_bodies(mill, state.poses or {}), *_balls(run, state, colour), ""])


def _vector(values):
    return "<" + ", ".join(f"{v:.8g}" for v in values) + ">"


def _camera(camera, size):
    right, up, forward = camera.axes
    kind, high = "orthographic", camera.height
    if camera.angle > 0:
        kind, high = "perspective", 2 * np.tan(np.radians(camera.angle) / 2)
    return (
        f"{kind} location {_vector(camera.eye)} direction {_vector(forward)}\n"
        f"  right {_vector(right * high * (size[0] / size[1]))} up {_vector(up * high)}"
    )


def _lights(camera, mill):
    """The same lamps as in the other pictures: the main lamp casts shadows, the two others do not."""
    axes = camera.axes * np.array([[1], [1], [-1]])
    wide = 2 * LAMP * mill.reach
    soft = f"area_light {_vector(wide * axes[0])}, {_vector(wide * axes[1])}, 6, 6 adaptive 1 circular orient"
    lamps = [(camera.lamp, f"{POV_MAIN} {soft}")]
    lamps += [(np.array(place), f"{POV_FILL * strength:.3g} shadowless") for place, strength in FILL]
    return "\n".join(
        f"light_source {{ {_vector(12 * mill.reach * (place @ axes))} rgb {how} }}" for place, how in lamps
    )


def _mesh(triangles, texture, *words):
    points, index = np.unique(np.round(triangles.reshape(-1, 3), 9), axis=0, return_inverse=True)
    faces = [f"<{a}, {b}, {c}>" for a, b, c in index.reshape(-1, 3)]
    return (
        f"mesh2 {{\nvertex_vectors {{ {len(points)}, {', '.join(map(_vector, points))} }}\n"
        f"face_indices {{ {len(faces)}, {', '.join(faces)} }}\n"
        f"texture {{ {texture} }} {' '.join(words)} }}"
    )


def _bodies(mill, poses):
    """The container with bars along its edges, and all other bodies."""
    carrier = mill.pose(mill.carrier, poses)
    found = [_mesh(moved(carrier, mill.glass), "Glass", "no_shadow")] if len(mill.glass) else []
    found += [_mesh(moved(carrier, mill.frame), "Rim")] if len(mill.frame) else []
    for body in mill.inner:
        found.append(_mesh(moved(mill.pose(body.motion, poses), body.triangles), "Steel"))
    return found


def _balls(run, state, colour):
    linear = (colour.rgb(colour.values(state, run)) / 255.0) ** 2.2
    rows = np.column_stack([state.position, run.balls("diameter") / 2, linear])
    seen = rows if state.relieved is None else rows[~state.relieved]
    return ["B(" + ",".join(f"{v:.6g}" for v in row) + ")" for row in seen]


# ---- the picture


def trace(scene, size) -> np.ndarray:
    """The picture (h, w, 3) uint8 that povray makes of the text of a scene, of `size` pixels, over the usual
    background."""
    width, height = size
    with tempfile.TemporaryDirectory(prefix="mill-") as name:
        folder = pathlib.Path(name)
        (folder / "scene.pov").write_text(scene)
        words = [extras.program("povray", "povray"), "+Iscene.pov", "+Otraced.png", f"+W{width}", f"+H{height}", *FLAGS]
        if os.environ.get(THREADS, "").isdigit():
            words.append(f"+WT{os.environ[THREADS]}")
        # run() ends povray together with this process, on Ctrl-C too
        done = subprocess.run(
            words, cwd=folder, stdin=subprocess.DEVNULL, capture_output=True, text=True, errors="replace"
        )
        if done.returncode != 0 or not (folder / "traced.png").exists():
            raise UserError(f"povray ended with status {done.returncode}: {_reason(done.stderr)}", 1)
        with Image.open(folder / "traced.png") as image:
            picture = np.array(image.convert("RGBA"))
    below, above = (255 * np.array(c) for c in STUDIO)
    behind = above + (below - above) * np.linspace(0, 1, height)[:, None, None]
    alpha = picture[..., 3:] / 255
    return np.round(picture[..., :3] * alpha + behind * (1 - alpha)).astype(np.uint8)


def _reason(said):
    """The line with the error from the output of povray."""
    lines = [line.strip() for line in said.splitlines() if line.strip()] or ["it gave no message"]
    return next((line for line in lines if "rror" in line), lines[-1])


def draw(run, state, camera, colour, size) -> np.ndarray:
    """The finished picture (h, w, 3) uint8 of a state, as scene.Scene.draw gives it."""
    picture = trace(scene(run, state, camera, colour, size), size)
    written_over(run, camera, colour, size).paste(picture, state.time)
    return picture

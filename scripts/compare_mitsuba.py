#!/usr/bin/env python3
"""Indirect light beside the path integrator of Mitsuba 3, with the same bounces: a box with two blocks under a ceiling lamp, and
`gallery` without its emissive surfaces. Prints the mean relative difference of linear light over squares of pixels that show surfaces.

    python3 -m venv venv && venv/bin/pip install mitsuba numpy pillow
    cargo build --release --locked -p myriorama
    venv/bin/python scripts/compare_mitsuba.py [box|gallery]

The scenes are written as glTF files, which both programs get: ours reads them, and Mitsuba gets the same triangles.
"""

import base64
import json
import math
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import mitsuba as mi
import numpy as np
from PIL import Image

MYRIORAMA = "target/release/myriorama"
MOST = 0.02
# Darker light is little more than the steps of eight bits.
LEAST = 0.03
# A pixel.
SAMPLES = 1024
# Sides of the squares of pixels whose means are compared.
SQUARE = 8
BRIGHTER = 2
SIZE = (160, 120)


class Mesh:
    """Triangles with a colour for each corner, linear."""

    def __init__(self):
        self.places, self.colors = [], []

    def quad(self, corners, color):
        for corner in (0, 1, 2, 0, 2, 3):
            self.places.append(corners[corner])
            self.colors.append(color)

    def block(self, middle, half, turn, color):
        cos, sin = math.cos(turn), math.sin(turn)
        axes = np.array([[cos * half[0], 0, -sin * half[0]], [0, half[1], 0], [sin * half[2], 0, cos * half[2]]])
        for axis in range(3):
            out, right, up = (axes[(axis + i) % 3] for i in range(3))
            for side in (1, -1):
                turned = (right, up) if side == 1 else (up, right)
                a, b = turned
                center = np.array(middle) + side * out
                self.quad([center - a - b, center + a - b, center + a + b, center - a + b], color)

    def arrays(self):
        places = np.array(self.places, np.float32)
        a, b, c = places[0::3], places[1::3], places[2::3]
        normals = np.cross(b - a, c - a)
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        return places, np.repeat(normals, 3, axis=0).astype(np.float32), np.array(self.colors, np.float32)


def box():
    mesh = Mesh()
    white, red, green = (0.73, 0.73, 0.73), (0.63, 0.065, 0.05), (0.14, 0.45, 0.091)
    wall = lambda middle, right, up: [np.array(middle) + x * np.array(right) + y * np.array(up)
                                      for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    mesh.quad(wall((0, 0, 0), (0, 0, 1), (1, 0, 0)), white)
    mesh.quad(wall((0, 2, 0), (1, 0, 0), (0, 0, 1)), white)
    mesh.quad(wall((0, 1, -1), (1, 0, 0), (0, 1, 0)), white)
    mesh.quad(wall((-1, 1, 0), (0, 0, -1), (0, 1, 0)), red)
    mesh.quad(wall((1, 1, 0), (0, 0, 1), (0, 1, 0)), green)
    mesh.block((-0.35, 0.6, -0.3), (0.3, 0.6, 0.3), 0.3, white)
    mesh.block((0.35, 0.3, 0.35), (0.3, 0.3, 0.3), -0.3, white)
    lamp = {"type": "rectangle", "to_world": mi.ScalarTransform4f().translate([0, 1.98, 0]).rotate([1, 0, 0], 90).scale(0.25),
            "emitter": {"type": "area", "radiance": {"type": "rgb", "value": [30, 30, 30]}}}
    return {
        "mesh": mesh.arrays(), "camera": ((0, 1, 4.4), (0, 1, 0), 36.0), "rays": 512,
        "ours": ["--light", "rectangle at=0,1.98,0 u=0.25,0,0 v=0,0,0.25 radiance=30", "--environment", "0"],
        # Lamps with one bounce.
        "passes": [({"lamp": lamp}, 3)],
    }


def gallery():
    mesh, sun, sky = read_gallery()
    # Bright enough for pictures of eight bits.
    sun, sky = ([sun[0], [BRIGHTER * x for x in sun[1]]], [[BRIGHTER * x for x in end] for end in sky])
    size = (256, 128)
    up = np.cos(np.pi * (np.arange(size[1]) + 0.5) / size[1])
    share = (0.5 + 0.5 * up)[:, None, None]
    texels = np.broadcast_to(np.array(sky[1]) * (1 - share) + np.array(sky[0]) * share, (size[1], size[0], 3))
    around = {"type": "envmap", "bitmap": mi.Bitmap(np.ascontiguousarray(texels, np.float32)),
              "to_world": mi.ScalarTransform4f().rotate([0, 1, 0], 0)}
    towards, irradiance = sun
    lamp = {"type": "directional", "direction": [-x for x in towards],
            "irradiance": {"type": "rgb", "value": [math.pi * x for x in irradiance]}}
    text = lambda values: ",".join(f"{value:.7g}" for value in values)
    return {
        "mesh": mesh, "camera": ((4.3, 1.65, 2.9), (-2.2, 1.35, -1.0), 57.3),
        # Windows are a small part of what a place sees.
        "rays": 4096,
        "ours": ["--light", f"sun towards={text(towards)} irradiance={text(irradiance)} angle=0",
                 "--environment", f"{text(sky[0])}/{text(sky[1])}"],
        # The sun with one bounce, and the sky without.
        "passes": [({"sun": lamp}, 3), ({"sky": around}, 2)],
    }


def read_gallery():
    """The triangles, the sun and the sky that `cargo run -p scene --example export` prints."""
    command = ["cargo", "run", "--release", "--locked", "-q", "-p", "scene", "--example", "export", "--", "gallery"]
    exported = json.loads(subprocess.run(command, check=True, capture_output=True).stdout)
    arrays = tuple(np.array(exported[name], np.float32).reshape(-1, 3) for name in ("places", "normals", "colors"))
    return arrays, exported["sun"], exported["sky"]


def write_gltf(mesh, path):
    names = ("POSITION", "NORMAL", "COLOR_0")
    data = b"".join(array.tobytes() for array in mesh)
    count, step = len(mesh[0]), mesh[0].nbytes
    accessors = [{"bufferView": i, "componentType": 5126, "count": count, "type": "VEC3"} for i in range(3)]
    accessors[0] |= {"min": mesh[0].min(0).tolist(), "max": mesh[0].max(0).tolist()}
    path.write_text(json.dumps({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": dict(zip(names, range(3))), "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 1}}],
        "buffers": [{"byteLength": len(data), "uri": "data:application/octet-stream;base64," + base64.b64encode(data).decode()}],
        "bufferViews": [{"buffer": 0, "byteOffset": i * step, "byteLength": step} for i in range(3)],
        "accessors": accessors,
    }))


def ours(scene, folder):
    """Linear light of each pixel, and which pixels show a surface."""
    model = folder / "scene.gltf"
    write_gltf(scene["mesh"], model)
    lighting = ["--lighting", f"soft 128, indirect {scene['rays']}"]
    up = [MYRIORAMA, "up", "--scene", model, "--nodes", "1", "--no-viewer", "--listen", "127.0.0.1:0", "--sample-size", "40x30"]
    with subprocess.Popen([*up, *lighting, *scene["ours"]], stdout=subprocess.PIPE, text=True) as cluster:
        try:
            address = next(match[0] for line in cluster.stdout if (match := re.search(r"http://[\d.:]+", line)))
            eye, target, fov = scene["camera"]
            camera = ",".join(map(str, eye)) + ":" + ",".join(map(str, target)) + f":{fov}"
            subprocess.run([MYRIORAMA, "view", "--coordinator", address, "--camera", camera, "--size", "x".join(map(str, SIZE)),
                            "--antialias", "16", "--policy", "direct", "--exposure", "0", "--tone-map", "none", "--depth",
                            "--out", folder / "views"], check=True)
        finally:
            cluster.terminate()
    picture = np.asarray(Image.open(folder / "views/view_0000.png").convert("RGB"), np.float64) / 255
    depth = np.asarray(Image.open(folder / "views/view_0000.depth.png"))
    return np.where(picture <= 0.04045, picture / 12.92, ((picture + 0.055) / 1.055) ** 2.4), depth > 0


def theirs(scene):
    places, normals, colors = scene["mesh"]
    white = {"type": "diffuse", "reflectance": {"type": "mesh_attribute", "name": "vertex_color"}}
    properties = mi.Properties()
    properties["bsdf"] = mi.load_dict(white)
    mesh = mi.Mesh("scene", len(places), len(places) // 3, has_vertex_normals=True, props=properties)
    mesh.add_attribute("vertex_color", 3, colors.ravel())
    values = mi.traverse(mesh)
    values["vertex_positions"], values["vertex_normals"] = places.ravel(), normals.ravel()
    values["faces"] = np.arange(len(places), dtype=np.uint32)
    values.update()
    eye, target, fov = scene["camera"]
    sensor = {"type": "perspective", "fov": fov, "fov_axis": "y", "to_world": mi.ScalarTransform4f().look_at(eye, target, [0, 1, 0]),
              "film": {"type": "hdrfilm", "width": SIZE[0], "height": SIZE[1], "rfilter": {"type": "box"}, "pixel_format": "rgb"}}
    linear = 0
    for lights, depth in scene["passes"]:
        path = {"type": "path", "max_depth": depth, "hide_emitters": True}
        world = mi.load_dict({"type": "scene", "mesh": mesh, "sensor": sensor, "integrator": path, **lights})
        linear = linear + np.array(mi.render(world, spp=SAMPLES), np.float64)
    return linear


def squares(values):
    height, width, channels = values.shape
    return values.reshape(height // SQUARE, SQUARE, width // SQUARE, SQUARE, channels).mean((1, 3))


def main():
    mi.set_variant("scalar_rgb")
    is_good = True
    for name in sys.argv[1:] or ("box", "gallery"):
        scene = {"box": box, "gallery": gallery}[name]()
        with tempfile.TemporaryDirectory() as folder:
            got, shown = ours(scene, Path(folder))
        wanted = theirs(scene)
        # Means over squares of pixels: one pixel's noise, and the steps of eight bits, are no difference. White is as bright as
        # pictures get.
        shown &= wanted.max(2) < 0.95
        got, wanted = squares(got), squares(wanted)
        inner = (squares(shown[:, :, None]) == 1)[:, :, 0] & (wanted.min(2) > LEAST)
        difference = np.abs(got - wanted)[inner] / wanted[inner]
        bias = got[inner].mean() / wanted[inner].mean() - 1
        print(f"{name}: {inner.sum()} squares, mean relative difference {difference.mean():.4f}, of the means {bias:+.4f}")
        is_good &= difference.mean() <= MOST
    sys.exit(not is_good)


if __name__ == "__main__":
    main()

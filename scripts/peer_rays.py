#!/usr/bin/env python3
"""Measures Embree on one core in million rays a second, for comparison with `myriorama-lab bench`.

    pip install embreex numpy
    scripts/peer_rays.py SCENE.ply SAMPLES.json
    myriorama-lab bench --scene SCENE.ply --samples SAMPLES.json

Primary rays come from the first camera. From each hit start 16 shadow rays towards a sun of two degrees and 16
cosine-weighted occlusion rays within a twentieth of the scene's diagonal, as in `soft 16, occlusion 16`. Embree traces
one ray at a time here, from one thread; its tree is built beforehand.
"""
import json
import sys
import time

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

RAYS = 16
REPEATS = 3


def read_ply(path):
    """Vertices and triangles of a binary little-endian PLY whose faces are all triangles."""
    kinds = {"float": "<f4", "float32": "<f4", "double": "<f8", "uchar": "u1", "uint8": "u1", "int": "<i4", "uint": "<u4"}
    with open(path, "rb") as file:
        counts, fields, element = {}, [], None
        while (line := file.readline().decode("ascii").split())[0] != "end_header":
            if line[0] == "format" and line[1] != "binary_little_endian":
                sys.exit(f"{path}: only binary little-endian PLY is read")
            if line[0] == "element":
                element, counts[line[1]] = line[1], int(line[2])
            if line[0] == "property" and element == "vertex":
                fields.append((line[2], kinds[line[1]]))
        vertices = np.fromfile(file, np.dtype(fields), counts["vertex"])
        faces = np.fromfile(file, np.dtype([("n", "u1"), ("v", "<i4", 3)]), counts["face"])
    if np.any(faces["n"] != 3):
        sys.exit(f"{path}: only triangles are read")
    return np.stack([vertices[axis] for axis in "xyz"], 1).astype(np.float32), faces["v"].astype(np.uint32)


def camera_rays(path):
    about = json.load(open(path))
    frame = about["frames"][0]
    get = lambda name: float(frame.get(name, about.get(name)))
    pose = np.array(frame["transform_matrix"], np.float32)
    width, height = int(get("w")), int(get("h"))
    x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    local = np.stack([(x - get("cx")) / get("fl_x"), -(y - get("cy")) / get("fl_y"), -np.ones_like(x)], -1)
    directions = (local.reshape(-1, 3) @ pose[:3, :3].T).astype(np.float32)
    return np.broadcast_to(pose[:3, 3], directions.shape).astype(np.float32).copy(), directions


def million_a_second(scene, origins, directions, query, limits=None):
    times = []
    for _ in range(REPEATS):
        dists = None if limits is None else limits.copy()
        start = time.perf_counter()
        found = scene.run(origins, directions, dists=dists, query=query)
        times.append(time.perf_counter() - start)
    return len(origins) / sorted(times)[REPEATS // 2] * 1e-6, found


def tangents(normals):
    helper = np.where(np.abs(normals[:, :1]) > 0.9, [[0, 1, 0]], [[1, 0, 0]])
    tangent = np.cross(normals, helper)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    return tangent, np.cross(normals, tangent)


def main(ply, samples):
    points, triangles = read_ply(ply)
    scene = EmbreeScene()
    TriangleMesh(scene, points, triangles)
    origins, directions = camera_rays(samples)
    scene.run(origins[:1], directions[:1])
    primary, _ = million_a_second(scene, origins, directions, "DISTANCE")
    hits = scene.run(origins, directions, output=True)
    met = hits["primID"] >= 0
    corners = points[triangles[hits["primID"][met]]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-20)
    normals *= np.where((normals * directions[met]).sum(1) > 0, -1, 1)[:, None]
    starts = origins[met] + directions[met] * hits["tfar"][met][:, None] + normals * 1e-5
    starts, normals = np.repeat(starts, RAYS, 0).astype(np.float32), np.repeat(normals, RAYS, 0)
    random = np.random.default_rng(0)
    disc = np.sqrt(random.random(len(starts)))[:, None]
    angle = random.random(len(starts))[:, None] * 2 * np.pi
    tangent, bitangent = tangents(normals)
    up = np.sqrt(np.maximum(1 - disc * disc, 0))
    around = (tangent * disc * np.cos(angle) + bitangent * disc * np.sin(angle) + normals * up).astype(np.float32)
    radius = np.full(len(starts), 0.05 * np.linalg.norm(points.max(0) - points.min(0)), np.float32)
    sun = np.broadcast_to(np.array([-3, 6, 4]) / 61**0.5, starts.shape)
    sun_tangent, sun_bitangent = tangents(sun.copy())
    spread = np.tan(np.radians(2)) * disc
    sunwards = (sun + sun_tangent * spread * np.cos(angle) + sun_bitangent * spread * np.sin(angle)).astype(np.float32)
    lit = (sunwards * normals).sum(1) > 0
    far = np.full(lit.sum(), 1e30, np.float32)
    shadow, _ = million_a_second(scene, starts[lit].copy(), sunwards[lit].copy(), "OCCLUDED", far)
    occlusion, _ = million_a_second(scene, starts, around, "OCCLUDED", radius)
    print(f"Embree, one core, {len(triangles)} triangles, million rays a second:")
    for name, value in [("primary", primary), ("shadow", shadow), ("occlusion", occlusion)]:
        print(f"  {name:10} {value:.2f}")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])

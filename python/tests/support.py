"""What the tests have in common: a made-up flight, a wall, the program."""

import functools
import os
import pathlib
import shutil
import subprocess
import tempfile

import numpy as np

import pade

PROGRAM = os.environ.get("PADE_PROGRAM") or shutil.which("pade") or "pade"
FRAMES = 4


@functools.lru_cache(maxsize=None)
def scratch():
    """A folder that goes when the tests end."""
    folder = tempfile.TemporaryDirectory(prefix="pade-python-")
    scratch.keeper = folder
    return pathlib.Path(folder.name)


def run(*arguments):
    done = subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True)
    if done.returncode != 0:
        raise AssertionError(f"pade {arguments}: {done.stderr}")
    return done.stdout


@functools.lru_cache(maxsize=None)
def flight():
    """A short flight of `pade sample`."""
    run("sample", "--out", scratch() / "flight", "--frames", FRAMES)
    return scratch() / "flight"


def camera(width=160, height=120):
    return pade.Camera(width, height, 120, 120, (width - 1) / 2, (height - 1) / 2)


def wall_map(distance=4.05):
    """A map that has seen one wall, `distance` metres along z, in one look."""
    wall = pade.OccupancyMap({"looks_baseline": 0})
    depth = np.full((120, 160), distance, np.float32)
    wall.integrate(pade.DepthImage(depth), camera(), np.eye(4))
    return wall


def texture(height, width, seed=1):
    """Blurred noise of full contrast."""
    noise = np.random.default_rng(seed).random((height + 8, width + 8))
    for axis in (0, 1):
        for _ in range(2):
            noise = sum(np.roll(noise, k, axis) for k in range(-2, 3))
    noise = noise[4:-4, 4:-4]
    noise = (noise - noise.min()) / (noise.max() - noise.min())
    return np.ascontiguousarray((255 * noise).astype(np.uint8))


def slide(frames=4, shift=4, size=(120, 160)):
    """Images of a camera that slides along a wall 4 m away, 0.1 s and `shift` pixels apart, with its poses."""
    height, width = size
    wall = texture(height, width + shift * frames)
    for k in range(frames):
        pose = np.eye(4)
        pose[0, 3] = k * shift * 4 / 120
        yield wall[:, k * shift : k * shift + width], 0.1 * k, pose

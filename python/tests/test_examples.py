"""The examples, as their readers run them."""

import os
import pathlib
import re
import subprocess
import sys
import unittest

import pade
import support

EXAMPLES = pathlib.Path(__file__).parent.parent / "examples"


def run(name, *arguments):
    done = subprocess.run([sys.executable, "-B", EXAMPLES / name, *map(str, arguments)], capture_output=True, text=True)
    if done.returncode != 0:
        raise AssertionError(f"{name}: {done.stderr}")
    return done.stdout


class Examples(unittest.TestCase):
    def test_map_a_folder_writes_the_map_of_the_program(self):
        config = support.scratch() / "coarse.yaml"
        config.write_text("mapper: {flow: dis-fast, views: {count: 0}, map: {voxel: 0.2}}\n")
        support.run("map", support.flight(), "--out", support.scratch() / "coarse", "--config", config, "--no-report")
        file = support.scratch() / "example.bt"
        told = run("map_a_folder.py", support.flight(), file, config)
        self.assertEqual(file.read_bytes(), (support.scratch() / "coarse" / "map.bt").read_bytes())
        self.assertIn(f"TUM RGB-D, {support.FRAMES} frames", told)
        self.assertRegex(told, "ahead: an obstacle after [0-9.]+ m")

    def test_flow_picture(self):
        file = support.scratch() / "flow.ppm"
        told = run("flow_picture.py", support.flight(), file)
        self.assertRegex(told, r"clg-fast-half: median [1-9][0-9]?\.[0-9]+ pixels")
        header = re.match(rb"P6 (\d+) (\d+) 255\n", file.read_bytes())
        width, height = map(int, header.groups())
        self.assertEqual(file.stat().st_size, len(header.group()) + 3 * width * height)

    def test_depth_of_a_pair(self):
        told = run("depth_of_a_pair.py", support.flight())
        error = re.search(r"median error ([0-9.]+)%", told)
        self.assertLess(float(error.group(1)), 2)

    def test_navigate(self):
        moved = re.search(r"the camera moved ([0-9.]+) m", run("navigate.py"))
        self.assertAlmostEqual(float(moved.group(1)), 0.305, delta=0.02)

    def test_the_lines_of_the_documentation(self):
        page = EXAMPLES.parent.parent / "docs" / "python.md"
        if not page.exists():
            self.skipTest(f"{page} is not there: tests without the sources")
        (lines,) = re.findall(r"```python\n(.*?)```", page.read_text(), re.DOTALL)
        support.flight()
        module = {"PYTHONPATH": str(pathlib.Path(pade.__file__).resolve().parent.parent)}
        done = subprocess.run([sys.executable, "-B", "-c", lines], cwd=support.scratch(), env={**os.environ, **module},
                              capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex(done.stdout, "occupied and [0-9]+ free voxels of 0.2 m")


if __name__ == "__main__":
    unittest.main()

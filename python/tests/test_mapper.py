"""The chain: the same as the program, other threads go on, options by their names."""

import json
import sys
import threading
import time
import unittest

import numpy as np

import pade
import support


class SameAsTheProgram(unittest.TestCase):
    def test_the_map_of_a_folder_has_the_bytes_of_the_programs(self):  # with options: test_examples.py
        run = support.scratch() / "run"
        support.run("map", support.flight(), "--out", run, "--no-report")
        flight = pade.Sequence(support.flight())
        mapper = pade.ObstacleMapper(flight.camera, flight.options["mapper"], flight.mask)
        for frame in flight:
            mapper.add(frame)
        for name in ("map.bt", "map.ot"):
            written = support.scratch() / f"chain-{name}"
            mapper.map.write(written)
            self.assertEqual(written.read_bytes(), (run / name).read_bytes())
        health = json.loads((run / "run.json").read_text())["health"]
        self.assertEqual(mapper.health["mapped"], health["depth_images"])
        self.assertGreater(mapper.map.counts()["occupied"], 100)


class Threads(unittest.TestCase):
    """A thread of Python that counts. It lets go of the interpreter by itself, and would get it from nobody who keeps it:
    the interval at which one is asked for it is that of an hour."""

    def setUp(self):
        self.interval = sys.getswitchinterval()
        sys.setswitchinterval(3600)
        self.count = 0
        self.stop = False

        def work():
            while not self.stop:
                self.count += 1
                time.sleep(0)

        self.thread = threading.Thread(target=work)
        self.thread.start()

    def tearDown(self):
        self.stop = True
        sys.setswitchinterval(self.interval)
        self.thread.join()

    def progress_in(self, call, tries=100):
        for i in range(tries):
            before = self.count
            call(i)
            if self.count > before:
                return True
        return False

    def test_it_goes_on_while_a_frame_is_added(self):
        frames = list(support.slide(2))
        image, _, pose = frames[0]
        mapper = pade.ObstacleMapper(support.camera())

        def add(i):
            mapper.add(frames[i % 2][0], 0.1 * i, frames[i % 2][2])

        self.assertTrue(self.progress_in(add))
        self.assertGreater(mapper.health["frames"], 0)

    def test_it_goes_on_in_flow_and_queries(self):
        images = [image for image, _, _ in support.slide(2)]
        flow = pade.Flow("clg-fast")
        self.assertTrue(self.progress_in(lambda _: flow.estimate(images[0], images[1])))
        wall = support.wall_map()
        points = np.zeros((200000, 3))
        self.assertTrue(self.progress_in(lambda _: wall.at(points)))
        view = pade.MapView(wall)
        self.assertTrue(self.progress_in(lambda _: view.at(points)))

    def test_it_does_not_where_nothing_lets_go(self):  # else the tests above show nothing
        numbers = list(range(200000))
        before = self.count
        sum(numbers)
        self.assertEqual(self.count, before)


class SharedMapper(unittest.TestCase):
    def test_two_threads_on_one_mapper_wait_for_each_other(self):
        frames = list(support.slide(2))
        mapper = pade.ObstacleMapper(support.camera())
        reads = []

        def add(first):
            for i in range(first, 12, 2):
                mapper.add(frames[i % 2][0], 0.1 * i, frames[i % 2][2])
                reads.append(mapper.map.counts()["occupied"] + len(mapper.map.free()))
                mapper.view().at([0, 0, 1])

        threads = [threading.Thread(target=add, args=(first,)) for first in (0, 1)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(mapper.health["frames"], 12)  # some of them late, and skipped
        self.assertEqual(len(reads), 12)


class Chain(unittest.TestCase):
    def test_a_wall_is_where_it_is(self):
        mapper = pade.ObstacleMapper(support.camera())
        self.assertIsNone(mapper.T_world_camera)
        for image, at, pose in support.slide(5):
            update = mapper.add(image, at, pose)
        depth = update.depth
        self.assertEqual(update.outcome, "mapped")
        self.assertAlmostEqual(float(np.nanmedian(depth.depth)), 4, delta=0.04)
        self.assertEqual(depth.state[60, 80], pade.DepthState.measured)
        np.testing.assert_array_equal(np.isnan(depth.depth), depth.state != pade.DepthState.measured)
        np.testing.assert_allclose(depth.sigma**2, depth.variance, rtol=1e-5)
        bounded = np.isfinite(depth.depth) & np.isfinite(depth.bound)
        self.assertGreater(bounded.mean(), 0.5)
        self.assertTrue((depth.bound[bounded] <= depth.depth[bounded]).all())
        self.assertEqual(set(update.seconds), {"grey", "derotate", "flow", "refine", "depth", "map", "total"})
        self.assertEqual(update.time, pade.Time.from_seconds(0.4))
        np.testing.assert_allclose(mapper.T_world_camera.matrix, pose, atol=1e-9)

    def test_depth_of_a_pair(self):
        (first, _, from_), (second, _, to) = support.slide(2)
        update = pade.depth_of_pair(support.camera(), first, second, from_, to)
        self.assertAlmostEqual(float(np.nanmedian(update.depth.depth)), 4, delta=0.04)
        with self.assertRaisesRegex(pade.Error, "image is 150 x 120"):
            pade.depth_of_pair(support.camera(), first[:, :150], second, from_, to)
        with self.assertRaisesRegex(pade.Error, "not finite"):
            pade.depth_of_pair(support.camera(), first, second, from_, to * np.nan)

    def test_frames_that_cannot_be_used_are_skipped_with_a_reason_and_counted(self):
        mapper = pade.ObstacleMapper(support.camera())
        image, at, pose = next(support.slide(1))
        self.assertEqual(mapper.add(image, at, pose).outcome, "waiting")
        for wrong, text in (((image[:, :100], 1, pose), "100 x 120"), ((image, 1, pose * np.nan), "not finite"),
                            ((image, at, pose), "not after that of the frame before")):
            update = mapper.add(*wrong)
            self.assertEqual(update.outcome, "skipped")
            self.assertIn(text, update.reason)
            self.assertIsNone(update.depth)
        self.assertEqual(mapper.health, {"frames": 4, "mapped": 0, "skipped": 3, "stamp_offset": None})

    def test_a_mask_of_bools(self):
        valid = np.ones((120, 160), bool)
        valid[:40] = False
        mapper = pade.ObstacleMapper(support.camera(), valid=valid)
        for image, at, pose in support.slide(3):
            update = mapper.add(image, at, pose)
        self.assertTrue((update.depth.state[:30] == pade.DepthState.out_of_view).all())

    def test_depth_of_a_flow_of_another_program(self):
        camera = pade.Camera(320, 240, 320, 320, 159.5, 119.5)
        covariance = np.diag([0.002**2] * 3 + [0] * 3)
        other = np.eye(4)
        other[0, 3] = 0.1
        motion = pade.RelativeMotion(np.eye(4), other, 0.1, covariance)
        np.testing.assert_allclose(motion.translation, [0.1, 0, 0])
        vectors = np.zeros((240, 320, 2), np.float32)
        vectors[..., 0] = -6.4
        flow = pade.FlowField(vectors, np.full((240, 320), 0.1, np.float32))
        options = {"flow_sigma_scale": 1, "flow_relative_sigma": 0}
        depth = pade.DepthEstimator(options).estimate(camera, motion, flow)
        self.assertAlmostEqual(float(depth.depth[120, 160]), 5, delta=0.01)
        self.assertAlmostEqual(float(depth.sigma[120, 160]), 5 * np.hypot(0.1 / 6.4, 0.02), delta=0.01)
        image = np.zeros((240, 320), np.uint8)
        for one in ({"reference": image}, {"other": image}):
            with self.assertRaisesRegex(pade.Error, "reference, other: found one of them, expected both or none"):
                pade.DepthEstimator(options).estimate(camera, motion, flow, **one)


class Options(unittest.TestCase):
    camera = support.camera()

    def test_a_dict_yaml_text_and_a_file_are_the_same(self):
        file = support.scratch() / "mapper.yaml"
        file.write_text("flow: dis-fast\nmap: {voxel: 0.2}\n")
        options = [
            pade.ObstacleMapper(self.camera, given).options
            for given in (file, file.read_text(), {"flow": "dis-fast", "map": {"voxel": 0.2}},
                          {"flow": "dis-fast", "map": {"voxel": np.float64(0.2)}})
        ]
        self.assertEqual(options[0]["map"]["voxel"], 0.2)
        for other in options[1:]:
            self.assertEqual(other, options[0])
        self.assertEqual(pade.ObstacleMapper(self.camera, options[0]).options, options[0])

    def test_an_unknown_option_is_named(self):
        for make in (pade.ObstacleMapper, lambda _, options: pade.OccupancyMap(options["map"])):
            with self.assertRaisesRegex(pade.Error, "voxle: found an unknown field, expected one of voxel, range"):
                make(self.camera, {"map": {"voxle": 0.2}})
        with self.assertRaisesRegex(pade.Error, "mapper: found an unknown field, expected one of flow"):
            pade.ObstacleMapper(self.camera, {"mapper": {}})
        with self.assertRaisesRegex(pade.Error, "histry: found an unknown field"):
            pade.Navigator({"histry": 1})
        with self.assertRaisesRegex(pade.Error, "maper: found an unknown field, expected one of mapper, sequence"):
            pade.Sequence(support.flight(), {"maper": {}})

    def test_values_that_make_no_sense_are_named(self):
        for options, text in (
            ({"map": {"voxel": -1}}, "voxel"),
            ({"map": {"voxel": "wide"}}, "map.voxel: found 'wide', expected a number"),
            ({"flow": "magic"}, "unknown flow method 'magic'; expected one of"),
            ("map: [1", "found .*, expected YAML"),
            ("[flow: dis-fast]", "expected a mapping of options"),
            ("config.yaml", "found \"config.yaml\", expected YAML text .*, a dict, or a pathlib.Path of a YAML file"),
        ):
            with self.assertRaisesRegex(pade.Error, text):
                pade.ObstacleMapper(self.camera, options)
        with self.assertRaisesRegex(TypeError, "options: found float, expected a dict, YAML text, or a pathlib.Path"):
            pade.ObstacleMapper(self.camera, 0.2)

    def test_errors_are_value_errors(self):
        self.assertTrue(issubclass(pade.Error, ValueError))
        self.assertEqual(pade.Error.__module__, "pade")
        with self.assertRaisesRegex(ValueError, "undistorted pinhole"):
            pade.ObstacleMapper(pade.Camera(160, 120, 100, 100, 80, 60, "equidistant", [0.1, 0, 0, 0]))


class Flights(unittest.TestCase):
    def test_a_folder_is_a_sequence_of_frames(self):
        flight = pade.Sequence(support.flight())
        self.assertEqual(len(flight), support.FRAMES)
        self.assertEqual(flight.layout, "TUM RGB-D")
        self.assertEqual([frame.time for frame in flight], [flight.time(i) for i in range(len(flight))])
        self.assertEqual(flight[-1].image.shape, (flight.camera.height, flight.camera.width))
        np.testing.assert_array_equal(flight[1].T_world_camera.matrix, flight.pose(1).matrix)
        self.assertEqual(flight.truth(0).dtype, np.float32)
        with self.assertRaisesRegex(IndexError, f"found frame {support.FRAMES}, expected one of {support.FRAMES}"):
            flight[support.FRAMES]

    def test_a_folder_that_is_none_is_an_error(self):
        with self.assertRaisesRegex(pade.Error, "nowhere"):
            pade.Sequence("nowhere")
        with self.assertRaisesRegex(pade.Error, "T_body_camera is missing"):
            pade.Sequence(support.flight(), {"sequence": {"poses": "from-imu-gnss"}})

    def test_options_are_those_of_a_config_file(self):
        flight = pade.Sequence(support.flight(), "mapper: {map: {voxel: 0.25}}\nsequence: {origin: flight}")
        self.assertEqual(flight.options["sequence"]["origin"], "flight")
        self.assertEqual(pade.ObstacleMapper(flight.camera, flight.options["mapper"]).map.voxel, 0.25)


if __name__ == "__main__":
    unittest.main()

"""Flow, queries of the map, and navigation against what is known of them otherwise."""

import json
import unittest

import numpy as np

import pade
import support


class FlowMethods(unittest.TestCase):
    def test_a_shift_is_found_by_every_method(self):
        first, second = (image for image, _, _ in support.slide(2, shift=3))
        self.assertIn("clg-fast-half", pade.flow_methods())
        for name in pade.flow_methods():
            vectors = pade.Flow(name).estimate(first, second).vectors[20:-20, 20:-20]
            np.testing.assert_allclose(np.nanmedian(vectors, (0, 1)), [-3, 0], atol=0.25, err_msg=name)

    def test_a_stream_is_the_flow_from_image_to_image(self):
        flow = pade.Flow("clg-fast-half")
        images = [image.copy() for image, _, _ in support.slide(3)]
        self.assertIsNone(flow.next(images[0]))
        streamed = [flow.next(images[k]).vectors for k in (1, 2)]
        flow.restart()
        self.assertIsNone(flow.next(images[0]))
        for k in (1, 2):
            pair = pade.Flow("clg-fast-half").estimate(images[k - 1], images[k]).vectors
            np.testing.assert_allclose(streamed[k - 1], pair, atol=0.2)

    def test_masked_pixels_have_no_flow(self):
        first, second = (image for image, _, _ in support.slide(2))
        flow = pade.Flow("clg-fast-half")
        mask = np.ones((120, 160), np.uint8)
        mask[:, :50] = 0
        for given in (mask, 255 * mask, mask.astype(bool)):
            flow.set_mask(given)
            vectors = flow.estimate(first, second).vectors
            self.assertTrue(np.isnan(vectors[:, :50]).all())
            np.testing.assert_allclose(np.median(vectors[20:-20, 80:-20], (0, 1)), [-4, 0], atol=0.1)
        with self.assertRaisesRegex(pade.Error, "mask: found 160 x 120 pixels, expected the image's 80 x 120"):
            flow.estimate(first[:, :80], second[:, :80])

    def test_a_picture(self):
        picture = pade.FlowField(np.full((100, 120, 2), 2, np.float32)).picture()
        self.assertEqual(picture.dtype, np.uint8)
        self.assertGreaterEqual(picture.shape[0], 100)
        self.assertGreater(picture.shape[1], 120)

    def test_an_unknown_method_or_option_is_named(self):
        with self.assertRaisesRegex(pade.Error, "unknown flow method 'magic'; expected one of "):
            pade.Flow("magic")
        with self.assertRaisesRegex(pade.Error, "confidence: found 'some', expected one of none, local, forward_backward"):
            pade.Flow(confidence="some")
        with self.assertRaisesRegex(pade.Error, "threads"):
            pade.Flow(threads=0)


class MapQueries(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.map = support.wall_map()
        cls.view = pade.MapView(cls.map)
        cells = [cls.map.free(), cls.map.occupied()]
        cls.known = {}
        for state, part in zip((pade.Occupancy.free, pade.Occupancy.occupied), cells):
            for centre, side in zip(part.centres.astype(float), part.sides):
                n = round(float(side) / cls.map.voxel)
                low = np.round((centre - side / 2) / cls.map.voxel).astype(int)
                for offset in np.ndindex(n, n, n):
                    cls.known[tuple(low + offset)] = int(state)
        rng = np.random.default_rng(3)
        cls.points = np.round(rng.uniform([-3, -3, -1], [3, 3, 5], (4000, 3)), 1) + 0.05

    def state_of(self, point):
        return self.known.get(tuple(np.floor(np.asarray(point) / self.map.voxel).astype(int)), 0)

    def test_states_are_those_of_the_cells(self):
        expected = [self.state_of(point) for point in self.points]
        self.assertEqual(set(expected), {0, 1, 2})
        for asked in (self.map, self.view):
            np.testing.assert_array_equal(asked.at(self.points), expected)
            np.testing.assert_array_equal(asked.at(self.points.reshape(40, 100, 3)).ravel(), expected)
        probability = self.map.probability(self.points)
        np.testing.assert_array_equal(np.isnan(probability), np.array(expected) == pade.Occupancy.unknown)
        self.assertEqual(self.map.at([0.05, 0.05, 2.05]), pade.Occupancy.free)
        self.assertEqual(self.map.at([np.nan, 0, 0]), pade.Occupancy.unknown)

    def test_counts_are_those_of_the_program(self):
        file = support.scratch() / "wall.bt"
        self.map.write(file, overwrite=True)
        told = json.loads(support.run("info", file, "--json"))
        text = json.dumps(told)
        counts = self.map.counts()
        self.assertEqual(counts["occupied"] + counts["free"], len(self.known))
        for number in counts.values():
            self.assertIn(str(number), text)

    def test_files_hold_the_map(self):
        for kind in ("bt", "ot"):
            file = support.scratch() / f"kept.{kind}"
            self.map.write(file, overwrite=True)
            again = pade.OccupancyMap.read(file)
            np.testing.assert_array_equal(again.at(self.points), self.map.at(self.points))
            with self.assertRaisesRegex(pade.Error, f"kept.{kind}: found a file there, expected none, or overwrite=True"):
                self.map.write(file)
        with self.assertRaisesRegex(pade.Error, "map.txt"):
            self.map.write(support.scratch() / "map.txt")
        with self.assertRaisesRegex(pade.Error, "nowhere.bt"):
            pade.OccupancyMap.read("nowhere.bt")

    def test_rays_end_where_a_march_in_small_steps_does(self):
        rng = np.random.default_rng(5)
        origin = np.array([0.03, -0.02, 1.01])
        directions = rng.normal([0, 0, 2], 0.5, (60, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        steps = np.arange(0, 6, 0.002)
        for unknown, blocking in (("free", [2]), ("blocked", [0, 2])):
            lengths = self.view.rays(origin, directions, 6, unknown)
            self.assertTrue(np.isfinite(lengths).any())
            for direction, length in zip(directions, lengths):
                states = self.map.at(origin + steps[:, None] * direction)
                blocked = np.flatnonzero(np.isin(states, blocking))
                marched = steps[blocked[0]] if len(blocked) else np.inf
                if np.isinf(marched) or np.isinf(length):
                    self.assertEqual(marched, length)
                else:
                    self.assertLessEqual(length, marched + 1e-6)
                    self.assertGreater(length, marched - 0.25)  # it may graze a corner between two steps
                hit = self.view.ray(origin, direction, 6, unknown)
                self.assertEqual(np.inf if hit is None else hit.length, length)

    def test_the_way_to_the_wall_is_known(self):
        lowest = min(index[2] for index, state in self.known.items() if state == 2) * self.map.voxel
        hit = self.view.ray([0.05, 0.05, 1.05], [0, 0, 3], 10, "free")
        self.assertAlmostEqual(hit.length, lowest - 1.05, delta=1e-6)
        self.assertEqual(hit.state, pade.Occupancy.occupied)
        ball = self.view.sweep([[0.05, 0.05, 1.05], [0.05, 0.05, 9]], 0.3, "free")
        self.assertAlmostEqual(ball.length, lowest - 0.3 - 1.05, delta=1e-6)
        self.assertIsNone(self.view.sweep([[0.05, 0.05, 1.5], [0.05, 0.05, 2]], 0.2))

    def test_contents_sectors_frontiers_and_distances(self):
        low, high = np.array([-0.45, -0.45, 3.55]), np.array([0.45, 0.45, 4.45])
        grid = np.stack(np.meshgrid(*[np.arange(a, b + 0.01, 0.1) for a, b in zip(low, high)], indexing="ij"), -1)
        states = self.map.at(grid)
        inside = self.view.in_box(low, high)
        for state in pade.Occupancy:
            self.assertEqual(inside[state.name], np.count_nonzero(states == state))
        self.assertGreater(self.view.in_ball([0, 0, 4.05], 0.5)["occupied"], 0)
        self.assertEqual(self.view.sectors([0.05, 0.05, 2.05], 5, 0.2, 0.2).shape, (72,))
        frontiers = self.view.frontiers([-1, -1, 1], [1, 1, 5])
        self.assertTrue((self.map.at(frontiers) == pade.Occupancy.free).all())
        field = self.view.distances([-1, -1, 1], [1, 1, 4.5], "free")
        blocked = np.array([index for index, state in self.known.items() if state == 2]) * 0.1 + 0.05
        blocked = blocked[((blocked > [-1, -1, 1]) & (blocked < [1, 1, 4.5])).all(1)]
        nearest = np.linalg.norm(blocked - [0.05, 0.05, 2.05], axis=1).min()
        self.assertAlmostEqual(float(field.distance([0.05, 0.05, 2.05])), nearest, places=6)
        self.assertLess(field.gradient([[0.05, 0.05, 3.05]])[0, 2], -0.9)

    def test_a_view_is_one_moment_and_the_mappers_is_kept_up_to_date(self):
        mapper = pade.ObstacleMapper(support.camera(), {"map": {"looks_baseline": 0.05}})
        frames = list(support.slide(6))
        for image, at, pose in frames[:3]:
            mapper.add(image, at, pose)
        early = mapper.view()
        cells = mapper.map.occupied().centres
        before = early.at(cells)
        for image, at, pose in frames[3:]:
            mapper.add(image, at, pose)
        np.testing.assert_array_equal(early.at(cells), before)
        points = np.random.default_rng(7).uniform([-2, -2, 0], [3, 2, 5], (5000, 3))
        np.testing.assert_array_equal(mapper.view().at(points), mapper.map.at(points))
        np.testing.assert_array_equal(pade.MapView(mapper.map).at(points), mapper.map.at(points))

    def test_what_no_voxel_can_hold_is_refused_and_not_called_empty(self):
        edge = 3276.8
        for axis in range(3):
            for side in (-1, 1):
                for beyond in (4000 - edge, 0.3, 1e9):
                    place = np.zeros(3)
                    place[axis] = side * (edge + beyond - 0.5)  # a ball of 0.5 m about the second just reaches out
                    for call in (lambda: self.view.in_ball(place, 0.5),
                                 lambda: self.view.in_box(place - 0.5, place + 0.5),
                                 lambda: self.view.sectors(place, 0.5, 0.5, 0.5)):
                        with self.assertRaisesRegex(pade.Error, "within 3276.8 m of 0 0 0"):
                            call()
                place[axis] = side * (edge - 1)
                counts = self.view.in_ball(place, 0.5)
                self.assertEqual((counts["occupied"], counts["free"]), (0, 0))
                self.assertGreater(counts["unknown"], 300)
                self.assertLess(self.view.sectors(place, 0.5, 0.5, 0.5).max(), 0.2)

    def test_what_makes_no_sense_is_refused(self):
        for call, text in (
            (lambda: self.view.ray([0, 0, 0], [0, 0, 0], 1), "direction: found none"),
            (lambda: self.view.ray([0, 0, 0], [0, 0, 1], float("nan")), "reach: found nan"),
            (lambda: self.view.ray([0, 0, 0], [0, 0, 1], 1, "maybe"), "unknown: found 'maybe', expected one of blocked, free"),
            (lambda: self.view.sweep([[0, 0, 0]], -1), "radius: found -1"),
            (lambda: self.view.in_box([0, 0, 0], [1, 1, -1]), "found no box"),
            (lambda: self.view.in_box([-1e3] * 3, [1e3] * 3), r"found 8e\+12 voxels of 0.1 m in there, expected at most 2e\+08"),
            (lambda: self.view.distances([-1e3] * 3, [1e3] * 3), "lowest, highest: found"),
            (lambda: self.view.sweep([[0, 0, 0]], 1e6), "radius: found"),
            (lambda: self.view.flown([[0, 0, 0], [1e5, 0, 0]], 3), "path: found"),
            (lambda: self.view.sectors([0, 0, 0], 1e6, 1, 1), "reach, below, above: found"),
            (lambda: self.view.sectors([0, 0, np.nan], 5, 1, 1), "place, below, above: found NaN"),
            (lambda: self.view.in_ball([0, np.nan, 0], 1), "centre: found NaN"),
            (lambda: self.view.in_ball([0, 0, -np.inf], 1), "centre: found NaN or infinity"),
            (lambda: pade.RelativeMotion(np.eye(4) * np.nan, np.eye(4)), "expected finite numbers"),
            (lambda: pade.RelativeMotion(np.eye(4), np.eye(4), 0.1, -np.eye(6)), "covariance: found a matrix that is no covariance"),
            (lambda: pade.ObstacleMapper(support.camera()).add(
                np.zeros((120, 160), np.uint8), 0, np.eye(4), np.full((6, 6), np.nan)), "motion_covariance: found a matrix that is no"),
            (lambda: pade.derotate_image(np.zeros((0, 0), np.uint8), support.camera(), pade.RelativeMotion(np.eye(4), np.eye(4))),
             "image: found no pixels"),
            (lambda: pade.FlowField(np.zeros((0, 5, 2), np.float32)), "vectors: found no pixels"),
            (lambda: pade.ObstacleMapper(support.camera()).map.integrate(
                pade.DepthImage(np.zeros((120, 160), np.float32)), support.camera(), np.eye(4)), "the map of a mapper"),
            (lambda: pade.OccupancyMap().integrate(
                pade.DepthImage(np.zeros((2, 2), np.float32)), support.camera(), np.eye(4)), "found 2 x 2 cells"),
            (lambda: pade.OccupancyMap().integrate(
                pade.DepthImage(np.zeros((120, 160), np.float32)),
                pade.Camera(160, 120, 120, 120, 80, 60, "equidistant", [0.1, 0, 0, 0]), np.eye(4)), "a lens with distortion"),
            (lambda: pade.OccupancyMap().integrate(
                pade.DepthImage(np.zeros((120, 160), np.float32)), support.camera(), np.eye(4) * np.nan), "finite"),
        ):
            with self.assertRaisesRegex(pade.Error, text):
                call()
        with self.assertRaisesRegex(TypeError, r"points: found shape \(4,\), expected \(..., 3\)"):
            self.map.at([1, 2, 3, 4])


class Planning(unittest.TestCase):
    def test_a_plan_ends_in_a_stop_in_space_that_is_known_to_be_free(self):
        camera = pade.Pose.from_quaternion([0, 0, 1.5], [0, 0, 0, 1]) @ pade.forward_camera()
        seen = pade.OccupancyMap({"looks_baseline": 0})
        seen.integrate(pade.DepthImage(np.full((120, 160), 8.05, np.float32)), support.camera(), camera)
        self.assertEqual(seen.at([7.95, 0.05, 1.55]), pade.Occupancy.free)
        view = pade.MapView(seen).flown([[0, 0, 1.5]], 1.2)
        planner = pade.LocalPlanner({"peering": False})
        time, position, velocity, yaw = 0.0, np.array([0, 0, 1.5]), np.zeros(3), 0.0
        kinds = set()
        for _ in range(30):  # towards a goal behind the wall
            plan = planner.plan(view, time, position, velocity, yaw, [20, 0, 1.5])
            kinds.add(plan.kind)
            np.testing.assert_allclose(plan.velocities[-1], 0, atol=1e-6)
            self.assertIsNone(view.sweep(plan.positions, planner.options["vehicle"]["radius"]))
            time += 0.2
            position = np.array([np.interp(time, plan.times, plan.positions[:, axis]) for axis in range(3)])
            velocity = np.array([np.interp(time, plan.times, plan.velocities[:, axis]) for axis in range(3)])
            yaw = float(np.interp(time, plan.times, plan.yaws))
        self.assertIn("flying", kinds)
        self.assertGreater(position[0], 2)
        self.assertLess(position[0], 8 - planner.options["vehicle"]["radius"])
        arrived = pade.LocalPlanner().plan(view, 0, [0, 0, 1.5], [0, 0, 0], 0, [0.2, 0, 1.5])
        self.assertEqual(arrived.kind, "arrived")

    def test_what_makes_no_sense_is_refused(self):
        view = pade.MapView(pade.OccupancyMap())
        with self.assertRaisesRegex(pade.Error, "expected finite numbers"):
            pade.LocalPlanner().plan(view, 0, [0, 0, np.nan], [0, 0, 0], 0, [1, 0, 0])
        with self.assertRaisesRegex(pade.Error, "sigma, offset: found -1"):
            pade.LocalPlanner().plan(view, 0, [0, 0, 1], [0, 0, 0], 0, [1, 0, 0], sigma=-1)
        with self.assertRaisesRegex(pade.Error, r"velocity: found 1e\+06 m/s, expected at most 50"):
            pade.LocalPlanner().plan(view, 0, [0, 0, 1], [1e6, 0, 0], 0, [1, 0, 0])
        with self.assertRaisesRegex(pade.Error, "speeed: found an unknown field"):
            pade.LocalPlanner({"vehicle": {"speeed": 1}})


class Navigation(unittest.TestCase):
    def setUp(self):
        """Three seconds at rest, then eastwards with 1 m/s^2."""
        self.navigator = pade.Navigator()
        noise = 0.05**2 * np.eye(3)
        for i in range(1401):
            now, moving = i / 200, max(0.0, i / 200 - 3)
            self.navigator.add_imu(now, [0, 0, 0], [float(moving > 0), 0, 9.80665])
            if i == 200:
                self.navigator.add_heading(now, 0, 0.02)
            if i % 40 == 0:
                self.navigator.add_gnss_position(now, [0.5 * moving**2, 0, 0], noise)
                self.navigator.add_gnss_velocity(now, [moving, 0, 0], noise)

    def test_a_motion_and_its_covariance(self):
        relative = self.navigator.relative_pose(6.0, 6.1, pade.forward_camera([0.1, 0, 0]))
        self.assertTrue(relative.valid and relative.scale_valid)
        self.assertAlmostEqual(relative.motion.translation[2], 0.305, delta=0.02)
        self.assertTrue((np.linalg.eigvalsh(relative.motion.covariance) > 0).all())

    def test_where_it_is(self):
        pose = self.navigator.absolute_pose(6.5)
        self.assertEqual(pose.answer, "valid")
        np.testing.assert_allclose(pose.T_world_body.translation, [0.5 * 3.5**2, 0, 0], atol=0.1)
        np.testing.assert_allclose(pose.velocity, [3.5, 0, 0], atol=0.1)
        self.assertEqual(pose.covariance.shape, (9, 9))
        self.assertEqual(self.navigator.health()["status"], "navigating")
        self.assertEqual(self.navigator.newest, pade.Time.from_seconds(7))

    def test_questions_without_an_answer(self):
        self.assertEqual(self.navigator.absolute_pose(8).answer, "too_new")
        self.assertEqual(self.navigator.absolute_pose(1).answer, "too_old")
        self.assertEqual(pade.Navigator().absolute_pose(0).answer, "not_initialised")
        with self.assertRaisesRegex(pade.Error, "t2: found 6.0+, expected t1, 6.1"):
            self.navigator.relative_pose(6.1, 6.0, pade.forward_camera())

    def test_what_cannot_be_used_is_counted(self):
        self.navigator.add_barometer(6.9, float("nan"))
        self.navigator.add_imu(5.0, [0, 0, 0], [0, 0, 9.8])
        health = self.navigator.health()
        self.assertEqual((health["unusable"], health["imu_refused"]), (1, 1))

    def test_samples_of_a_whole_log(self):
        one, many = pade.Navigator(imu="consumer"), pade.Navigator(imu="consumer")
        times = np.arange(600) / 200
        rates, forces = np.zeros((600, 3)), np.tile([0, 0, 9.80665], (600, 1))
        for t, rate, force in zip(times, rates, forces):
            one.add_imu(t, rate, force)
        many.add_imu(times, rates, forces)
        self.assertEqual(one.newest, many.newest)
        self.assertEqual(one.health(), many.health())
        with self.assertRaisesRegex(TypeError, "time: found shape"):
            many.add_imu(times[:10], rates, forces)


if __name__ == "__main__":
    unittest.main()

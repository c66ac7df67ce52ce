"""Arrays in and out: no copies, their lifetime, what is refused."""

import gc
import unittest

import numpy as np

import pade
import support


class ArraysIn(unittest.TestCase):
    def setUp(self):
        self.flow = pade.Flow("clg-fast-half")
        self.image = support.texture(64, 80)

    def refused(self, argument, *expected):
        with self.assertRaises(TypeError) as caught:
            self.flow.estimate(self.image, argument)
        for text in ("second: found", *expected):
            self.assertIn(text, str(caught.exception))

    def test_another_type_is_a_type_error_with_what_was_found_and_expected(self):
        self.refused(self.image.astype(np.float64), "float64 (64, 80)", "expected uint8 (height, width)")
        self.refused(self.image.astype(">u2"), ">u2 (64, 80)")
        self.refused(self.image > 100, "bool (64, 80)")
        self.refused(self.image.tolist(), "found list, expected a numpy array of uint8")
        self.refused(None, "found NoneType")

    def test_another_shape_is_a_type_error(self):
        self.refused(np.zeros((64, 80, 3), np.uint8), "uint8 (64, 80, 3)")
        self.refused(np.zeros(64, np.uint8), "uint8 (64,)")
        self.refused(np.zeros((2, 64, 80, 1), np.uint8), "uint8 (2, 64, 80, 1)")

    def test_rows_that_are_not_contiguous_are_a_type_error(self):
        large = support.texture(128, 160)
        for view in (large[:64, ::2], large[:64, 79::-1], support.texture(80, 64).T, np.broadcast_to(self.image[0], (64, 80))):
            self.assertEqual(view.shape, (64, 80))
            self.refused(view, "not contiguous", "numpy.ascontiguousarray")
        self.refused(large[63::-1, :80], "not contiguous", "strides (-160, 1)")

    def test_elements_that_are_not_aligned_are_a_type_error(self):
        records = np.zeros(120 * 161, np.uint8)  # rows of 40 floats and a byte
        view = np.lib.stride_tricks.as_strided(records.view(np.float32), (120, 40), (161, 4))
        with self.assertRaisesRegex(TypeError, "depth: found elements that are not aligned"):
            pade.DepthImage(view)
        pade.DepthImage(np.array(view))

    def test_a_crop_is_taken_as_it_is(self):
        large = support.texture(100, 200)
        a, b = large[10:74, 20:100], large[10:74, 22:102]
        from_crops = self.flow.estimate(a, b).vectors
        np.testing.assert_array_equal(from_crops, self.flow.estimate(a.copy(), b.copy()).vectors)

    def test_arrays_that_cannot_be_written_are_taken_and_not_written(self):
        self.image.setflags(write=False)
        before = self.image.copy()
        self.flow.estimate(self.image, self.image)
        np.testing.assert_array_equal(self.image, before)

    def test_images_of_different_sizes_are_an_error(self):
        with self.assertRaisesRegex(pade.Error, "second: found 79 x 64 pixels, expected the first image's 80 x 64"):
            self.flow.estimate(self.image, self.image[:, :79])

    def test_numbers_of_another_shape_are_a_type_error(self):
        mapper = pade.ObstacleMapper(support.camera())
        image = np.zeros((120, 160), np.uint8)
        with self.assertRaisesRegex(TypeError, r"T_world_camera: found shape \(3, 4\), expected \(4, 4\)"):
            mapper.add(image, 0, np.eye(4)[:3])
        with self.assertRaisesRegex(TypeError, r"motion_covariance: found shape \(6,\), expected \(6, 6\)"):
            mapper.add(image, 0, np.eye(4), np.zeros(6))
        with self.assertRaisesRegex(TypeError, "T_world_camera: found str, expected numbers"):
            mapper.add(image, 0, "eye")
        self.assertEqual(mapper.health["frames"], 0)


class ArraysOut(unittest.TestCase):
    def test_flow_outlives_its_owner_and_the_next_call(self):
        flow = pade.Flow("clg-fast-half")
        images = [image for image, _, _ in support.slide(3)]
        field = flow.estimate(images[0], images[1])
        vectors = field.vectors
        before = vectors.copy()
        flow.estimate(images[1], images[0])
        del flow, field
        gc.collect()
        np.testing.assert_array_equal(vectors, before)

    def test_arrays_of_one_field_are_one_memory(self):
        field = pade.FlowField(np.zeros((4, 5, 2), np.float32))
        field.vectors[1, 2] = 7
        self.assertEqual(field.vectors[1, 2, 0], 7)
        self.assertTrue(np.shares_memory(field.vectors, field.vectors))

    def test_an_update_stays_as_it_is_while_the_mapper_goes_on(self):
        mapper = pade.ObstacleMapper(support.camera())
        kept = []
        for image, time, pose in support.slide(5):
            update = mapper.add(image, time, pose)
            if update.mapped:
                arrays = (update.depth.depth, update.depth.variance, update.depth.state, update.depth.bound, update.flow.vectors)
                kept.append((arrays, [array.copy() for array in arrays]))
        del mapper, update
        gc.collect()
        self.assertEqual(len(kept), 4)
        for arrays, copies in kept:
            for array, copy in zip(arrays, copies):
                np.testing.assert_array_equal(array, copy)

    def test_the_mask_of_a_flight_is_read_only(self):
        mask = pade.Sequence(support.flight()).mask
        with self.assertRaises(ValueError):
            mask[0, 0] = 0

    def test_an_image_that_needs_no_undistortion_is_itself(self):
        undistort = pade.Undistorter(support.camera())
        image = np.zeros((120, 160), np.uint8)
        self.assertIs(undistort(image), image)
        self.assertIsNone(undistort.valid)


class Values(unittest.TestCase):
    def test_times_are_exact(self):
        time = pade.Time(1305031102175304123)
        self.assertEqual(time.nanoseconds, 1305031102175304123)
        self.assertEqual(str(time), "1305031102.175304123")
        self.assertEqual(time - pade.Time(1305031102175304000), 123e-9)
        self.assertLess(pade.Time.from_seconds(0.5), time)
        self.assertEqual(len({time, pade.Time(1305031102175304123)}), 1)

    def test_nanoseconds_where_seconds_are_expected_are_refused(self):
        with self.assertRaisesRegex(pade.Error, r"nanoseconds are pade.Time\(nanoseconds\)"):
            pade.Time.from_seconds(1305031102175304123)
        with self.assertRaisesRegex(pade.Error, "time: found nan"):
            pade.DepthImage(np.zeros((2, 2), np.float32), time=float("nan"))

    def test_poses(self):
        pose = pade.Pose.from_quaternion([1, 2, 3], [0, 0, np.sqrt(0.5), np.sqrt(0.5)])
        np.testing.assert_allclose(pose([1, 0, 0]), [1, 3, 3], atol=1e-12)
        np.testing.assert_allclose(pose.matrix @ pose.inverse().matrix, np.eye(4), atol=1e-12)
        np.testing.assert_allclose((pose @ pose).matrix, pose.matrix @ pose.matrix, atol=1e-12)
        np.testing.assert_allclose(pade.Pose(pose.matrix).quaternion, pose.quaternion, atol=1e-12)
        self.assertEqual(repr(eval(repr(pose))), repr(pose))

    def test_a_rounded_quaternion_is_a_rotation(self):
        rng = np.random.default_rng(3)
        for digits in (3, 4, 6, 16):
            for xyzw in rng.normal(size=(50, 4)):
                rounded = np.round(xyzw / np.linalg.norm(xyzw), digits)
                if abs(np.linalg.norm(rounded) - 1) > 1e-3:
                    continue
                turned = pade.Pose.from_quaternion([0, 0, 0], rounded)
                rotation = turned.matrix[:3, :3]
                np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-14)
                np.testing.assert_allclose(np.linalg.norm(turned([3, -4, 12])), 13, rtol=1e-14)
                np.testing.assert_allclose((turned @ turned.inverse()).matrix, np.eye(4), atol=1e-14)

    def test_a_matrix_that_is_no_rigid_motion_is_refused(self):
        for wrong in (2 * np.eye(4), np.diag([1, 1, -1, 1]), np.ones((4, 4))):
            with self.assertRaisesRegex(pade.Error, "matrix: found a matrix that is no rigid motion"):
                pade.Pose(wrong)
        with self.assertRaisesRegex(pade.Error, "quaternion: found a norm of 2"):
            pade.Pose.from_quaternion([0, 0, 0], [0, 0, 0, 2])


class CameraModel(unittest.TestCase):
    lens = pade.Camera(160, 120, 100, 110, 80, 60, "plumb_bob", [-0.2, 0.05, 0.001, -0.002])

    def test_projection_is_that_of_the_formula(self):
        x, y = 0.3, -0.2
        r2 = x * x + y * y
        radial = 1 - 0.2 * r2 + 0.05 * r2 * r2
        u = x * radial + 2 * 0.001 * x * y - 0.002 * (r2 + 2 * x * x)
        v = y * radial + 0.001 * (r2 + 2 * y * y) - 2 * 0.002 * x * y
        np.testing.assert_allclose(self.lens.project([[0.6, -0.4, 2]]), [[100 * u + 80, 110 * v + 60]], atol=1e-9)

    def test_unproject_is_the_inverse_and_nan_is_not_seen(self):
        pixels = np.array([[[10.0, 20], [150, 100]], [[80, 60], [0, 0]]])
        np.testing.assert_allclose(self.lens.project(self.lens.unproject(pixels)), pixels, atol=1e-6)
        self.assertTrue(np.isnan(self.lens.project([0, 0, -1])).all())

    def test_undistortion_puts_a_pixel_where_the_pinhole_has_it(self):
        image = np.zeros((120, 160), np.uint8)
        target = self.lens.undistorted().project(self.lens.unproject([30, 40]))
        image[39:42, 29:32] = 255
        u, v = np.round(target).astype(int)
        self.assertGreater(pade.Undistorter(self.lens)(image)[v, u], 200)

    def test_a_camera_of_a_file(self):
        file = support.scratch() / "camera.yaml"
        file.write_text("width: 160\nheight: 120\nfx: 100\nfy: 110\ncx: 80\ncy: 60\n"
                        "distortion_model: plumb_bob\ndistortion: [-0.2, 0.05, 0.001, -0.002]\n")
        self.assertEqual(pade.Camera.read(file), self.lens)
        with self.assertRaisesRegex(pade.Error, "nowhere.yaml"):
            pade.Camera.read("nowhere.yaml")

    def test_what_makes_no_camera_is_refused(self):
        for arguments, text in (
            ((0, 120, 1, 1, 0, 0), "0 x 120 pixels"),
            ((160, 120, -1, 1, 0, 0), "fx -1"),
            ((160, 120, 1, 1, 0, 0, "fish"), "distortion: found 'fish', expected one of none, "),
            ((160, 120, 1, 1, 0, 0, "equidistant", [1, 2]), "coefficients: found 2 numbers"),
        ):
            with self.assertRaisesRegex(pade.Error, text):
                pade.Camera(*arguments)
        with self.assertRaisesRegex(pade.Error, "image: found 150 x 120 pixels, expected the camera's 160 x 120"):
            pade.Undistorter(self.lens)(np.zeros((120, 150), np.uint8))


if __name__ == "__main__":
    unittest.main()

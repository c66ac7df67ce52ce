// Time, poses and motions, and the enumerations that stand in arrays.
#include <array>
#include <cmath>
#include <string>

#include <fmt/format.h>
#include <pybind11/operators.h>

#include "pade/core/depth_image.hpp"
#include "pade/mapping/occupancy_map.hpp"

#include "convert.hpp"

namespace pade::python {
namespace {

void add_time(py::module_& module) {
  py::class_<Time>(
      module, "Time",
      "A moment, exact to a nanosecond, counted from the zero of the recording. Wherever a time is asked "
      "for, seconds as a number do as well.")
      .def(py::init([](std::int64_t nanoseconds) { return Time{nanoseconds}; }), py::arg("nanoseconds"))
      .def_static(
          "from_seconds", [](double seconds) { return time_of(py::float_(seconds), "seconds"); },
          py::arg("seconds"), "The nearest nanosecond.")
      .def_property_readonly(
          "nanoseconds", [](const Time& time) { return time.nanoseconds; }, "Since that zero.")
      .def_property_readonly(
          "seconds", [](const Time& time) { return time.seconds(); },
          "As a float, which at the size of Unix times keeps a quarter of a microsecond.")
      .def("__eq__",
           [](const Time& a, const py::object& b) { return py::isinstance<Time>(b) && a == b.cast<Time>(); })
      .def(
          "__lt__", [](const Time& a, const Time& b) { return a < b; }, py::is_operator())
      .def(
          "__le__", [](const Time& a, const Time& b) { return a <= b; }, py::is_operator())
      .def(
          "__gt__", [](const Time& a, const Time& b) { return a > b; }, py::is_operator())
      .def(
          "__ge__", [](const Time& a, const Time& b) { return a >= b; }, py::is_operator())
      .def(
          "__sub__", [](const Time& a, const Time& b) { return seconds_between(b, a); }, py::is_operator(),
          "Seconds between two times, exact to a nanosecond.")
      .def("__hash__", [](const Time& time) { return py::hash(py::int_(time.nanoseconds)); })
      .def("__str__", [](const Time& time) { return to_string(time); })
      .def("__repr__", [](const Time& time) { return fmt::format("pade.Time({})", time.nanoseconds); });
}

Pose pose_from_quaternion(py::handle translation, py::handle quaternion) {
  const Eigen::Vector4d xyzw = matrix_of<4, 1>(quaternion, "quaternion");
  if (!(std::abs(xyzw.norm() - 1) <= 1e-3)) {
    throw Refused(fmt::format("quaternion: found a norm of {}, expected 1 (to 1e-3)", xyzw.norm()));
  }
  // Rounded to a few digits it is no rotation yet: what it turns would grow or shrink.
  Eigen::Quaterniond rotation(xyzw[3], xyzw[0], xyzw[1], xyzw[2]);
  constexpr double kRounding = 1e-15;  // of doubles: kept as it is
  if (!(std::abs(rotation.norm() - 1) <= kRounding)) rotation.normalize();
  return {rotation, vector_of(translation, "translation")};
}

Eigen::Matrix4d matrix_of_pose(const Pose& pose) {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  matrix.topLeftCorner<3, 3>() = pose.matrix3();
  matrix.topRightCorner<3, 1>() = pose.translation;
  return matrix;
}

py::array_t<double> map_points(const Pose& pose, py::handle object) {
  const Points points = points_of(object, "points");
  std::vector<py::ssize_t> shape = points.shape;
  shape.push_back(3);
  py::array_t<double> array(shape);
  double* out = array.mutable_data();
  for (std::size_t i = 0; i < points.size; ++i) {
    const Eigen::Vector3d mapped = pose * points[i];
    for (int axis = 0; axis < 3; ++axis) *out++ = mapped[axis];
  }
  return array;
}

void add_pose(py::module_& module) {
  py::class_<Pose>(
      module, "Pose",
      "A rigid transform T_a_b, which maps points of frame b to frame a; metres. Wherever one is asked for, "
      "a 4 x 4 matrix does as well. As the pose of a camera it is T_world_camera: x right, y down, z "
      "forward.")
      .def(py::init([](const py::object& matrix) {
             return matrix.is_none() ? Pose() : pose_of(matrix, "matrix");
           }),
           py::arg("matrix") = py::none(), "Of a 4 x 4 matrix; without one, the identity.")
      .def_static("from_quaternion", &pose_from_quaternion, py::arg("translation"), py::arg("quaternion"),
                  "Of the origin of b in a (m), and x y z w of unit norm, as files have it.")
      .def_property_readonly(
          "matrix", [](const Pose& pose) { return array_of<4, 4>(matrix_of_pose(pose)); }, "(4, 4)")
      .def_property_readonly(
          "rotation", [](const Pose& pose) { return array_of<3, 3>(pose.matrix3()); }, "R_a_b, (3, 3)")
      .def_property_readonly(
          "translation", [](const Pose& pose) { return array_of<3, 1>(pose.translation); },
          "Origin of b in a, (3,), m.")
      .def_property_readonly(
          "quaternion", [](const Pose& pose) { return array_of<4, 1>(pose.rotation.coeffs()); },
          "x y z w, (4,)")
      .def("inverse", &Pose::inverse, "T_b_a.")
      .def(
          "__matmul__", [](const Pose& a, const Pose& b) { return a * b; }, py::is_operator(),
          "T_a_c = T_a_b @ T_b_c.")
      .def("__call__", &map_points, py::arg("points"), "Points (..., 3) of b in a.")
      .def("__repr__", [](const Pose& pose) {
        const Eigen::Vector3d& t = pose.translation;
        const Eigen::Quaterniond& q = pose.rotation;
        return fmt::format("pade.Pose.from_quaternion([{}, {}, {}], [{}, {}, {}, {}])", t.x(), t.y(), t.z(),
                           q.x(), q.y(), q.z(), q.w());
      });
}

RelativeMotion motion_of(py::handle T_world_reference, py::handle T_world_other, double duration,
                         py::handle covariance) {
  const Pose reference = pose_of(T_world_reference, "T_world_reference");
  const Pose other = pose_of(T_world_other, "T_world_other");
  if (!reference.is_finite() || !other.is_finite() || !std::isfinite(duration)) {
    throw Refused(
        "T_world_reference, T_world_other, duration: found NaN or infinity, expected finite numbers");
  }
  RelativeMotion motion = relative_motion(reference, other, duration);
  motion.covariance = covariance_of(covariance, "covariance");
  return motion;
}

void add_motion(py::module_& module) {
  py::class_<RelativeMotion>(
      module, "RelativeMotion",
      "Motion between two frames, seen from the reference, on whose pixels the depth lives.")
      .def(py::init(&motion_of), py::arg("T_world_reference"), py::arg("T_world_other"),
           py::arg("duration") = 0.0, py::arg("covariance") = py::none(),
           "Of two poses. duration: seconds from the reference to the other. covariance: (6, 6) of "
           "(translation, rotation "
           "vector) in the reference frame; None: exact.")
      .def_property_readonly(
          "rotation", [](const RelativeMotion& m) { return array_of<3, 3>(m.R_reference_other); },
          "R_reference_other, (3, 3).")
      .def_property_readonly(
          "translation", [](const RelativeMotion& m) { return array_of<3, 1>(m.t_reference_other); },
          "The other camera's place in the reference, (3,), m.")
      .def_property_readonly(
          "duration", [](const RelativeMotion& m) { return m.duration; },
          "Seconds from the reference to the other; negative if the other is older.")
      .def_property_readonly(
          "covariance", [](const RelativeMotion& m) { return array_of<6, 6>(m.covariance); },
          "(6, 6) of (translation, rotation vector), m and rad; zero: exact.")
      .def("__repr__", [](const RelativeMotion& m) {
        return fmt::format("<pade.RelativeMotion of {:.3g} m and {:.3g} rad in {:.3g} s>",
                           m.t_reference_other.norm(), m.rotation_vector().norm(), m.duration);
      });
}

/// An enum.IntEnum, whose members compare with the numbers in arrays.
template <std::size_t Size>
void add_enumeration(py::module_& module, const char* name, const std::array<std::string_view, Size>& names,
                     const char* help) {
  py::dict members;
  for (std::size_t value = 0; value < Size; ++value) {
    std::string member(names[value]);
    for (char& letter : member) letter = letter == ' ' ? '_' : letter;
    members[py::str(member)] = value;
  }
  const py::object type =
      py::module_::import("enum").attr("IntEnum")(name, members, py::arg("module") = "pade");
  type.attr("__doc__") = help;
  module.attr(name) = type;
}

}  // namespace

void add_values(py::module_& module) {
  add_time(module);
  add_pose(module);
  add_motion(module);
  add_enumeration(
      module, "DepthState", depth_state_names,
      "Why a pixel has a depth, or none: the numbers of DepthImage.state (docs/troubleshooting.md).");
  constexpr std::array<std::string_view, 3> occupancies = {"unknown", "free", "occupied"};
  static_assert(static_cast<int>(mapping::Occupancy::free) == 1 &&
                static_cast<int>(mapping::Occupancy::occupied) == 2);
  add_enumeration(module, "Occupancy", occupancies,
                  "State of a voxel: the numbers that at() gives. Unknown is not free.");
}

}  // namespace pade::python

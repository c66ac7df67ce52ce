// GPS/INS navigation: sensors in, poses with covariance out.
#include <array>
#include <cmath>
#include <mutex>
#include <string>

#include <fmt/format.h>

#include "pade/navigation/navigator.hpp"

#include "convert.hpp"

namespace pade::python {
namespace {

using navigation::AbsolutePose;
using navigation::Answer;
using navigation::RelativePose;

std::string name_of(Answer answer) {
  constexpr std::array<const char*, 4> names = {"valid", "not_initialised", "too_old", "too_new"};
  return names[static_cast<std::size_t>(answer)];
}

Eigen::Matrix3d noise_of(py::handle covariance) { return matrix_of<3, 3>(covariance, "covariance"); }

/// A navigator; calls from several threads wait for each other.
class Filter {
 public:
  Filter(const py::object& options, const std::string& imu) : navigator_(make(options, imu, options_)) {}

  template <class Measurement>
  void add(const Measurement& measurement) {
    without_gil(mutex_, [&] { navigator_.add(measurement); });
  }

  /// Samples of a whole log in one call.
  void add_imu(const py::object& time, const py::object& rate, const py::object& force) {
    if (!py::isinstance<py::array>(time)) {
      add(ImuSample{time_of(time, "time"), vector_of(rate, "angular_rate"),
                    vector_of(force, "specific_force")});
      return;
    }
    const Points rates = points_of(rate, "angular_rate");
    const Points forces = points_of(force, "specific_force");
    const auto seconds = numbers_of(time, "time", rates.shape);
    if (rates.shape.size() != 1 || forces.shape != rates.shape) {
      throw py::type_error(
          "specific_force: found another shape than that of angular_rate, expected both (n, 3)");
    }
    std::vector<Time> times(rates.size);
    for (std::size_t i = 0; i < rates.size; ++i) times[i] = time_of(py::float_(seconds.data()[i]), "time");
    without_gil(mutex_, [&] {
      for (std::size_t i = 0; i < rates.size; ++i) navigator_.add(ImuSample{times[i], rates[i], forces[i]});
    });
  }

  AbsolutePose absolute(const py::object& time) {
    const Time t = time_of(time, "time");
    return without_gil(mutex_, [&] { return navigator_.absolute_pose(t); });
  }
  RelativePose relative(const py::object& first, const py::object& second, const py::object& mounting) {
    const Time t1 = time_of(first, "t1");
    const Time t2 = time_of(second, "t2");
    if (t2 < t1)
      throw Refused(fmt::format("t2: found {}, expected t1, {}, or later", to_string(t2), to_string(t1)));
    const Pose T_body_camera = pose_of(mounting, "T_body_camera");
    if (!T_body_camera.is_finite())
      throw Refused("T_body_camera: found NaN or infinity, expected a finite pose");
    return without_gil(mutex_, [&] { return navigator_.relative_pose(t1, t2, T_body_camera); });
  }
  py::dict health() {
    const navigation::Health h = without_gil(mutex_, [&] { return navigator_.health(); });
    return py::dict(py::arg("status") = std::string(to_name(h.status)),
                    py::arg("seconds_since_velocity") = h.seconds_since_velocity,
                    py::arg("seconds_since_position") = h.seconds_since_position,
                    py::arg("yaw_sigma") = h.yaw_sigma, py::arg("imu_refused") = h.imu_refused,
                    py::arg("imu_gaps") = h.imu_gaps, py::arg("too_late") = h.too_late,
                    py::arg("too_new") = h.too_new, py::arg("duplicates") = h.duplicates,
                    py::arg("unusable") = h.unusable, py::arg("restarts") = h.restarts,
                    py::arg("restarts_when_lost") = h.restarts_when_lost,
                    py::arg("times_lost") = h.times_lost, py::arg("velocity_doubted") = h.velocity_doubted,
                    py::arg("magnetometer_doubted") = h.magnetometer_doubted);
  }
  [[nodiscard]] Time newest() {
    return without_gil(mutex_, [&] { return navigator_.newest(); });
  }
  [[nodiscard]] py::dict options() const { return dict_of(options_); }

 private:
  static navigation::Navigator make(const py::object& options, const std::string& imu,
                                    navigation::NavigatorOptions& used) {
    used.filter = navigation::FilterOptions::of(named<navigation::ImuClass>(imu, "imu"));
    used = options_of(options, used);
    return value_of(navigation::Navigator::create(used));
  }

  std::mutex mutex_;
  navigation::NavigatorOptions options_;
  navigation::Navigator navigator_;
};

Pose forward_camera(py::handle lever_arm) {
  return {Eigen::Quaterniond(forward_camera_rotation()),
          lever_arm.is_none() ? Eigen::Vector3d(Eigen::Vector3d::Zero()) : vector_of(lever_arm, "lever_arm")};
}

void add_answers(py::module_& module) {
  py::class_<AbsolutePose>(
      module, "AbsolutePose",
      "The state of the body at one time. All but answer has a meaning only if that is valid.")
      .def_property_readonly(
          "answer", [](const AbsolutePose& p) { return name_of(p.answer); },
          "valid, not_initialised, too_old (before the history) or too_new (after the newest IMU sample).")
      .def_property_readonly(
          "valid", [](const AbsolutePose& p) { return p.answer == Answer::valid; }, "answer is valid.")
      .def_readonly("T_world_body", &AbsolutePose::T_world_body, "Pose, ENU: jumps with corrections.")
      .def_readonly("T_smooth_body", &AbsolutePose::T_smooth_body,
                    "Pose without jumps; drifts towards the global one within seconds.")
      .def_property_readonly(
          "velocity", [](const AbsolutePose& p) { return array_of<3, 1>(p.velocity); }, "(3,), ENU, m/s.")
      .def_property_readonly(
          "covariance", [](const AbsolutePose& p) { return array_of<9, 9>(p.covariance); },
          "(9, 9) of (rotation, velocity, position), body axes, rad, m/s, m.")
      .def_property_readonly(
          "gyroscope_bias", [](const AbsolutePose& p) { return array_of<3, 1>(p.gyroscope_bias); },
          "(3,), rad/s.")
      .def_property_readonly(
          "accelerometer_bias", [](const AbsolutePose& p) { return array_of<3, 1>(p.accelerometer_bias); },
          "(3,), m/s^2.")
      .def("__repr__",
           [](const AbsolutePose& p) { return fmt::format("<pade.AbsolutePose: {}>", name_of(p.answer)); });

  py::class_<RelativePose>(module, "RelativePose",
                           "Motion of the camera between two times. All but answer and status has a meaning "
                           "only if answer is valid.")
      .def_property_readonly(
          "answer", [](const RelativePose& p) { return name_of(p.answer); }, "As that of AbsolutePose.")
      .def_property_readonly(
          "valid", [](const RelativePose& p) { return p.answer == Answer::valid; }, "answer is valid.")
      .def_readonly("motion", &RelativePose::motion,
                    "RelativeMotion with the camera at t1 as reference; its covariance is what "
                    "ObstacleMapper.add() takes.")
      .def_readonly("scale_valid", &RelativePose::scale_valid,
                    "The baseline is long enough, given its uncertainty, to fix the scale.")
      .def_readonly("direction_valid", &RelativePose::direction_valid, "So is that of its direction.")
      .def_property_readonly(
          "status", [](const RelativePose& p) { return std::string(to_name(p.status)); },
          "Of the filter at t2.")
      .def("__repr__",
           [](const RelativePose& p) { return fmt::format("<pade.RelativePose: {}>", name_of(p.answer)); });
}

}  // namespace

void add_navigation(py::module_& module) {
  add_answers(module);
  py::class_<Filter>(module, "Navigator",
                     "The GPS/INS filter (docs/navigation.md): sensors in, in any order, late or with gaps; "
                     "poses of the recent past out. Body "
                     "x forward, y left, z up; world east, north, up. Data that cannot be used is counted in "
                     "health(). Calls from several "
                     "threads wait for each other.")
      .def(py::init<const py::object&, const std::string&>(), py::arg("options") = py::none(),
           py::arg("imu") = "industrial",
           "options: dict, YAML text or pathlib.Path, the names below navigation of a --config file. imu: "
           "industrial or consumer, whose "
           "noise the options start from.")
      .def("add_imu", &Filter::add_imu, py::arg("time"), py::arg("angular_rate"), py::arg("specific_force"),
           "(3,) rad/s and (3,) m/s^2 (acceleration minus gravity), body axes; or arrays of a whole log: "
           "seconds (n,), (n, 3), (n, 3).")
      .def(
          "add_gnss_position",
          [](Filter& f, const py::object& time, const py::object& position, const py::object& covariance) {
            f.add(GnssFix{time_of(time, "time"), vector_of(position, "position"), noise_of(covariance)});
          },
          py::arg("time"), py::arg("position"), py::arg("covariance"),
          "Of the antenna, (3,) ENU, m; (3, 3), m^2.")
      .def(
          "add_gnss_velocity",
          [](Filter& f, const py::object& time, const py::object& velocity, const py::object& covariance) {
            f.add(GnssVelocity{time_of(time, "time"), vector_of(velocity, "velocity"), noise_of(covariance)});
          },
          py::arg("time"), py::arg("velocity"), py::arg("covariance"),
          "Of the antenna, (3,) ENU, m/s; (3, 3), (m/s)^2.")
      .def(
          "add_barometer",
          [](Filter& f, const py::object& time, double height, double sigma) {
            f.add(BarometricHeight{time_of(time, "time"), height, sigma});
          },
          py::arg("time"), py::arg("height"), py::arg("sigma") = BarometricHeight{}.sigma,
          "Height above an unknown zero, m.")
      .def(
          "add_magnetometer",
          [](Filter& f, const py::object& time, const py::object& field, double sigma) {
            f.add(MagneticField{time_of(time, "time"), vector_of(field, "field"), sigma});
          },
          py::arg("time"), py::arg("field"), py::arg("sigma") = MagneticField{}.sigma,
          "(3,), body axes, any unit; sigma per axis as a share of its norm.")
      .def(
          "add_heading",
          [](Filter& f, const py::object& time, double yaw, double sigma) {
            f.add(Heading{time_of(time, "time"), yaw, sigma});
          },
          py::arg("time"), py::arg("yaw"), py::arg("sigma") = Heading{}.sigma,
          "Yaw from east towards north, rad.")
      .def(
          "add_zero_velocity",
          [](Filter& f, const py::object& time, double sigma) {
            f.add(ZeroVelocity{time_of(time, "time"), sigma});
          },
          py::arg("time"), py::arg("sigma") = ZeroVelocity{}.sigma, "The vehicle stands still; sigma in m/s.")
      .def("absolute_pose", &Filter::absolute, py::arg("time"),
           "AbsolutePose at a time, with what was measured until then.")
      .def("relative_pose", &Filter::relative, py::arg("t1"), py::arg("t2"), py::arg("T_body_camera"),
           "RelativePose from t1 to t2, t2 >= t1. T_body_camera: how the camera is mounted "
           "(forward_camera()).")
      .def("health", &Filter::health, "Status and counts as of the newest data.")
      .def_property_readonly("newest", &Filter::newest, "Time of the newest IMU sample.")
      .def_property_readonly("options", &Filter::options, "All options, with their defaults.")
      .def("__repr__", [](Filter& f) {
        return fmt::format("<pade.Navigator: {}>", std::string(py::str(f.health()["status"])));
      });

  module.def(
      "forward_camera", &forward_camera, py::arg("lever_arm") = py::none(),
      "T_body_camera of a level camera that looks forward; lever_arm: its place on the body, (3,), m.");
}

}  // namespace pade::python

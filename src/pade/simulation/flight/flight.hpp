// A flight as a person writes it: FLIGHT.yaml with waypoints, limits, the camera and what the sensor adds to
// the light. docs/simulator.md explains every field.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "pade/core/camera.hpp"
#include "pade/core/pose.hpp"
#include "pade/core/result.hpp"
#include "pade/core/time.hpp"
#include "pade/simulation/flight/trajectory.hpp"
#include "pade/simulation/render/image_formation.hpp"

namespace pade::simulation {

/// Which errors the simulated instruments have.
enum class SensorGrade { perfect, industrial, consumer };

struct SensorOptions {
  bool enabled = true;  ///< write imu.csv, gnss.csv, baro.csv and mag.csv
  SensorGrade imu = SensorGrade::industrial;
  double imu_rate = 200;  ///< Hz
  double gnss_rate = 5;   ///< Hz
  /// s between the moment of measurement (the stamp) and its arrival: what has not arrived at the end of the
  /// flight is in no file. Files have no times of arrival.
  double gnss_latency = 0;
  bool gnss_carrier_phase = false;
  double baro_rate = 20;  ///< Hz
  double mag_rate = 20;   ///< Hz

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("enabled", self.enabled, "write the files of the inertial and aiding sensors");
    field("imu", self.imu, "grade of the inertial sensors");
    field("imu_rate", self.imu_rate, "Hz");
    field("gnss_rate", self.gnss_rate, "Hz");
    field("gnss_latency", self.gnss_latency,
          "s from measurement to arrival: what is later than the end is left out");
    field("gnss_carrier_phase", self.gnss_carrier_phase, "centimetres instead of metres");
    field("baro_rate", self.baro_rate, "Hz");
    field("mag_rate", self.mag_rate, "Hz");
  }
};

/// Refuses numbers that make no sense (core/option_check.hpp).
Status check(const SensorOptions& options);

/// Which fields of a flight's camera the flight gives itself. The others are those of the world's first
/// camera, where there is one: at the stated size, with the same field of view.
struct StatedCamera {
  bool width = true, height = true;
  bool fx = true, fy = true, cx = true, cy = true;
  bool lens = true;  ///< distortion model and coefficients
};

struct Flight {
  std::string name;
  std::vector<Waypoint> waypoints;
  TrajectoryOptions trajectory;
  double frame_rate = 10;  ///< Hz
  double first_frame =
      2;           ///< s after the start of the path: the estimators need flight before the first picture
  int frames = 0;  ///< 0 = as many as fit
  double exposure_time = 0;      ///< s; motion blur if it is not 0; poses are of mid exposure
  int blur_samples = 8;          ///< pictures that are averaged over the exposure
  std::optional<Camera> camera;  ///< without it the first camera of the world, else 640 x 480 with f = 554.26
  StatedCamera stated_camera;    ///< what of `camera` counts where the world has one too
  std::optional<Pose> T_body_camera;  ///< without it as in the world, else looking along body x
  std::optional<double> pitch_down;   ///< radians; turns the camera, where it is mounted, about body y
  ImageOptions image;
  bool states_colour = false;  ///< `image.colour`; else that of the world's camera counts, where it has one
  bool states_read_noise = false;  ///< the same of `image.read_noise`
  SensorOptions sensors;
};

/// Reads a flight file. Refuses unknown fields, wrong types and numbers out of range, naming file, line and
/// field.
Result<Flight> read_flight(const std::filesystem::path& file);
/// The same from text; `file` is the name in messages.
Result<Flight> parse_flight(std::string_view text, const std::string& file);

/// A camera at one moment of a flight.
struct CameraStation {
  Time time;
  Pose T_world_camera;
};
/// The stations of all frames. Refuses a path too short for them.
Result<std::vector<CameraStation>> camera_stations(const Flight& flight, const Trajectory& path,
                                                   const Pose& T_body_camera);

/// The camera pose at any moment of the path.
Pose camera_pose_at(const Trajectory& path, double time, const Pose& T_body_camera);

}  // namespace pade::simulation

template <>
struct pade::EnumNames<pade::simulation::SensorGrade> {
  using G = pade::simulation::SensorGrade;
  static constexpr std::array names = {std::pair{G::perfect, std::string_view("perfect")},
                                       std::pair{G::industrial, std::string_view("industrial")},
                                       std::pair{G::consumer, std::string_view("consumer")}};
};

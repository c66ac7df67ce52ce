// What is known about a camera and how it is mounted: our camera.yaml, and the calibration files of other
// tools (docs/sequences.md lists the fields).
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "pade/core/camera.hpp"
#include "pade/core/options.hpp"
#include "pade/core/pose.hpp"
#include "pade/core/result.hpp"
#include "pade/io/world.hpp"

namespace pade {
namespace io {

/// Whose pose the pose files of a sequence hold.
enum class PoseConvention {
  camera_to_world_optical,  ///< T_world_camera, camera x right, y down, z forward
  body_to_world,            ///< T_world_body; T_body_camera is applied
};

/// The content of a calibration file. Empty = the file does not say.
struct Calibration {
  std::string format;  ///< "camera.yaml", "Kalibr", "ROS camera_info", "OpenCV", "EuRoC", "ORB-SLAM" ...
  std::optional<Camera> camera;  ///< width = height = 0 where the file states no image size
  std::optional<Pose> T_body_camera;
  std::optional<double> time_offset_s;  ///< t_imu = t_image + offset
  std::optional<PoseConvention> pose_convention;
  std::optional<double> depth_scale;               ///< counts of the depth images per metre
  std::optional<std::array<double, 2>> intensity;  ///< raw values that become 0 and 255
  std::optional<Eigen::Vector3d> world_up;         ///< unit vector in the pose world
  std::optional<Eigen::Vector3d> gnss_lever_arm;   ///< antenna in the body frame, metres
  std::optional<GeographicOrigin> origin;
  std::vector<std::string> unknown_fields;  ///< present in the file, meaningless to us
};

/// What our camera.yaml calls a lens model.
std::string_view lens_name(Distortion model);

/// Reads a calibration and recognises its dialect by what it says (docs/formats.md): our camera.yaml, a
/// Kalibr camchain, ROS camera_info, OpenCV FileStorage (YAML or XML), EuRoC sensor.yaml, the settings of
/// ORB-SLAM and VINS, KITTI's calib.txt and calib_cam_to_cam.txt, COLMAP's cameras.txt. Every field that is
/// used is checked; the error names file, line, field, what was found and what was expected. Fields that look
/// like a lens, a camera model or a mounting and are not understood are refused, never left out. `camera`
/// chooses where a file holds several, from 0; a number that the file does not have is refused.
Result<Calibration> read_calibration(const std::filesystem::path& file, int camera = 0);
/// The same from text; `file` is the name in messages.
Result<Calibration> parse_calibration(std::string_view text, const std::string& file, int camera = 0);

}  // namespace io

template <>
struct EnumNames<io::PoseConvention> {
  static constexpr std::array names = {
      std::pair{io::PoseConvention::camera_to_world_optical, std::string_view("camera_to_world_optical")},
      std::pair{io::PoseConvention::body_to_world, std::string_view("body_to_world")}};
};

}  // namespace pade

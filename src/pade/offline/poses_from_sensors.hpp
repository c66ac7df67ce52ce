// The way from a sequence's imu.csv and gnss.csv to camera poses.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "pade/core/result.hpp"
#include "pade/depth/motion/motion_refinement.hpp"
#include "pade/io/sequence/sequence.hpp"
#include "pade/navigation/navigation_run.hpp"
#include "pade/offline/checked_log.hpp"

namespace pade {

/// What of a camera's calibration matters here.
struct CameraMounting {
  Pose T_body_camera;
  std::optional<double> time_offset;              ///< t_imu = t_image + offset, s; else what the options say
  std::optional<Eigen::Vector3d> gnss_lever_arm;  ///< body, m; else what the GNSS log says
};

/// Images whose motion the filter takes in.
struct FedImages {
  const io::Sequence& sequence;               ///< every image, whatever its pose; must outlive the use
  depth::MotionRefinementOptions refinement;  ///< how they are looked at
};

/// Runs the filter on imu.csv and gnss.csv (and baro.csv, mag.csv) of a sequence folder and chains its
/// motions (camera_trajectory()). Frames before the filter knows its yaw have no pose. With `images` and
/// FilterOptions::camera what they show of each motion goes into the filter behind it. Errors: a log that
/// cannot be read; no frame with a pose.
Result<CameraTrajectory> camera_trajectory_from_imu_gnss(const std::filesystem::path& folder,
                                                         const std::vector<Time>& frames,
                                                         const CameraMounting& mounting,
                                                         const navigation::NavigatorOptions& options = {},
                                                         const std::string& topics = {},
                                                         const FedImages* images = nullptr);

/// The same of a log that was read. @param name  of it, in messages
Result<CameraTrajectory> camera_trajectory_of(const CheckedLog& log, const std::string& name,
                                              const std::vector<Time>& frames, const CameraMounting& mounting,
                                              const navigation::NavigatorOptions& options = {},
                                              const FedImages* images = nullptr);

/// What a person should know of the trajectory: motions of doubtful length and direction, and frames left
/// out.
std::vector<std::string> notes_on(const CameraTrajectory& trajectory);

/// What `--poses from-imu-gnss` is called in options and runs.
inline constexpr const char* poses_from_sensors = "from-imu-gnss";

/// Where the sensors are, and how their clock relates to that of the images.
struct SensorSource {
  std::filesystem::path log;          ///< empty: beside the images
  std::string topics;                 ///< of a recording (io::NavigationLogOptions::topics)
  LogReader read;                     ///< empty: read_checked_log()
  std::optional<double> time_offset;  ///< t_imu = t_image + offset, s; empty: what the calibration says
  std::string found;                  ///< how the offset was found, one sentence; empty: it was given
};

/// Refuses a calibration without T_body_camera. @param folder  of the images, in the message
Status check_mounting(const std::filesystem::path& folder, const io::Calibration& calibration);

/// camera_trajectory_of() as a source of poses for io::Sequence, with a note on the clocks where there is
/// anything to say. Errors: those of the functions above; no GNSS data; a calibration without T_body_camera;
/// a log apart from the images without a stated offset, or that does not overlap with them.
/// @param images  null: none is fed back
io::PoseSource poses_from_imu_gnss(const navigation::NavigatorOptions& options,
                                   const SensorSource& source = {}, const FedImages* images = nullptr);

}  // namespace pade

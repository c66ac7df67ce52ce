// A recorded flight: images with their times and poses, whatever the layout of its folder. The layouts, the
// fields of camera.yaml, and what is refused and what is skipped, are in docs/sequences.md.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "pade/core/camera.hpp"
#include "pade/core/frame.hpp"
#include "pade/core/health.hpp"
#include "pade/core/result.hpp"
#include "pade/io/sequence/calibration.hpp"
#include "pade/io/sequence/image_store.hpp"
#include "pade/io/sequence/intensity.hpp"
#include "pade/io/sequence/trajectory.hpp"
#include "pade/io/skipped.hpp"
#include "pade/io/world.hpp"

namespace pade::io {

struct SequenceOptions {
  std::string poses = "groundtruth";
  std::string calibration;
  std::string world_up;
  std::string origin = "auto";
  std::string topics;
  int camera = 0;
  double largest_pose_gap = 0.5;
  double largest_truth_gap = 0.02;
  int mask_growth = 8;
  bool strict = false;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("poses", self.poses,
          "groundtruth, original (groundtruth_original.txt), from-imu-gnss or a pose file");
    field("calibration", self.calibration, "calibration file to use instead of the sequence's own");
    field("world_up", self.world_up,
          "direction of the pose world that points up: +x, -x, +y, -y, +z, -z or \"x y z\"");
    field("origin", self.origin,
          "point of the pose world that becomes 0 0 0 of the run: auto (a point near the flight if that is "
          "farther than 1 km from 0 0 0), flight (always a point near the flight), none, or \"x y z\"");
    field("topics", self.topics,
          "topics of a recording that are meant where several fit: names, separated by blanks");
    field("camera", self.camera, "which camera of a calibration file that holds several, from 0");
    field("largest_pose_gap", self.largest_pose_gap,
          "poses are interpolated between rows at most this far apart, s");
    field("largest_truth_gap", self.largest_truth_gap,
          "a depth image belongs to a frame at most this far away, s");
    field("mask_growth", self.mask_growth, "pixels that see nothing are grown by this radius, pixels");
    field("strict", self.strict, "refuse what would otherwise be skipped");
  }
};

/// Refuses what makes no sense (core/option_check.hpp).
Status check(const SequenceOptions& options);

/// Poses that are computed instead of read.
struct ComputedPoses {
  std::vector<StampedPose> poses;              ///< T_world_camera at the times of the images that have a pose
  std::vector<Matrix6d> covariances;           ///< Frame::motion_covariance of each
  std::size_t motions_without_scale = 0;       ///< too short for what is known of them
  std::optional<NavigationHealth> navigation;  ///< of the filter that they come from
  std::vector<std::string> notes;
};
/// Computes them from the times of the images, in order, and the calibration as stated.
using PoseSource = std::function<Result<ComputedPoses>(
    const std::filesystem::path& folder, const std::vector<Time>& images, const Calibration& calibration)>;

/// Frames with poses, calibrated camera, mask and (where recorded) true depth. Immutable once open: every
/// member may be called from several threads.
class Sequence {
 public:
  /// Recognises the layout and reads everything but the pixels; the head and tail of every image file are
  /// checked, and a few images are decoded for the mask and the intensity scaling. Refused: folder,
  /// calibration or poses that are unusable as a whole, fewer than 2 usable frames, more than half of the
  /// frames bad, and, with `strict`, anything skipped.
  /// @param source  if given, the poses come from it, and `options.poses` is but its name.
  static Result<Sequence> open(const std::filesystem::path& folder, const SequenceOptions& options = {},
                               const PoseSource& source = {});

  Sequence(Sequence&&) noexcept;
  Sequence& operator=(Sequence&&) noexcept;
  ~Sequence();

  /// Number of usable frames, in order of time. A frame that is only found to be corrupt when its pixels are
  /// decoded is still counted here: see frame() and check().
  [[nodiscard]] std::size_t size() const;
  [[nodiscard]] Time time(std::size_t i) const;
  /// Of a recording, a name for messages: the file, the topic and the time.
  [[nodiscard]] const std::filesystem::path& image_file(std::size_t i) const;
  /// Image i as it is kept, still with the lens's distortion. Error if it cannot be read.
  [[nodiscard]] Result<EncodedImage> encoded_image(std::size_t i) const;
  /// Pose of the camera of frame i: interpolated at image time + time_offset_s, T_body_camera applied,
  /// local_origin() subtracted.
  [[nodiscard]] const Pose& pose(std::size_t i) const;

  /// Frame i: 8 bit grey or BGR, undistorted. Error if the pixels cannot be decoded; the caller skips it,
  /// counts it, and asks check() whether to go on.
  [[nodiscard]] Result<Frame> frame(std::size_t i) const;

  [[nodiscard]] bool has_truth() const;  ///< any frame has a depth image, readable or not
  /// The depth image of frame i; empty where none is near in time.
  [[nodiscard]] const std::filesystem::path& depth_file(std::size_t i) const;
  /// True depth of frame i on the grid of the undistorted image: CV_32FC1, metres along the optical axis, NaN
  /// = none. Error if no depth image is near in time or it cannot be read.
  [[nodiscard]] Result<cv::Mat> truth(std::size_t i) const;

  /// Whether the run may count as good after `undecodable` errors of frame(): an error if then more than
  /// half of all frames are bad, fewer than 2 are left, or options().strict and there is any.
  [[nodiscard]] Status check(std::size_t undecodable) const;

  /// The ideal pinhole camera of the undistorted frames.
  [[nodiscard]] const Camera& camera() const;
  /// The camera as calibrated, with its distortion.
  [[nodiscard]] const Camera& raw_camera() const;
  /// CV_8UC1 on the grid of the undistorted image: 255 = valid. mask.png if there is one, else without the
  /// pixels that are 0 in every frame; without what lies outside the lens. Never empty.
  [[nodiscard]] const cv::Mat& mask() const;

  [[nodiscard]] const std::filesystem::path& folder() const;
  [[nodiscard]] const std::string& layout() const;  ///< "TUM RGB-D", "EuRoC", "KITTI odometry", "TartanAir",
                                                    ///< "ICL-NUIM", "rosbag 2.0", "MCAP" or "rosbag2"
  [[nodiscard]] const std::filesystem::path& pose_file() const;
  [[nodiscard]] const SequenceOptions& options() const;
  [[nodiscard]] const IntensityScaling& intensity() const;
  /// Where nothing is stated, the axis nearest to the mean of the cameras' up axes; empty if they have no
  /// common direction.
  [[nodiscard]] const std::optional<WorldUp>& world_up() const;
  [[nodiscard]] const std::optional<GeographicOrigin>& origin() const;
  /// The point of the pose world that is 0 0 0 of pose() and of everything made from it, metres: whole
  /// numbers chosen by SequenceOptions::origin, zero if nothing is shifted. What is made in single
  /// precision (clouds, the octree) would lose centimetres to decimetres in map coordinates such as UTM, or
  /// all.
  [[nodiscard]] const Eigen::Vector3d& local_origin() const;
  /// T_body_camera, time offset, GNSS lever arm and the like, as far as stated.
  [[nodiscard]] const Calibration& calibration() const;
  /// The pose file as read (of the body where calibration says so).
  [[nodiscard]] const Trajectory& trajectory() const;

  [[nodiscard]] bool poses_of_body() const;   ///< trajectory() is the body's
  [[nodiscard]] bool poses_computed() const;  ///< trajectory() is the camera's, at the times of the images
  [[nodiscard]] bool mask_is_stated() const;  ///< by a mask.png, or a recording of a live session
  /// Frame::motion_covariance of frame i.
  [[nodiscard]] const Matrix6d& motion_covariance(std::size_t i) const;
  /// Of a recording: how the camera sits on the IMU, if transforms tell it. The IMU need not be at the body
  /// of the poses.
  [[nodiscard]] const std::optional<Pose>& T_imu_camera() const;
  /// Topics of a recording that were read.
  [[nodiscard]] const std::vector<std::string>& sources() const;

  [[nodiscard]] std::size_t listed_frames() const;          ///< in the folder, usable or not
  [[nodiscard]] std::size_t frames_without_pose() const;    ///< skipped because no pose is near in time
  [[nodiscard]] std::size_t motions_without_scale() const;  ///< of computed poses (ComputedPoses)
  [[nodiscard]] const std::optional<NavigationHealth>& navigation() const;  ///< of computed poses
  [[nodiscard]] const std::vector<Skipped>& skipped() const;
  [[nodiscard]] const std::vector<std::string>& notes() const;  ///< used, but worth knowing

 private:
  struct Data;
  explicit Sequence(std::unique_ptr<Data> data);
  std::unique_ptr<Data> data_;
};

}  // namespace pade::io

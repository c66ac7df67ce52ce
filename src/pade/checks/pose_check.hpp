// Are these poses what they claim to be? Tries the usual mistakes of convention on the images themselves: by
// warping with true depth where there is some, else by the epipolar geometry and depth signs of sparse
// tracks.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <opencv2/core.hpp>

#include "pade/core/camera.hpp"
#include "pade/core/pose.hpp"

namespace pade::evaluation {

/// What the rows of a pose file may be, other than T_world_camera with x right, y down, z forward.
enum class PoseConvention {
  as_given,          ///< as it should be
  inverted,          ///< T_camera_world
  inverse_relative,  ///< the motion between frames is the inverse: rows and images run in opposite order
  gl_axes,           ///< camera axes x right, y up, z backward (OpenGL, Blender, NeRF)
  frd_axes,          ///< body axes x forward, y right, z down (AirSim, PX4)
  flu_axes,          ///< body axes x forward, y left, z up (ROS)
  scalar_first,      ///< quaternions w x y z in place of x y z w
  images_turned,     ///< the images stand on their head: a camera mounted upside down
  millimetres,       ///< positions a thousand times too large
  left_handed,       ///< camera and world have y up, as ICL-NUIM's
  row_before,        ///< the rows run one frame late: the row of an image is that of the frame before
  row_after,         ///< and one frame early
};
inline constexpr std::array pose_conventions = {
    PoseConvention::as_given,     PoseConvention::inverted,      PoseConvention::inverse_relative,
    PoseConvention::gl_axes,      PoseConvention::frd_axes,      PoseConvention::flu_axes,
    PoseConvention::scalar_first, PoseConvention::images_turned, PoseConvention::millimetres,
    PoseConvention::left_handed,  PoseConvention::row_before,    PoseConvention::row_after};
/// "as given", "inverted", ...
std::string_view name_of(PoseConvention convention);

/// Motion from frame a to frame b (p_b = T_b_a * p_a, optical axes) if the two rows are in `convention`; the
/// rows are those of the frames themselves also for row_before and row_after.
Pose relative_pose(PoseConvention convention, const Pose& row_a, const Pose& row_b);

/// Two images of a sequence with their rows of the pose file.
struct PoseCheckPair {
  cv::Mat first, second;  ///< CV_8UC1, undistorted
  Pose first_pose, second_pose;
  cv::Mat depth;  ///< of the first image, CV_32FC1 metres, NaN = none; empty = not known
  /// The rows of the frames next to the two, first and second; empty if there are none.
  std::optional<std::array<Pose, 2>> rows_before = {}, rows_after = {};
};

/// How well one convention explains the images, over all pairs.
struct ConventionScore {
  PoseConvention convention = PoseConvention::as_given;
  double error = 0;          ///< median over the pairs: grey levels, or pixels from the epipolar line
  double visible_error = 0;  ///< the same over what both images see
  double positive_depth =
      1;            ///< share of tracks in front of both cameras at 0.2-60 m; only without true depth
  double wins = 0;  ///< share of the pairs that it explains best
};

struct PoseCheck {
  enum class Verdict {
    good,     ///< the poses as given explain the images best
    wrong,    ///< `best` explains them clearly better
    unclear,  ///< too little motion, texture or agreement to tell
  };
  Verdict verdict = Verdict::unclear;
  PoseConvention best = PoseConvention::as_given;
  bool photometric = false;             ///< by warping with true depth (else by tracks)
  int pairs = 0;                        ///< that could be used
  double without_motion = 0;            ///< the error if the camera stood still
  std::vector<ConventionScore> scores;  ///< in the order of pose_conventions
  std::string sentence;                 ///< the verdict for people
};

/// Judges the poses of an undistorted camera. Pairs with depth are compared photometrically, the others by
/// tracks; if any pair has depth, only those count.
PoseCheck check_poses(std::span<const PoseCheckPair> pairs, const Camera& camera);

}  // namespace pade::evaluation

// True flow between two frames of a recording, from the true depth of the first and both poses.
#pragma once

#include <cstddef>
#include <vector>

#include <opencv2/core.hpp>

#include "pade/core/camera.hpp"
#include "pade/core/pose.hpp"
#include "pade/core/result.hpp"
#include "pade/io/sequence/sequence.hpp"

namespace pade::evaluation {

/// Flow of a static scene: the pixel in the second frame of the point that each pixel of the first one sees,
/// less the pixel itself.
/// @param depth  CV_32FC1, true depth of the first frame along its optical axis, metres; NaN = unknown.
/// @param camera undistorted pinhole of both frames, of the size of `depth`.
/// @return CV_32FC2, pixels; NaN where the depth is unknown or the point is outside the second image. Points
/// that are hidden in the second frame have a flow too.
cv::Mat flow_from_depth(const Camera& camera, const cv::Mat& depth, const Pose& T_world_first,
                        const Pose& T_world_second);

/// Two frames and the true flow between them.
struct RecordedPair {
  std::size_t frame = 0;  ///< index of the first one
  cv::Mat first, second;  ///< CV_8UC1
  cv::Mat truth;          ///< CV_32FC2, pixels, NaN = unknown; also outside the sequence's mask
};

/// Up to `count` pairs (i, i + step) spread evenly over a sequence with true depth. Frames whose pixels or
/// depth cannot be read, and pairs that see nothing in common, are passed over; an error if there is no
/// pair at all.
/// @param skipped  if given, gets what could not be read, with the reason
Result<std::vector<RecordedPair>> recorded_pairs(const io::Sequence& sequence, int step, int count,
                                                 std::vector<io::Skipped>* skipped = nullptr);

}  // namespace pade::evaluation

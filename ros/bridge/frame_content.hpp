// What is told of a frame.
#pragma once

#include <cstddef>
#include <vector>

#include <opencv2/core.hpp>
#include <pade/pade.hpp>

#include "bridge.hpp"
#include "node_options.hpp"

namespace pade_ros {

/// Where the camera was, at most a thousand poses: of more every second, fourth, ... is kept.
class CameraPath {
 public:
  void add(const PathPose& pose);
  void begin_anew() { *this = {}; }
  [[nodiscard]] const std::vector<PathPose>& poses() const { return poses_; }

 private:
  std::vector<PathPose> poses_;
  std::size_t step_ = 1, left_out_ = 0;
};

/// Depth, sigma and cloud of what was mapped: on the pixels of the camera and with the stamp of the frame
/// that the depth is of, whatever window and order the mapper has.
/// @param image   undistorted, as it was mapped at `time`
/// @param camera  undistorted
FrameResult frame_content(const pade::MapperUpdate& update, const pade::Camera& camera, const cv::Mat& image,
                          pade::Time time, const Wanted& wanted, const NodeOptions& options);

}  // namespace pade_ros

// How hard a scene is for optical flow and depth: how far things are, how much of the picture has no texture,
// and how much of it lies along the edges of things.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include <opencv2/core.hpp>

#include "pade/core/result.hpp"
#include "pade/io/sequence/sequence.hpp"

namespace pade::evaluation {

/// Counts over the pixels of some frames; sums of these are counts over all of them.
struct SceneHardness {
  static constexpr double low_gradient = 4;  ///< grey levels per pixel
  static constexpr int edge_reach = 3;       ///< pixels
  static constexpr double edge_step = 0.1;   ///< of the depth, from a pixel to the next, is an edge
  static constexpr std::array<double, 4> ends{4, 8, 12, 16};  ///< of the depth ranges, metres

  std::int64_t pixels = 0;  ///< looked at
  std::array<std::int64_t, 4>
      in_range{};                 ///< with true depth of at most `ends`, and more than the one before
  std::int64_t beyond = 0;        ///< true depth of more than that
  std::int64_t flat = 0;          ///< gradient below low_gradient
  std::int64_t near_edge = 0;     ///< within edge_reach of a depth edge
  std::optional<double> nearest;  ///< smallest true depth, metres

  [[nodiscard]] double share(std::int64_t count) const {
    return pixels > 0 ? static_cast<double>(count) / static_cast<double>(pixels) : 0;
  }
  SceneHardness& operator+=(const SceneHardness& other);
};

/// Of one frame. `image`: CV_8UC1 or CV_8UC3; `depth`: CV_32FC1, metres, NaN = none (sky, or not measured;
/// such a border is an edge only in exact truth, so it does not count as one). The gradient is Sobel's over 3
/// x 3 pixels.
SceneHardness scene_hardness(const cv::Mat& image, const cv::Mat& depth);

/// Of at most `frames` frames spread over a sequence with true depth; frames without depth are passed over.
/// An error if no frame has any.
Result<SceneHardness> scene_hardness(const io::Sequence& sequence, int frames = 26);

/// Shares in percent on one line, as `pade info` prints it.
std::string to_line(const SceneHardness& hardness);

}  // namespace pade::evaluation

#include "pade/depth/image/footing.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "pade/core/option_check.hpp"

namespace pade::depth {
namespace {

constexpr std::size_t kFirst = 12;  // pixels with texture that are asked
constexpr std::size_t kFewest = 6;  // that have to be there, and half of them to answer
constexpr std::size_t kSparse = 2;  // one of so many on the way down has texture, or it is specks of noise
constexpr double kSteepest = 0.5;   // least share of up that is upward in the image: 60 degrees
constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

/// The columns of an image, along the vertical through the camera.
class Columns {
 public:
  Columns(const DepthImage& image, const Camera& camera, const Eigen::Vector3d& up)
      : image_(image), camera_(camera), ahead_((Eigen::Vector3d::UnitZ() - up.z() * up).normalized()) {
    const double lean = -up.x() / up.y();  // to the right per row upward
    for (int v = 0; v <= image.bound.rows; ++v) {
      shifts_.push_back(static_cast<int>(std::lround(lean * (image.bound.rows - 1 - v))));
    }
    for (int u = 0; u < image.bound.cols; ++u) {
      ray_x_.push_back((cell_centre(u, image.window) - camera.cx) / camera.fx);
    }
  }

  /// Of the pixel below (u, v) in its column; outside of the image where there is none.
  [[nodiscard]] cv::Point below(int u, int v) const { return {u - shift(v) + shift(v + 1), v + 1}; }
  [[nodiscard]] bool holds(cv::Point p) const {
    return p.x >= 0 && p.x < image_.bound.cols && p.y < image_.bound.rows;
  }
  [[nodiscard]] bool is_blank(cv::Point p) const {
    return image_.state.at<std::uint8_t>(p) == static_cast<std::uint8_t>(DepthState::no_texture);
  }
  /// The ray of a pixel, z = 1.
  [[nodiscard]] Eigen::Vector3d ray(int u, int v) const {
    return {ray_x_[static_cast<std::size_t>(u)], (cell_centre(v, image_.window) - camera_.cy) / camera_.fy,
            1};
  }
  /// Metres ahead, level, per metre of depth: what is vertical is as far ahead all the way up. Not above
  /// zero: behind the camera.
  [[nodiscard]] float ahead(const Eigen::Vector3d& ray) const { return static_cast<float>(ray.dot(ahead_)); }
  /// The lower quartile of how far ahead the bounds of the first pixels with texture are, from `p` on
  /// downward; NaN where too few have one.
  [[nodiscard]] float footing(cv::Point p) const;

 private:
  /// Whole pixels, the same for all of a row: no column is lost.
  [[nodiscard]] int shift(int v) const { return shifts_[static_cast<std::size_t>(v)]; }

  const DepthImage& image_;
  const Camera& camera_;
  Eigen::Vector3d ahead_;      // level
  std::vector<int> shifts_;    // to the right, by rows and one more
  std::vector<double> ray_x_;  // by columns
};

float Columns::footing(cv::Point p) const {
  std::array<float, kFirst> bounds{};
  std::size_t answers = 0;
  std::size_t asked = 0;
  std::size_t passed = 0;
  for (; asked < bounds.size() && passed < kSparse * kFirst && holds(p); p = below(p.x, p.y)) {
    ++passed;
    if (is_blank(p)) continue;
    ++asked;
    const float bound = image_.bound.at<float>(p);
    const float at = bound * ahead(ray(p.x, p.y));
    if (at > 0) bounds[answers++] = at;
  }
  if (asked < kFewest || 2 * answers < asked || kSparse * asked < passed) return kNone;
  auto* const low = bounds.data() + answers / 4;  // edges and wrong matches make single bounds small
  std::nth_element(bounds.data(), low, bounds.data() + answers);
  return *low;
}

/// A patch without texture is one surface: what is not known of a column of it is no nearer than the known
/// ones to both sides, and beside the last of them as that one. A few columns do not speak for a whole image:
/// as many more as there are, to one side half of that.
void fill_gaps(const float* known, const std::uint8_t* state, int width, float* filled) {
  constexpr int kRim = 16;  // px that any known column may answer for
  const auto is_blank = [&](int u) { return state[u] == static_cast<std::uint8_t>(DepthState::no_texture); };
  std::copy(known, known + width, filled);
  int u = 0;
  while (u < width) {
    if (!is_blank(u)) {
      ++u;
      continue;
    }
    int end = u;
    for (; end < width && is_blank(end); ++end) continue;
    const auto columns =
        static_cast<int>(std::count_if(known + u, known + end, [](float at) { return at > 0; }));
    const int rim = std::max(kRim, columns / 2);
    int last = -1;  // known column of this run
    for (int i = u; i < end && columns > 0; ++i) {
      if (!(known[i] > 0)) continue;
      if (last < 0) {
        std::fill(filled + std::max(u, i - rim), filled + i, known[i]);
      } else if (i - last <= 2 * rim) {
        std::fill(filled + last + 1, filled + i, std::min(known[last], known[i]));
      }
      last = i;
    }
    if (last >= 0) std::fill(filled + last + 1, filled + std::min(end, last + 1 + rim), known[last]);
    u = end;
  }
}

}  // namespace

Status check(const FootingOptions& options) {
  const std::array<OptionRange, 1> ranges = {{{"headroom", options.headroom, 0, 1000}}};
  return check_ranges(ranges);
}

/// Row by row from below, so that a patch hands on what it stands on.
void bound_by_footing(DepthImage& image, const Camera& camera, const Eigen::Vector3d& up,
                      const FootingOptions& options) {
  if (!options.on || image.bound.empty() || -up.y() < kSteepest || std::abs(up.x()) > -up.y()) return;
  const Columns columns(image, camera, up);
  const int width = image.bound.cols;
  std::vector<float> footing;  // of the row below
  std::vector<float> found;
  std::vector<float> filled(static_cast<std::size_t>(width));
  for (int v = image.bound.rows - 1; v >= 0; --v) {
    std::swap(footing, found);
    found.assign(static_cast<std::size_t>(width), kNone);
    for (int u = 0; u < width; ++u) {
      const cv::Point below = columns.below(u, v);
      if (!columns.is_blank({u, v}) || !columns.holds(below)) continue;
      found[static_cast<std::size_t>(u)] =
          columns.is_blank(below) ? footing[static_cast<std::size_t>(below.x)] : columns.footing(below);
    }
    fill_gaps(found.data(), image.state.ptr<std::uint8_t>(v), width, filled.data());
    for (int u = 0; u < width; ++u) {
      const float at = filled[static_cast<std::size_t>(u)];
      if (!(at > 0)) continue;
      const Eigen::Vector3d ray = columns.ray(u, v);
      const float ahead = columns.ahead(ray);
      if (!(ahead > 0)) continue;
      const double climb = up.dot(ray);  // m of height per m of depth
      const double most = climb > 0 ? options.headroom / climb : std::numeric_limits<double>::infinity();
      auto& bound = image.bound.at<float>(v, u);
      const float free = std::min(at / ahead, static_cast<float>(most));
      if (!(bound >= free)) bound = free;
    }
  }
}

}  // namespace pade::depth

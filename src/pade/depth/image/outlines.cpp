#include "pade/depth/image/outlines.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <vector>

namespace pade::depth {
namespace {

constexpr int kLines = 4;       // along the row, the column and the diagonals
constexpr int kFewestRays = 5;  // of eight
constexpr float kUnknown = std::numeric_limits<float>::infinity();

/// What a ray meets first.
struct Met {
  float rho = -1;   ///< inverse of the bound there; infinity = unknown; negative = the border of the image
  float steps = 0;  ///< to there
  [[nodiscard]] bool border() const { return rho < 0; }
  [[nodiscard]] bool known() const { return rho >= 0 && rho < kUnknown; }
};
using Rays = std::array<Met, kLines>;

/// For the open pixels of a row, what half of their rays meet: back along the row, and to the row before it.
/// `before` and `here` have a pixel more at both ends.
void look_back(const float* bound, const std::uint8_t* open, int width, int step,
               const std::vector<Rays>& before, std::vector<Rays>& here) {
  Met along;
  const auto next = [](Met met) {
    met.steps += 1;
    return met;
  };
  for (int j = 0; j < width; ++j) {
    const int u = step > 0 ? j : width - 1 - j;
    const auto at = static_cast<std::size_t>(u) + 1;
    const std::size_t toward = step > 0 ? at - 1 : at + 1;
    const std::size_t away = step > 0 ? at + 1 : at - 1;
    Rays& rays = here[at];
    if (open[u] == 0) {
      rays.fill({bound[u] > 0 ? 1 / bound[u] : kUnknown, 0});
    } else {
      rays = {next(along), next(before[at][1]), next(before[toward][2]), next(before[away][3])};
    }
    along = rays[0];
  }
}

/// Inverse of the bound that a line gives to a pixel between its ends.
float between(const Met& a, const Met& b) {
  if (!a.known() || !b.known()) return kUnknown;
  return (a.rho * b.steps + b.rho * a.steps) / (a.steps + b.steps);
}

/// Inverse of a pixel's bound; infinity = none.
float inverse_bound(const Rays& a, const Rays& b) {
  std::array<float, kLines> lines{};
  float greatest = 0;
  int rays = 0;
  for (std::size_t i = 0; i < kLines; ++i) {
    lines[i] = between(a[i], b[i]);
    for (const Met& met : {a[i], b[i]}) {
      if (met.border()) continue;
      ++rays;
      greatest = std::max(greatest, met.rho);
    }
  }
  std::sort(lines.begin(), lines.end());
  if (lines[1] < kUnknown) return lines[1];
  return rays >= kFewestRays ? greatest : kUnknown;
}

}  // namespace

void bound_by_outlines(DepthImage& image) {
  if (image.bound.empty()) return;
  const cv::Mat open = image.state == static_cast<std::uint8_t>(DepthState::no_texture);
  const int width = open.cols;
  const int height = open.rows;
  const std::vector<Rays> outside(static_cast<std::size_t>(width) + 2);
  std::vector<std::vector<Rays>> above(static_cast<std::size_t>(height), outside);
  for (int v = 0; v < height; ++v) {
    const auto row = static_cast<std::size_t>(v);
    look_back(image.bound.ptr<float>(v), open.ptr<std::uint8_t>(v), width, 1,
              v > 0 ? above[row - 1] : outside, above[row]);
  }
  std::vector<Rays> below = outside;
  std::vector<Rays> here = outside;
  for (int v = height - 1; v >= 0; --v) {
    auto* bound = image.bound.ptr<float>(v);
    const auto* is_open = open.ptr<std::uint8_t>(v);
    look_back(bound, is_open, width, -1, below, here);
    std::swap(below, here);
    for (int u = 0; u < width; ++u) {
      if (is_open[u] == 0) continue;
      const auto at = static_cast<std::size_t>(u) + 1;
      const float rho = inverse_bound(above[static_cast<std::size_t>(v)][at], below[at]);
      if (rho < kUnknown && !(bound[u] * rho >= 1)) bound[u] = 1 / rho;
    }
  }
}

}  // namespace pade::depth

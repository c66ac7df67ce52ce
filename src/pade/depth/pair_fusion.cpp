#include "pade/depth/pair_fusion.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace pade::depth {
namespace {

constexpr float kAgreementSigmas2 = 25;  // (5 sigma)^2 of the difference of inverse depths
constexpr float kAgreement = 0.1F;       // and of the depth itself: systematic errors are not in sigma

/// Row pointers of the planes of a depth image.
struct Row {
  Row(const DepthImage& image, int v)
      : depth(const_cast<cv::Mat&>(image.depth).ptr<float>(v)),
        variance(const_cast<cv::Mat&>(image.variance).ptr<float>(v)),
        own_variance(const_cast<cv::Mat&>(image.own_variance).ptr<float>(v)),
        bound(const_cast<cv::Mat&>(image.bound).ptr<float>(v)),
        state(const_cast<cv::Mat&>(image.state).ptr<std::uint8_t>(v)) {}
  float* depth;
  float* variance;
  float* own_variance;
  float* bound;
  std::uint8_t* state;
};

bool agree(float z1, float variance1, float z2, float variance2) {
  const float difference = std::abs(1 / z1 - 1 / z2);
  const float z1_4 = z1 * z1 * z1 * z1;
  const float z2_4 = z2 * z2 * z2 * z2;
  return difference * difference <= kAgreementSigmas2 * (variance1 / z1_4 + variance2 / z2_4) ||
         difference * std::min(z1, z2) <= kAgreement;
}

/// NaN where either says nothing.
float nearer(float a, float b) { return std::isnan(a) || std::isnan(b) ? a + b : std::min(a, b); }

}  // namespace

void fuse_pairs(const DepthImage& shorter, DepthImage& longer) {
  constexpr auto kMeasured = static_cast<std::uint8_t>(DepthState::measured);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (int v = 0; v < longer.depth.rows; ++v) {
    const Row s(shorter, v);
    const Row l(longer, v);
    for (int u = 0; u < longer.depth.cols; ++u) {
      const bool has_short = s.state[u] == kMeasured;
      const bool has_long = l.state[u] == kMeasured;
      if (has_short && has_long) {
        if (agree(s.depth[u], s.own_variance[u], l.depth[u], l.own_variance[u])) continue;
        l.state[u] = static_cast<std::uint8_t>(DepthState::inconsistent);
        l.depth[u] = l.variance[u] = l.own_variance[u] = nan;
        l.bound[u] = nearer(s.bound[u], l.bound[u]);
      } else if (has_short) {
        l.state[u] = s.state[u];
        l.depth[u] = s.depth[u];
        l.variance[u] = s.variance[u];
        l.own_variance[u] = s.own_variance[u];
        l.bound[u] = s.bound[u];
      } else if (has_long) {
        // What the shorter baseline contradicts, or could not see, started from a guess.
        const bool contradicted = s.state[u] == static_cast<std::uint8_t>(DepthState::inconsistent) ||
                                  s.state[u] == static_cast<std::uint8_t>(DepthState::out_of_view) ||
                                  l.depth[u] < s.bound[u];
        if (!contradicted) continue;
        l.state[u] = static_cast<std::uint8_t>(DepthState::inconsistent);
        l.depth[u] = l.variance[u] = l.own_variance[u] = nan;
        l.bound[u] = nearer(s.bound[u], l.bound[u]);
      } else if (std::isnan(l.bound[u]) || s.bound[u] > l.bound[u]) {
        l.state[u] = s.state[u];
        l.bound[u] = s.bound[u];
      }
    }
  }
}

}  // namespace pade::depth

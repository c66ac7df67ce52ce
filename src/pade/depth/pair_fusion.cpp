#include "pade/depth/pair_fusion.hpp"

#include <limits>

namespace pade::depth {
namespace {

constexpr float kAgreementSigmas2 = 25;  // (5 sigma)^2 of the difference of inverse depths
constexpr float kAgreement = 0.1F;       // share of the farther depth: systematic errors are not in sigma

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

/// Whether two depths agree. False where either is NaN. Multiplied out: a division costs more than the rest.
bool agree(float z1, float variance1, float z2, float variance2) {
  const float product = z1 * z2;
  const float difference = (z1 - z2) * (z1 - z2);
  const float square1 = z1 * z1;
  const float square2 = z2 * z2;
  const float sigmas = kAgreementSigmas2 * (variance1 * square2 * square2 + variance2 * square1 * square1);
  const float largest = square1 > square2 ? square1 : square2;
  return (difference * product * product <= sigmas) | (difference <= kAgreement * kAgreement * largest);
}

}  // namespace

void fuse_pairs(const DepthImage& shorter, DepthImage& longer) {
  constexpr auto kMeasured = static_cast<std::uint8_t>(DepthState::measured);
  constexpr auto kInconsistent = static_cast<std::uint8_t>(DepthState::inconsistent);
  constexpr auto kOutOfView = static_cast<std::uint8_t>(DepthState::out_of_view);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (int v = 0; v < longer.depth.rows; ++v) {
    const Row s(shorter, v);
    const Row l(longer, v);
    for (int u = 0; u < longer.depth.cols; ++u) {
      const float s_bound = s.bound[u];
      const float l_bound = l.bound[u];
      const bool has_short = s.state[u] == kMeasured;
      const bool has_long = l.state[u] == kMeasured;
      // What the shorter baseline contradicts, or could not see, started from a guess.
      const bool contradicted =
          (s.state[u] == kInconsistent) | (s.state[u] == kOutOfView) | (l.depth[u] < s_bound);
      const bool agreed = agree(s.depth[u], s.own_variance[u], l.depth[u], l.own_variance[u]);
      const bool keeps = has_long & (has_short ? agreed : !contradicted);
      const bool drops = has_long & !keeps;
      const bool takes = (!has_long) & (has_short | (l_bound != l_bound) | (s_bound > l_bound));
      const float nearer = s_bound < l_bound ? s_bound : (l_bound <= s_bound ? l_bound : nan);
      l.depth[u] = keeps ? l.depth[u] : (takes ? s.depth[u] : nan);
      l.variance[u] = keeps ? l.variance[u] : (takes ? s.variance[u] : nan);
      l.own_variance[u] = keeps ? l.own_variance[u] : (takes ? s.own_variance[u] : nan);
      l.bound[u] = takes ? s_bound : (drops ? nearer : l_bound);
      l.state[u] = takes ? s.state[u] : (drops ? kInconsistent : l.state[u]);
    }
  }
}

}  // namespace pade::depth

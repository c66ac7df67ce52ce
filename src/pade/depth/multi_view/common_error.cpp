#include "pade/depth/multi_view/common_error.hpp"

#include <algorithm>
#include <cstddef>

namespace pade::depth {

CommonError::CommonError(const Camera& camera, const std::vector<RelativeMotion>& views,
                         double largest_parallax)
    : fx_(static_cast<float>(camera.fx)),
      fy_(static_cast<float>(camera.fy)),
      cx_(static_cast<float>(camera.cx)),
      cy_(static_cast<float>(camera.cy)),
      largest_parallax2_(static_cast<float>(largest_parallax * largest_parallax)) {
  const auto known = [](const RelativeMotion& motion) { return !motion.covariance.isZero(0); };
  if (std::none_of(views.begin(), views.end(), known)) return;
  for (const RelativeMotion& motion : views) {
    View view{};
    for (int i = 0; i < 3; ++i)
      view.t.at(static_cast<std::size_t>(i)) = static_cast<float>(motion.t_reference_other[i]);
    std::size_t index = 0;
    for (int r = 0; r < 6; ++r) {
      for (int c = r; c < 6; ++c) {
        view.covariance.at(index++) = static_cast<float>((r == c ? 1 : 2) * motion.covariance(r, c));
      }
    }
    views_.push_back(view);
  }
  const auto longer = [](const View& a, const View& b) {
    const auto squared = [](const View& v) { return v.t[0] * v.t[0] + v.t[1] * v.t[1] + v.t[2] * v.t[2]; };
    return squared(a) > squared(b);
  };
  std::sort(views_.begin(), views_.end(), longer);
}

float CommonError::operator()(int u, int v, float rho) const {
  if (views_.empty()) return 0;
  const float x = static_cast<float>(u) - cx_;
  const float y = static_cast<float>(v) - cy_;
  const View* view = &views_.back();
  float ax = 0;
  float ay = 0;
  for (const View& candidate : views_) {
    ax = x * candidate.t[2] - fx_ * candidate.t[0];
    ay = y * candidate.t[2] - fy_ * candidate.t[1];
    view = &candidate;
    if ((ax * ax + ay * ay) * rho * rho <= largest_parallax2_) break;
  }
  const float bx = ax * fx_;
  const float by = ay * fy_;
  const float p = x / fx_;
  const float q = y / fy_;
  const std::array<float, 6> j = {rho * bx,
                                  rho * by,
                                  -rho * (ax * x + ay * y),
                                  bx * (-p * q) + by * (-1.0F - q * q),
                                  bx * (1.0F + p * p) + by * (p * q),
                                  bx * -q + by * p};
  float sum = 0;
  std::size_t index = 0;
  for (std::size_t r = 0; r < 6; ++r) {
    for (std::size_t c = r; c < 6; ++c) sum += view->covariance[index++] * j[r] * j[c];
  }
  const float aa = std::max(ax * ax + ay * ay, 1e-12F);
  return std::max(sum, 0.0F) / (aa * aa);
}

}  // namespace pade::depth

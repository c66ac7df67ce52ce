// Standard deviation of a flow vector, per component. With G = sum k g g^T the structure tensor over a window
// of effective size N, and s^2 the variance of the grey-value residual after warping over the same window
// (its mean is a change of exposure and says nothing), the least-squares covariance is
//   C = max(s, noise)^2 (N G)^-1,   sigma^2 = trace C / 2.
// Where a backward flow is known, the forward-backward error e = w(p) + w_back(p + w(p)) adds |e|^2 / 2: it
// finds what a residual cannot, occlusions and repeated patterns. Outside the second image sigma is infinite.
#include "pade/flow/kernels/confidence_kernels.hpp"

#include "pade/flow/kernels/lines.hpp"
#include "pade/flow/kernels/window.hpp"

namespace pade::flow::PADE_ISA {

long confidence_scratch(int radius, int width) {
  return window_scratch(5, radius, width) + Lines<5>::floats(width);
}

void flow_sigma(const ConfidenceInput& input, int first, int last, float* scratch) {
  const int width = input.first.width;
  const int height = input.first.height;
  const int n = padded(width);
  const auto right = static_cast<float>(width - 1);
  const auto bottom = static_cast<float>(height - 1);
  const int begin = first - input.radius < 0 ? 0 : first - input.radius;
  Lines<5> grey(input.first, scratch + window_scratch(5, input.radius, width), begin - 2);
  with_radius(input.radius, [&](auto radius) {
    windowed<5>(
        first, last, width, height, input.taps, radius, scratch,
        [&](int y, float* const* out) {
          grey.advance(y + 2);
          for (int x = 0; x < n; x += kLanes) {
            const V gx = along_x(grey[y] + x);
            const V gy = five_point(load(grey[y - 2] + x), load(grey[y - 1] + x), load(grey[y + 1] + x),
                                    load(grey[y + 2] + x));
            const V at_x = clamp(load(input.u.row(y) + x) + (ramp() + static_cast<float>(x)), 0, right);
            const V at_y = clamp(load(input.v.row(y) + x) + static_cast<float>(y), 0, bottom);
            const V residual =
                bilinear(input.second.data, input.second.stride, at_x, at_y) - load(grey[y] + x);
            store(out[0] + x, gx * gx);
            store(out[1] + x, gx * gy);
            store(out[2] + x, gy * gy);
            store(out[3] + x, residual);
            store(out[4] + x, residual * residual);
          }
        },
        [&](int y, float* const* line, const float* taps) {
          for (int x = 0; x < n; x += kLanes) {
            V sum[5];
            for (int c = 0; c < 5; ++c) sum[c] = convolve_horizontal(line[c] + x, taps, radius);
            const V variance = max(sum[4] - sum[3] * sum[3], set(input.noise * input.noise));
            // A flat window has no information: the determinant's floor makes its sigma large, not undefined.
            constexpr float kFlat = 1e-4F;
            const V determinant = max(sum[0] * sum[2] - sum[1] * sum[1], set(kFlat * kFlat));
            V squared = variance * (0.5F * (sum[0] + sum[2]) + kFlat) / (input.effective_size * determinant);
            const V u = load(input.u.row(y) + x);
            const V v = load(input.v.row(y) + x);
            const V to_x = u + (ramp() + static_cast<float>(x));
            const V to_y = v + static_cast<float>(y);
            const V at_x = clamp(to_x, 0, right);
            const V at_y = clamp(to_y, 0, bottom);
            if (input.backward_u.data != nullptr) {
              const V eu = u + bilinear(input.backward_u.data, input.backward_u.stride, at_x, at_y);
              const V ev = v + bilinear(input.backward_v.data, input.backward_v.stride, at_x, at_y);
              squared += 0.5F * (eu * eu + ev * ev);
            }
            const I seen = I(at_x == to_x) & I(at_y == to_y);
            store(input.sigma.row(y) + x, select(seen, sqrt(squared), set(__builtin_inff())));
          }
        });
  });
}

}  // namespace pade::flow::PADE_ISA

// Standard deviation of a flow vector, per component. With G = sum k g g^T the structure tensor over a window
// of effective size N, and s^2 the variance of the grey-value residual after warping over the same window
// (its mean is a change of exposure and says nothing), the least-squares covariance is
//   C = max(s, noise)^2 (N G)^-1,   sigma^2 = trace C / 2.
// Where a backward flow is known, the forward-backward error e = w(p) + w_back(p + w(p)) adds |e|^2 / 2: it
// finds what a residual cannot, occlusions and repeated patterns. Outside the second image sigma is infinite,
// and where the match is wrong: linear least squares knows nothing of that. There the gradients of the
// residual r are as strong as those of both images together: for images with gradients g and h, correlation
// c, and about the same energy, sum |grad r|^2 = sum |h - g|^2 = 2 (1 - c) sum |g|^2.
#include "pade/flow/kernels/confidence_kernels.hpp"

#include "pade/flow/kernels/lines.hpp"
#include "pade/flow/kernels/window.hpp"

namespace pade::flow::PADE_ISA {

namespace {
// Share of the gradients that the warp must not leave standing: kWrong for a long way, kSlack more for none.
// A wrong match is a likely one only where the search went far; and over a short way near gradients that the
// sampling does not hold (foliage against the sky) leave more than that behind.
constexpr float kWrong = 0.15F;
constexpr float kSlack = 2.0F;
constexpr float kNoiseGradients =
    2.0F;  // |grad r|^2 of central differences, per grey^2 of noise in each image
constexpr int kChannels = 6;
constexpr int kMatchedRows = 3;

long matched_line(int width) { return padded(width) + 2L * kRowMultiple; }

// What is left after the warp, row by row: second(p + w) - first(p).
class Residual {
 public:
  Residual(const ConfidenceInput& input, float* scratch, int first)
      : input_(input), memory_(scratch), done_(first < 0 ? 0 : first) {}
  static long floats(int width) { return kMatchedRows * matched_line(width); }

  // Makes rows up to `last` available. `grey` holds those of the first image.
  template <class Grey>
  void advance(int last, const Grey& grey) {
    const int width = input_.first.width;
    const auto right = static_cast<float>(width - 1);
    const auto bottom = static_cast<float>(input_.first.height - 1);
    for (; done_ <= last && done_ < input_.first.height; ++done_) {
      float* const line = slot(done_);
      for (int x = 0; x < padded(width); x += kLanes) {
        const V at_x = clamp(load(input_.u.row(done_) + x) + (ramp() + static_cast<float>(x)), 0, right);
        const V at_y = clamp(load(input_.v.row(done_) + x) + static_cast<float>(done_), 0, bottom);
        store(line + x,
              bilinear(input_.second.data, input_.second.stride, at_x, at_y) - load(grey[done_] + x));
      }
      repeat_edges(line, width, 1);
    }
  }
  const float* operator[](int y) const { return slot(clamp_index(y, input_.first.height)); }

 private:
  float* slot(int y) const {
    return memory_ + (y % kMatchedRows) * matched_line(input_.first.width) + kRowMultiple;
  }
  const ConfidenceInput& input_;
  float* memory_;
  int done_;
};

}  // namespace

long confidence_scratch(int radius, int width) {
  return window_scratch(kChannels, radius, width) + Lines<5>::floats(width) + Residual::floats(width);
}

void flow_sigma(const ConfidenceInput& input, int first, int last, float* scratch) {
  const int width = input.first.width;
  const int height = input.first.height;
  const int n = padded(width);
  const auto right = static_cast<float>(width - 1);
  const auto bottom = static_cast<float>(height - 1);
  const int begin = first - input.radius < 0 ? 0 : first - input.radius;
  float* const lines = scratch + window_scratch(kChannels, input.radius, width);
  Lines<5> grey(input.first, lines, begin - 2);
  Residual residual(input, lines + Lines<5>::floats(width), begin - 1);
  with_radius(input.radius, [&](auto radius) {
    windowed<kChannels>(
        first, last, width, height, input.taps, radius, scratch,
        [&](int y, float* const* out) {
          grey.advance(y + 2);
          residual.advance(y + 1, grey);
          for (int x = 0; x < n; x += kLanes) {
            const V gx = along_x(grey[y] + x);
            const V gy = five_point(load(grey[y - 2] + x), load(grey[y - 1] + x), load(grey[y + 1] + x),
                                    load(grey[y + 2] + x));
            const V r = load(residual[y] + x);
            const V rx = 0.5F * (load(residual[y] + x + 1) - load(residual[y] + x - 1));
            const V ry = 0.5F * (load(residual[y + 1] + x) - load(residual[y - 1] + x));
            store(out[0] + x, gx * gx);
            store(out[1] + x, gx * gy);
            store(out[2] + x, gy * gy);
            store(out[3] + x, r);
            store(out[4] + x, r * r);
            store(out[5] + x, rx * rx + ry * ry);
          }
        },
        [&](int y, float* const* line, const float* taps) {
          for (int x = 0; x < n; x += kLanes) {
            V sum[kChannels];
            for (int c = 0; c < kChannels; ++c) sum[c] = convolve_horizontal(line[c] + x, taps, radius);
            const V variance = max(sum[4] - sum[3] * sum[3], set(input.noise * input.noise));
            // A flat window has no information: the determinant's floor makes its sigma large, not undefined.
            constexpr float kFlat = 1e-4F;
            const V determinant = max(sum[0] * sum[2] - sum[1] * sum[1], set(kFlat * kFlat));
            V squared = variance * (0.5F * (sum[0] + sum[2]) + kFlat) / (input.effective_size * determinant);
            const V u = load(input.u.row(y) + x);
            const V v = load(input.v.row(y) + x);
            const V noise2 = set(kNoiseGradients * input.noise * input.noise);
            const V limit = set(kWrong) + set(kSlack) / (1.0F + sqrt(u * u + v * v));
            const I wrong = I(sum[5] - noise2 > limit * (2.0F * (sum[0] + sum[2]) + noise2));
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
            store(input.sigma.row(y) + x, select(seen & ~wrong, sqrt(squared), set(__builtin_inff())));
          }
        });
  });
}

}  // namespace pade::flow::PADE_ISA

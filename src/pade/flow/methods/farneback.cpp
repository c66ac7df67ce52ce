#include "pade/flow/methods/farneback.hpp"

#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "pade/flow/kernels/farneback_kernels.hpp"
#include "pade/flow/methods/pyramid_flow.hpp"

namespace pade::flow {
namespace {

// The filters for a Gaussian applicability. With normalised g and moments m2 = sum x^2 g, m4 = sum x^4 g, the
// normal matrix of {1, x, y, x^2, y^2, xy} is block diagonal: m2 for x and y, m2^2 for xy, and for {1, x^2,
// y^2}
//   [1 m2 m2; m2 m4 m2^2; m2 m2^2 m4],
// whose inverse gives axx = (sum x^2 g f - m2 sum g f) / (m4 - m2^2), ayy likewise.
struct Filters {
  std::vector<float> g, xg, xxg;
  ExpansionFilters view;

  Filters(double sigma, int radius) : g(gaussian_taps(sigma, radius)) {
    double m2 = 0;
    double m4 = 0;
    for (int i = 0; i <= radius; ++i) {
      const auto k = static_cast<double>(g[static_cast<std::size_t>(i)]);
      xg.push_back(static_cast<float>(i * k));
      xxg.push_back(static_cast<float>(i * i * k));
      m2 += 2 * i * i * k;
      m4 += 2 * std::pow(i, 4) * k;
    }
    view = {g.data(),
            xg.data(),
            xxg.data(),
            radius,
            static_cast<float>(1 / m2),
            static_cast<float>(-m2 / (m4 - m2 * m2)),
            static_cast<float>(1 / (m4 - m2 * m2)),
            static_cast<float>(1 / (m2 * m2))};
  }
};

struct Expansion {
  std::array<Plane, 5> planes;

  void resize(int width, int height) {
    for (Plane& plane : planes) plane.resize(width, height);
  }
  [[nodiscard]] ExpansionView view() const {
    return {planes[0].view(), planes[1].view(), planes[2].view(), planes[3].view(), planes[4].view()};
  }
};

class Farneback final : public PyramidFlow {
 public:
  Farneback(const FarnebackOptions& options, std::string name)
      : PyramidFlow(options.pyramid),
        options_(options),
        name_(std::move(name)),
        filters_(options.expansion_sigma, options.expansion_radius),
        taps_(gaussian_taps(options.sigma, options.radius)) {}

  [[nodiscard]] std::string_view name() const override { return name_; }

 protected:
  [[nodiscard]] long scratch_floats(int width) const override {
    return PADE_DISPATCH(farneback_scratch, isa())(options_.radius, width);
  }

  void prepare(int slot) override {
    std::vector<Expansion>& expansions = expansions_[static_cast<std::size_t>(slot)];
    expansions.resize(static_cast<std::size_t>(level_count()));
    for (int index = finest_level(); index < level_count(); ++index) {
      const PlaneView& level = image(slot, index);
      Expansion& expansion = expansions[static_cast<std::size_t>(index)];
      expansion.resize(level.width, level.height);
      over_rows(level, [&](int begin, int end, float* scratch) {
        PADE_DISPATCH(farneback_expand, isa())(level, expansion.view(), filters_.view, begin, end, scratch);
      });
    }
  }

  void refine(int index, int from, int to, FlowPlanes& flow) override {
    spare_.resize(flow.u.width(), flow.u.height());
    FarnebackLevel level;
    level.first = expansions_[static_cast<std::size_t>(from)][static_cast<std::size_t>(index)].view();
    level.second = expansions_[static_cast<std::size_t>(to)][static_cast<std::size_t>(index)].view();
    level.mask = mask(index);
    level.taps = taps_.data();
    level.radius = options_.radius;
    level.damping = static_cast<float>(options_.damping);
    level.largest_step = static_cast<float>(options_.largest_step);
    const bool finest = index == finest_level();
    for (int i = 0; i < (finest ? options_.iterations : options_.coarse_iterations); ++i) {
      level.u = flow.u.view();
      level.v = flow.v.view();
      level.next_u = spare_.u.view();
      level.next_v = spare_.v.view();
      over_rows(flow.u.view(), [&](int begin, int end, float* scratch) {
        PADE_DISPATCH(farneback_iterate, isa())(level, begin, end, scratch);
      });
      std::swap(flow, spare_);
    }
    median(finest ? options_.median : options_.coarse_median, flow, spare_);
  }

 private:
  FarnebackOptions options_;
  std::string name_;
  Filters filters_;
  std::vector<float> taps_;
  std::array<std::vector<Expansion>, 2> expansions_;
  FlowPlanes spare_;
};

}  // namespace

FarnebackOptions farneback_half_options() {
  FarnebackOptions options;
  options.pyramid.half_resolution = true;
  return options;
}

std::unique_ptr<FlowEstimator> make_farneback(const FarnebackOptions& options, std::string name) {
  return std::make_unique<Farneback>(options, std::move(name));
}

}  // namespace pade::flow

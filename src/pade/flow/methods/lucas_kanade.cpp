#include "pade/flow/methods/lucas_kanade.hpp"

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "pade/flow/kernels/lucas_kanade_kernels.hpp"
#include "pade/flow/kernels/pyramid_kernels.hpp"
#include "pade/flow/methods/pyramid_flow.hpp"

namespace pade::flow {
namespace {

class LucasKanade final : public PyramidFlow {
 public:
  LucasKanade(const LucasKanadeOptions& options, std::string name)
      : PyramidFlow(options.pyramid),
        options_(options),
        name_(std::move(name)),
        taps_(gaussian_taps(options.sigma, options.radius)),
        mean_taps_(local_mean_taps(options.local_mean)) {}

  [[nodiscard]] std::string_view name() const override { return name_; }

 protected:
  [[nodiscard]] long scratch_floats(int width) const override {
    return PADE_DISPATCH(lucas_kanade_scratch, isa())(options_.radius, width);
  }

  void prepare(int slot) override {
    if (mean_taps_.empty()) return;
    std::vector<Plane>& filtered = filtered_[static_cast<std::size_t>(slot)];
    filtered.resize(static_cast<std::size_t>(level_count()));
    for (int index = finest_level(); index < level_count(); ++index) {
      const PlaneView& from = image(slot, index);
      Plane& to = filtered[static_cast<std::size_t>(index)];
      to.resize(from.width, from.height);
      over_rows(from, [&](int begin, int end, float* scratch) {
        PADE_DISPATCH(smooth, isa())
        (from, to.view(), mean_taps_.data(), static_cast<int>(mean_taps_.size()) - 1, begin, end, scratch);
        PADE_DISPATCH(subtract_from, isa())(from, to.view(), begin, end);
      });
    }
  }

  void refine(int index, int from, int to, FlowPlanes& flow) override {
    const PlaneView& first = relative(from, index);
    for (Plane* plane : {&gradient_x_, &gradient_y_, &inverse_xx_, &inverse_xy_, &inverse_yy_}) {
      plane->resize(first.width, first.height);
    }
    spare_.resize(first.width, first.height);
    LucasKanadeLevel level;
    level.first = first;
    level.second = relative(to, index);
    level.mask = mask(index);
    level.gradient_x = gradient_x_.view();
    level.gradient_y = gradient_y_.view();
    level.inverse_xx = inverse_xx_.view();
    level.inverse_xy = inverse_xy_.view();
    level.inverse_yy = inverse_yy_.view();
    level.taps = taps_.data();
    level.radius = options_.radius;
    level.damping = static_cast<float>(options_.damping);
    level.largest_step = static_cast<float>(options_.largest_step);
    over_rows(first, [&](int begin, int end, float* scratch) {
      PADE_DISPATCH(gradient, isa())(first, level.gradient_x, level.gradient_y, begin, end, scratch);
    });
    over_rows(first, [&](int begin, int end, float* scratch) {
      PADE_DISPATCH(lucas_kanade_prepare, isa())(level, begin, end, scratch);
    });
    const bool finest = index == finest_level();
    for (int i = 0; i < (finest ? options_.iterations : options_.coarse_iterations); ++i) {
      level.u = flow.u.view();
      level.v = flow.v.view();
      level.next_u = spare_.u.view();
      level.next_v = spare_.v.view();
      over_rows(first, [&](int begin, int end, float* scratch) {
        PADE_DISPATCH(lucas_kanade_iterate, isa())(level, begin, end, scratch);
      });
      std::swap(flow, spare_);
    }
    median(finest ? options_.median : options_.coarse_median, flow, spare_);
  }

 private:
  // The grey values less their local mean, or as they are where that is switched off.
  [[nodiscard]] const PlaneView& relative(int slot, int index) const {
    return mean_taps_.empty()
               ? image(slot, index)
               : filtered_[static_cast<std::size_t>(slot)][static_cast<std::size_t>(index)].view();
  }

  LucasKanadeOptions options_;
  std::string name_;
  std::vector<float> taps_;
  std::vector<float> mean_taps_;
  std::array<std::vector<Plane>, 2> filtered_;
  Plane gradient_x_, gradient_y_, inverse_xx_, inverse_xy_, inverse_yy_;
  FlowPlanes spare_;
};

}  // namespace

LucasKanadeOptions lucas_kanade_half_options() {
  LucasKanadeOptions options;
  options.pyramid.half_resolution = true;
  options.iterations = 4;
  return options;
}

std::unique_ptr<FlowEstimator> make_lucas_kanade(const LucasKanadeOptions& options, std::string name) {
  return std::make_unique<LucasKanade>(options, std::move(name));
}

}  // namespace pade::flow

#include "pade/flow/methods/clg.hpp"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "pade/flow/kernels/clg_kernels.hpp"
#include "pade/flow/methods/pyramid_flow.hpp"
#include "pade/flow/pyramid/split_plane.hpp"

namespace pade::flow {
namespace {

constexpr int kWarpsOfGivenFlow = 2;

// Everything that one pyramid level needs, kept between frames.
struct LevelMemory {
  Plane mean, difference;
  Plane j11, j12, j22, j13, j23, j33;
  FlowPlanes base;
  SplitPlane u, v, m11, m12, m22, b1, b2, right, below;

  void resize(int width, int height) {
    for (Plane* plane : {&mean, &difference, &j11, &j12, &j22, &j13, &j23, &j33})
      plane->resize(width, height);
    base.resize(width, height);
    for (SplitPlane* plane : {&u, &v, &m11, &m12, &m22, &b1, &b2, &right, &below})
      plane->resize(width, height);
  }
};

class Clg final : public PyramidFlow {
 public:
  Clg(const ClgOptions& options, std::string name)
      : PyramidFlow(options.pyramid),
        options_(options),
        name_(std::move(name)),
        taps_(gaussian_taps(std::max(options.rho, 0.01), options.radius)) {}

  [[nodiscard]] std::string_view name() const override { return name_; }

 protected:
  [[nodiscard]] long scratch_floats(int width) const override {
    return PADE_DISPATCH(clg_scratch, isa())(options_.radius, width);
  }

  void prepare(int /*slot*/) override { levels_.resize(static_cast<std::size_t>(level_count())); }

  void refine(int index, int from, int to, FlowPlanes& flow) override {
    LevelMemory& memory = levels_[static_cast<std::size_t>(index)];
    memory.resize(flow.u.width(), flow.u.height());
    const bool finest = index == finest_level();
    // A flow that was given and taken up on a fine level is near its end already.
    const int coarse_warps =
        started_fine() ? std::min(options_.coarse_warps, kWarpsOfGivenFlow) : options_.coarse_warps;
    const int warps = finest ? options_.warps : coarse_warps;
    for (int warp = 0; warp < warps; ++warp) {
      ClgLevel level = view(memory, image(from, index), image(to, index), flow);
      level.mask = mask(index);
      over_rows(flow.u.view(), [&](int first, int last, float*) {
        for (int y = first; y < last; ++y) {
          std::copy_n(level.u.row(y), level.u.stride, level.u0.row(y));
          std::copy_n(level.v.row(y), level.v.stride, level.v0.row(y));
        }
        PADE_DISPATCH(clg_warp, isa())(level, first, last);
        PADE_DISPATCH(clg_split, isa())(level.u, level.system.u, first, last);
        PADE_DISPATCH(clg_split, isa())(level.v, level.system.v, first, last);
      });
      over_rows(flow.u.view(), [&](int first, int last, float* scratch) {
        PADE_DISPATCH(clg_tensor, isa())(level, first, last, scratch);
      });
      for (int i = 0; i < options_.lagged; ++i) {
        over_rows(flow.u.view(), [&](int first, int last, float* scratch) {
          PADE_DISPATCH(clg_system, isa())(level, first, last, scratch);
        });
        relax(level.system, flow.u.view());
        over_rows(flow.u.view(), [&](int first, int last, float*) {
          PADE_DISPATCH(clg_join, isa())(level.system.u, level.u, first, last);
          PADE_DISPATCH(clg_join, isa())(level.system.v, level.v, first, last);
        });
      }
      median(finest ? options_.median : options_.coarse_median, flow, spare_);
    }
  }

 private:
  // Strips whose borders retreat by one row with every half-sweep do not touch each other's rows; what they
  // leave, a wedge around each border, comes after all of them.
  void relax(const ClgSystem& system, const PlaneView& plane) {
    const auto sweep = [&](const SweepRows& rows) {
      PADE_DISPATCH(clg_relax, isa())
      (system, options_.sweeps, static_cast<float>(options_.omega), rows);
    };
    const int smallest = 4 * options_.sweeps;
    over_rows(
        plane,
        [&](int first, int last, float*) {
          sweep({first, first > 0 ? 1 : 0, last, last < plane.height ? -1 : 0});
        },
        smallest);
    for (const int border : strip_borders(plane, smallest)) sweep({border, -1, border, 1});
  }

  [[nodiscard]] ClgLevel view(const LevelMemory& m, const PlaneView& first, const PlaneView& second,
                              const FlowPlanes& flow) const {
    ClgLevel level;
    level.first = first;
    level.second = second;
    level.mean = m.mean.view();
    level.difference = m.difference.view();
    level.u0 = m.base.u.view();
    level.v0 = m.base.v.view();
    level.u = flow.u.view();
    level.v = flow.v.view();
    level.j11 = m.j11.view();
    level.j12 = m.j12.view();
    level.j22 = m.j22.view();
    level.j13 = m.j13.view();
    level.j23 = m.j23.view();
    level.j33 = m.j33.view();
    level.system = {m.u.view(),  m.v.view(),  m.m11.view(),   m.m12.view(),  m.m22.view(),
                    m.b1.view(), m.b2.view(), m.right.view(), m.below.view()};
    level.taps = taps_.data();
    level.radius = options_.radius;
    level.alpha = static_cast<float>(options_.alpha);
    level.gamma = static_cast<float>(options_.gamma);
    level.data_epsilon2 = static_cast<float>(options_.data_epsilon * options_.data_epsilon);
    level.smooth_epsilon2 = static_cast<float>(options_.smooth_epsilon * options_.smooth_epsilon);
    level.normalisation = static_cast<float>(options_.normalisation * options_.normalisation);
    return level;
  }

  ClgOptions options_;
  std::string name_;
  std::vector<float> taps_;
  std::vector<LevelMemory> levels_;
  FlowPlanes spare_;
};

}  // namespace

ClgOptions clg_fast_options() { return {}; }

ClgOptions clg_half_options() {
  ClgOptions options;
  options.pyramid.half_resolution = true;
  options.warps = 4;
  return options;
}

ClgOptions clg_guide_options() {
  ClgOptions options = clg_half_options();
  options.warps = 2;
  return options;
}

ClgOptions clg_accurate_options() {
  ClgOptions options;
  options.warps = 4;
  options.coarse_warps = 12;
  options.smooth_epsilon = 0.01;
  return options;
}

ClgOptions clg_linear_options() {
  ClgOptions options;
  options.warps = 3;
  options.coarse_warps = 3;
  options.sweeps = 30;
  options.alpha = 100;
  options.gamma = 0;
  options.data_epsilon = 0;
  options.smooth_epsilon = 0;
  options.rho = 1.5;
  options.radius = 4;
  return options;
}

std::unique_ptr<FlowEstimator> make_clg(const ClgOptions& options, std::string name) {
  return std::make_unique<Clg>(options, std::move(name));
}

}  // namespace pade::flow

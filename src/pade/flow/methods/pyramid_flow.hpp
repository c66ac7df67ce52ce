// What Lucas-Kanade, Farneback and CLG share: pyramids, coarse to fine, streams, half resolution, threads.
#pragma once

#include <array>
#include <functional>
#include <vector>

#include "pade/core/compute/simd.hpp"
#include "pade/core/compute/worker_pool.hpp"
#include "pade/flow/flow_estimator.hpp"
#include "pade/flow/pyramid/pyramid.hpp"

namespace pade::flow {

/// A method that refines a flow on one pyramid level at a time.
class PyramidFlow : public FlowEstimator {
 public:
  using FlowEstimator::estimate;
  using FlowEstimator::next;
  FlowField estimate(const cv::Mat& first, const cv::Mat& second, const cv::Mat& initial) final;
  FlowField next(const cv::Mat& image, FlowReference reference, const cv::Mat& initial) final;
  void restart() final;
  void set_mask(const cv::Mat& mask) final;

 protected:
  static constexpr int kSmallestStrip = 16;
  explicit PyramidFlow(const FlowOptions& options);

  /// The image of a slot (0 or 1) has changed: compute what depends on it alone.
  virtual void prepare(int slot) = 0;
  /// Improves the flow from the image in slot `from` to that in slot `to` on one level.
  virtual void refine(int level, int from, int to, FlowPlanes& flow) = 0;
  /// Floats of scratch that each thread needs for images of this width.
  [[nodiscard]] virtual long scratch_floats(int width) const = 0;

  [[nodiscard]] const PlaneView& image(int slot, int level) const {
    return pyramids_[static_cast<std::size_t>(slot)].levels[static_cast<std::size_t>(level)].view();
  }
  /// 0 where a pixel of the first image has no weight; data null if all have.
  [[nodiscard]] PlaneView mask(int level) const;
  [[nodiscard]] int level_count() const { return count_; }
  [[nodiscard]] bool started_fine() const { return coarsest_ < count_ - 1; }
  [[nodiscard]] int finest_level() const { return options_.half_resolution && count_ > 1 ? 1 : 0; }
  [[nodiscard]] simd::InstructionSet isa() const { return isa_; }

  /// Runs work(first, last, scratch) over strips of rows that cover the plane, each of `smallest` rows at
  /// least.
  void over_rows(const PlaneView& plane, const std::function<void(int, int, float*)>& work,
                 int smallest = kSmallestStrip);
  /// The first rows of those strips but that of the first one.
  [[nodiscard]] std::vector<int> strip_borders(const PlaneView& plane, int smallest = kSmallestStrip) const;
  /// Median filter of both components; `size` 0, 3 or 5.
  void median(int size, FlowPlanes& flow, FlowPlanes& spare);

 private:
  void load(const cv::Mat& image, int slot);
  FlowField run(int from, int to, const cv::Mat& initial);
  void coarse_to_fine(int from, int to, const cv::Mat& initial);
  void start(int level, const cv::Mat& initial);
  void take_up(const FlowPlanes& given, int level, int from, int to);
  cv::Mat sigma(int from, int to);
  void build_mask();

  FlowOptions options_;
  simd::InstructionSet isa_ = simd::best();
  WorkerPool workers_;
  std::vector<AlignedFloats> scratch_;
  std::array<Pyramid, 2> pyramids_;
  int count_ = 1;
  int coarsest_ = 0;  // level on which the search begins
  int newest_ = 0;
  cv::Size stream_size_;
  int stream_type_ = -1;
  FlowPlanes flow_;
  FlowPlanes spare_;
  FlowPlanes backward_;
  std::vector<FlowPlanes> given_;  // that competes, per level
  cv::Mat mask_;
  std::vector<Plane> mask_levels_;
  bool masked_ = false;  // the mask fits the present images and direction
  Plane sigma_;
  std::vector<float> sigma_taps_;
};

}  // namespace pade::flow

// The interface of all optical-flow methods, and the factory that knows them by name.
#pragma once

#include <array>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "pade/core/flow_field.hpp"
#include "pade/core/options.hpp"
#include "pade/core/result.hpp"

namespace pade::flow {

/// Which of the two newest images of a stream carries the pixel grid of the flow.
enum class FlowReference {
  previous,  ///< previous(p) = newest(p + w)
  newest,    ///< newest(p) = previous(p + w): no latency
};

/// Where FlowField::sigma comes from.
enum class FlowConfidence {
  none,              ///< no sigma
  local,             ///< texture and residual after warping, per pixel
  forward_backward,  ///< and the error of the flow there and back, for twice the time
};

/// What a given initial flow is to the search.
enum class InitialFlow {
  replaces,  ///< what coarser levels would find: they are left out
  competes,  ///< pixel by pixel, there and on finer levels, with what was found: what matches better is kept
};

/// Options of all our own methods.
struct FlowOptions {
  int smallest_level = 8;  ///< shorter side of the coarsest pyramid level, pixels, at least
  bool half_resolution =
      false;  ///< stop at half the size and interpolate: about a quarter of the time, blunter edges
  FlowConfidence confidence =
      FlowConfidence::none;  ///< source of the standard deviations: none, local or forward_backward
  int initial_level =
      16;  ///< coarsest pyramid level at which a given initial flow is taken up, 0 = full size: a good one,
           ///< taken up on a fine level, finds thin things that move farther than they are wide
  InitialFlow initial = InitialFlow::replaces;  ///< replaces | competes: whether coarser levels are left out,
                                                ///< or what they find is compared with it
  int threads = 1;                              ///< threads for one pair; the result does not depend on it
};

/// Refuses numbers that make no sense (core/option_check.hpp).
Status check(const FlowOptions& options);

/// Dense optical flow between two images of one size. An object keeps buffers between calls: use one per
/// thread.
class FlowEstimator {
 public:
  FlowEstimator() = default;
  FlowEstimator(const FlowEstimator&) = delete;
  FlowEstimator& operator=(const FlowEstimator&) = delete;
  virtual ~FlowEstimator() = default;

  /// Flow w with first(p) = second(p + w).
  /// @param first, second  CV_8UC1, one size, any stride. Our own methods take CV_16UC1 as well.
  /// @param initial  CV_32FC2 of that size, pixels: where to start the search; empty = zero. NaN, and vectors
  /// that leave the image wherever they start, count as zero. Methods that cannot use it ignore it.
  /// @return vectors of the images' size; NaN where the method knows that it failed; sigma if it has one;
  /// an empty field if the images are empty, of another type, or differ in size.
  virtual FlowField estimate(const cv::Mat& first, const cv::Mat& second, const cv::Mat& initial) = 0;
  /// The same from nothing: `initial` is zero.
  FlowField estimate(const cv::Mat& first, const cv::Mat& second) {
    return estimate(first, second, cv::Mat());
  }

  /// Flow between the image of the previous call and this one. Our own methods keep what they computed from
  /// the previous image, so that a stream costs less than pairs.
  /// @return an empty field for the first image, and if the size differs from that of the previous image.
  virtual FlowField next(const cv::Mat& image, FlowReference reference, const cv::Mat& initial);
  /// The same from nothing: `initial` is zero.
  FlowField next(const cv::Mat& image, FlowReference reference = FlowReference::previous) {
    return next(image, reference, cv::Mat());
  }
  /// Forgets the previous image of a stream.
  virtual void restart();

  /// Leaves pixels of the first image out from now on: their data has no weight, and their flow is NaN.
  /// @param mask  CV_8UC1 of the images' size, 0 = leave out; empty = use all. A mask of another size than
  /// the images is not applied. OpenCV's methods ignore it.
  virtual void set_mask(const cv::Mat& mask);

  /// The name that make_flow_estimator() knows.
  [[nodiscard]] virtual std::string_view name() const = 0;

 private:
  cv::Mat previous_;
};

/// All names in the order of help texts, without aliases.
const std::vector<std::string>& flow_estimator_names();

/// A method by its name. The error lists the names that exist.
/// @param name     one of flow_estimator_names(); "dis" is "dis-medium".
/// @param options  for our own methods; OpenCV's ignore them.
Result<std::unique_ptr<FlowEstimator>> make_flow_estimator(std::string_view name,
                                                           const FlowOptions& options = {});

/// Flow of a part of the images: only `region` and `margin` pixels around it are computed with.
/// @return vectors (and sigma) of the images' size, NaN outside the region; empty if the images do not
/// fit.
FlowField estimate_region(FlowEstimator& method, const cv::Mat& first, const cv::Mat& second, cv::Rect region,
                          int margin = 32);

}  // namespace pade::flow

template <>
struct pade::EnumNames<pade::flow::InitialFlow> {
  static constexpr std::array names = {
      std::pair{pade::flow::InitialFlow::replaces, std::string_view("replaces")},
      std::pair{pade::flow::InitialFlow::competes, std::string_view("competes")},
  };
};
template <>
struct pade::EnumNames<pade::flow::FlowConfidence> {
  static constexpr std::array names = {
      std::pair{pade::flow::FlowConfidence::none, std::string_view("none")},
      std::pair{pade::flow::FlowConfidence::local, std::string_view("local")},
      std::pair{pade::flow::FlowConfidence::forward_backward, std::string_view("forward_backward")},
  };
};

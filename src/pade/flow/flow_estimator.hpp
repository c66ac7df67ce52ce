// The interface of all optical-flow methods, and the factory that knows them by name.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <opencv2/core.hpp>

#include "pade/core/flow_field.hpp"
#include "pade/core/result.hpp"

namespace pade::flow {

/// Dense optical flow between two images of one size. An object keeps buffers between calls: use one per
/// thread.
class FlowEstimator {
 public:
  FlowEstimator() = default;
  FlowEstimator(const FlowEstimator&) = delete;
  FlowEstimator& operator=(const FlowEstimator&) = delete;
  virtual ~FlowEstimator() = default;

  /// Flow w with first(p) = second(p + w).
  /// @param first, second  CV_8UC1, one size, any stride.
  /// @param initial        CV_32FC2 of that size, pixels: where to start the search; empty = zero. Methods
  /// that
  ///                       cannot use it ignore it.
  /// @return vectors of the images' size; NaN where the method knows that it failed; sigma where it has one.
  virtual FlowField estimate(const cv::Mat& first, const cv::Mat& second, const cv::Mat& initial) = 0;
  FlowField estimate(const cv::Mat& first, const cv::Mat& second) {
    return estimate(first, second, cv::Mat());
  }

  /// The name that make_flow_estimator() knows.
  [[nodiscard]] virtual std::string_view name() const = 0;
};

/// All names in the order of help texts, without aliases.
const std::vector<std::string>& flow_estimator_names();

/// A method by its name; "dis" is "dis-medium". The error lists the names that exist.
Result<std::unique_ptr<FlowEstimator>> make_flow_estimator(std::string_view name);

}  // namespace pade::flow

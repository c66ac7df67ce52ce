#include "pade/flow/flow_estimator.hpp"

#include <functional>
#include <utility>

#include "pade/flow/clg.hpp"
#include "pade/flow/farneback.hpp"
#include "pade/flow/lucas_kanade.hpp"
#include "pade/flow/opencv_estimators.hpp"

namespace pade::flow {
namespace {

using Factory = std::function<std::unique_ptr<FlowEstimator>()>;

const std::vector<std::pair<std::string, Factory>>& registry() {
  static const std::vector<std::pair<std::string, Factory>> methods = {
      {"lucas-kanade", [] { return make_lucas_kanade(); }},
      {"farneback", [] { return make_farneback(); }},
      {"clg-linear", [] { return make_clg(clg_linear_options(), "clg-linear"); }},
      {"clg-fast", [] { return make_clg(clg_fast_options(), "clg-fast"); }},
      {"clg-accurate", [] { return make_clg(clg_accurate_options(), "clg-accurate"); }},
      {"dis-ultrafast", [] { return make_opencv_dis(DisPreset::ultrafast); }},
      {"dis-fast", [] { return make_opencv_dis(DisPreset::fast); }},
      {"dis-medium", [] { return make_opencv_dis(DisPreset::medium); }},
      {"opencv-farneback", make_opencv_farneback},
      {"opencv-pyrlk", make_opencv_pyrlk},
  };
  return methods;
}

}  // namespace

FlowField FlowEstimator::next(const cv::Mat& image, FlowReference reference, const cv::Mat& initial) {
  const cv::Mat previous = previous_;
  previous_ = image.clone();
  if (previous.empty() || previous.size() != image.size() || previous.type() != image.type()) return {};
  return reference == FlowReference::previous ? estimate(previous, image, initial)
                                              : estimate(image, previous, initial);
}

void FlowEstimator::restart() { previous_.release(); }

const std::vector<std::string>& flow_estimator_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> list;
    for (const auto& [name, factory] : registry()) list.push_back(name);
    return list;
  }();
  return names;
}

Result<std::unique_ptr<FlowEstimator>> make_flow_estimator(std::string_view name) {
  if (name == "dis") name = "dis-medium";
  std::string known;
  for (const auto& [candidate, factory] : registry()) {
    if (candidate == name) return factory();
    known += (known.empty() ? "" : ", ") + candidate;
  }
  return Error{"unknown flow method '" + std::string(name) + "'; expected one of " + known};
}

}  // namespace pade::flow

#include "pade/flow/flow_estimator.hpp"

#include <functional>
#include <limits>
#include <utility>

#include "pade/core/option_check.hpp"
#include "pade/flow/methods/clg.hpp"
#include "pade/flow/methods/farneback.hpp"
#include "pade/flow/methods/lucas_kanade.hpp"
#include "pade/flow/methods/opencv_estimators.hpp"

namespace pade::flow {
namespace {

using Factory = std::function<std::unique_ptr<FlowEstimator>(const FlowOptions&)>;

// Sets the options of all methods in those of one, and the settings that suit half resolution.
template <class Options>
Options with(const FlowOptions& common, Options options) {
  const bool half = options.pyramid.half_resolution || common.half_resolution;
  options.pyramid = common;
  options.pyramid.half_resolution = half;
  return options;
}

const std::vector<std::pair<std::string, Factory>>& registry() {
  using O = FlowOptions;
  static const std::vector<std::pair<std::string, Factory>> methods = {
      {"lucas-kanade", [](const O& o) { return make_lucas_kanade(with(o, LucasKanadeOptions())); }},
      {"lucas-kanade-half",
       [](const O& o) {
         return make_lucas_kanade(with(o, lucas_kanade_half_options()), "lucas-kanade-half");
       }},
      {"farneback", [](const O& o) { return make_farneback(with(o, FarnebackOptions())); }},
      {"farneback-half",
       [](const O& o) { return make_farneback(with(o, farneback_half_options()), "farneback-half"); }},
      {"clg-linear", [](const O& o) { return make_clg(with(o, clg_linear_options()), "clg-linear"); }},
      {"clg-fast", [](const O& o) { return make_clg(with(o, clg_fast_options()), "clg-fast"); }},
      {"clg-fast-half", [](const O& o) { return make_clg(with(o, clg_half_options()), "clg-fast-half"); }},
      {"clg-accurate", [](const O& o) { return make_clg(with(o, clg_accurate_options()), "clg-accurate"); }},
      {"dis-ultrafast", [](const O&) { return make_opencv_dis(DisPreset::ultrafast); }},
      {"dis-fast", [](const O&) { return make_opencv_dis(DisPreset::fast); }},
      {"dis-medium", [](const O&) { return make_opencv_dis(DisPreset::medium); }},
      {"opencv-farneback", [](const O&) { return make_opencv_farneback(); }},
      {"opencv-pyrlk", [](const O&) { return make_opencv_pyrlk(); }},
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

void FlowEstimator::set_mask(const cv::Mat& /*mask*/) {}

FlowField estimate_region(FlowEstimator& method, const cv::Mat& first, const cv::Mat& second, cv::Rect region,
                          int margin) {
  const cv::Rect all({0, 0}, first.size());
  region &= all;
  if (first.size() != second.size() || region.empty()) return {};
  const cv::Rect around =
      cv::Rect(region.x - margin, region.y - margin, region.width + 2 * margin, region.height + 2 * margin) &
      all;
  const FlowField part = method.estimate(first(around), second(around));
  if (part.empty()) return {};
  const cv::Rect inside(region.tl() - around.tl(), region.size());
  const auto place = [&](const cv::Mat& values) {
    cv::Mat whole(first.size(), values.type(), cv::Scalar::all(std::numeric_limits<double>::quiet_NaN()));
    values(inside).copyTo(whole(region));
    return whole;
  };
  return {place(part.vectors), part.sigma.empty() ? cv::Mat() : place(part.sigma)};
}

const std::vector<std::string>& flow_estimator_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> list;
    for (const auto& [name, factory] : registry()) list.push_back(name);
    return list;
  }();
  return names;
}

Status check(const FlowOptions& o) {
  const OptionRange ranges[] = {
      {"smallest_level", static_cast<double>(o.smallest_level), 1, 65536},
      {"initial_level", static_cast<double>(o.initial_level), -1, 16},
      {"threads", static_cast<double>(o.threads), 1, 256},
  };
  return check_ranges(ranges);
}

Result<std::unique_ptr<FlowEstimator>> make_flow_estimator(std::string_view name,
                                                           const FlowOptions& options) {
  if (const Status status = check(options); !status) return status.error();
  if (name == "dis") name = "dis-medium";
  std::string known;
  for (const auto& [candidate, factory] : registry()) {
    if (candidate == name) return factory(options);
    known += (known.empty() ? "" : ", ") + candidate;
  }
  return Error{"unknown flow method '" + std::string(name) + "'; expected one of " + known};
}

}  // namespace pade::flow

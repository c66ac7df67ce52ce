#include "pade/flow/flow_estimator.hpp"

#include <functional>
#include <utility>

#include "pade/flow/opencv_estimators.hpp"

namespace pade::flow {
namespace {

using Factory = std::function<std::unique_ptr<FlowEstimator>()>;

const std::vector<std::pair<std::string, Factory>>& registry() {
  static const std::vector<std::pair<std::string, Factory>> methods = {
      {"dis-ultrafast", [] { return make_opencv_dis(DisPreset::ultrafast); }},
      {"dis-fast", [] { return make_opencv_dis(DisPreset::fast); }},
      {"dis-medium", [] { return make_opencv_dis(DisPreset::medium); }},
      {"opencv-farneback", make_opencv_farneback},
      {"opencv-pyrlk", make_opencv_pyrlk},
  };
  return methods;
}

}  // namespace

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

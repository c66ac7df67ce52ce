#include "pade/flow/methods/opencv_adapter.hpp"

#include <memory>
#include <utility>

namespace pade::flow {
namespace {

class Adapter final : public cv::DenseOpticalFlow {
 public:
  explicit Adapter(std::unique_ptr<FlowEstimator> method) : method_(std::move(method)) {}

  void calc(cv::InputArray first, cv::InputArray second, cv::InputOutputArray flow) override {
    CV_Assert(!first.empty() && first.sameSize(second) && first.type() == second.type());
    CV_Assert(first.type() == CV_8UC1 || first.type() == CV_16UC1);
    cv::Mat initial;
    if (flow.sameSize(first) && flow.type() == CV_32FC2) initial = flow.getMat();
    method_->estimate(first.getMat(), second.getMat(), initial).vectors.copyTo(flow);
  }
  void collectGarbage() override { method_->restart(); }

 private:
  std::unique_ptr<FlowEstimator> method_;
};

}  // namespace

cv::Ptr<cv::DenseOpticalFlow> create_dense_optical_flow(std::string_view name, const FlowOptions& options) {
  auto method = make_flow_estimator(name, options);
  if (!method) return {};
  return cv::Ptr<cv::DenseOpticalFlow>(new Adapter(std::move(method.value())));
}

}  // namespace pade::flow

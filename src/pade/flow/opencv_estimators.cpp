#include "pade/flow/opencv_estimators.hpp"

#include <limits>

#include <opencv2/video/tracking.hpp>

namespace pade::flow {
namespace {

class Farneback final : public FlowEstimator {
 public:
  FlowField estimate(const cv::Mat& first, const cv::Mat& second, const cv::Mat& initial) override {
    FlowField field;
    field.vectors = initial.clone();
    cv::calcOpticalFlowFarneback(first, second, field.vectors, 0.5, 5, 13, 10, 5, 1.1,
                                 initial.empty() ? 0 : cv::OPTFLOW_USE_INITIAL_FLOW);
    return field;
  }
  [[nodiscard]] std::string_view name() const override { return "opencv-farneback"; }
};

class Dis final : public FlowEstimator {
 public:
  explicit Dis(DisPreset preset)
      : preset_(preset), method_(cv::DISOpticalFlow::create(static_cast<int>(preset))) {}

  FlowField estimate(const cv::Mat& first, const cv::Mat& second, const cv::Mat& initial) override {
    FlowField field;
    field.vectors = initial.clone();
    method_->calc(first, second, field.vectors);
    return field;
  }
  [[nodiscard]] std::string_view name() const override {
    switch (preset_) {
      case DisPreset::ultrafast:
        return "dis-ultrafast";
      case DisPreset::fast:
        return "dis-fast";
      case DisPreset::medium:
        break;
    }
    return "dis-medium";
  }

 private:
  static_assert(static_cast<int>(DisPreset::ultrafast) == cv::DISOpticalFlow::PRESET_ULTRAFAST);
  static_assert(static_cast<int>(DisPreset::medium) == cv::DISOpticalFlow::PRESET_MEDIUM);
  DisPreset preset_;
  cv::Ptr<cv::DISOpticalFlow> method_;
};

class PyrLk final : public FlowEstimator {
 public:
  FlowField estimate(const cv::Mat& first, const cv::Mat& second, const cv::Mat& initial) override {
    std::vector<cv::Point2f> from;
    std::vector<cv::Point2f> to;
    from.reserve(first.total());
    for (int v = 0; v < first.rows; ++v) {
      for (int u = 0; u < first.cols; ++u) from.emplace_back(static_cast<float>(u), static_cast<float>(v));
    }
    if (!initial.empty()) {
      to.reserve(first.total());
      for (const cv::Point2f& p : from) {
        const auto& w = initial.at<cv::Vec2f>(static_cast<int>(p.y), static_cast<int>(p.x));
        to.emplace_back(p.x + w[0], p.y + w[1]);
      }
    }
    std::vector<std::uint8_t> found;
    cv::calcOpticalFlowPyrLK(first, second, from, to, found, cv::noArray(), {21, 21}, 3,
                             {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 30, 0.01},
                             initial.empty() ? 0 : cv::OPTFLOW_USE_INITIAL_FLOW);
    constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
    FlowField field;
    field.vectors.create(first.size(), CV_32FC2);
    for (std::size_t i = 0; i < from.size(); ++i) {
      const cv::Point2f w = to[i] - from[i];
      field.vectors.at<cv::Vec2f>(static_cast<int>(from[i].y), static_cast<int>(from[i].x)) =
          found[i] != 0 ? cv::Vec2f(w.x, w.y) : cv::Vec2f(kNone, kNone);
    }
    return field;
  }
  [[nodiscard]] std::string_view name() const override { return "opencv-pyrlk"; }
};

}  // namespace

std::unique_ptr<FlowEstimator> make_opencv_farneback() { return std::make_unique<Farneback>(); }
std::unique_ptr<FlowEstimator> make_opencv_dis(DisPreset preset) { return std::make_unique<Dis>(preset); }
std::unique_ptr<FlowEstimator> make_opencv_pyrlk() { return std::make_unique<PyrLk>(); }

}  // namespace pade::flow

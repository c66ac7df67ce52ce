#include "pade/flow/methods/opencv_estimators.hpp"

#include <cstdint>
#include <limits>
#include <vector>

#include <opencv2/video/tracking.hpp>

namespace pade::flow {
namespace {

// OpenCV raises exceptions for what it cannot do, such as DIS on very small images. Here images that do not
// fit give an empty field, and where the method fails no vector is known.
template <class Work>
FlowField guarded(const cv::Mat& first, const cv::Mat& second, const Work& work) {
  if (first.empty() || first.size() != second.size()) return {};
  if (first.type() != CV_8UC1 || second.type() != CV_8UC1) return {};
  FlowField field;
  try {
    field.vectors = work();
  } catch (const cv::Exception&) {
    field.vectors =
        cv::Mat(first.size(), CV_32FC2, cv::Scalar::all(std::numeric_limits<double>::quiet_NaN()));
  }
  return field;
}

// A guess of another size is ignored.
cv::Mat start_of(const cv::Mat& initial, const cv::Mat& first) {
  return initial.size() == first.size() && initial.type() == CV_32FC2 ? initial.clone() : cv::Mat();
}

// DIS takes no part of an image.
cv::Mat whole(const cv::Mat& image) { return image.isContinuous() ? image : image.clone(); }

class Farneback final : public FlowEstimator {
 public:
  FlowField estimate(const cv::Mat& first, const cv::Mat& second, const cv::Mat& initial) override {
    return guarded(first, second, [&] {
      cv::Mat vectors = start_of(initial, first);
      cv::calcOpticalFlowFarneback(first, second, vectors, 0.5, 5, 13, 10, 5, 1.1,
                                   vectors.empty() ? 0 : cv::OPTFLOW_USE_INITIAL_FLOW);
      return vectors;
    });
  }
  [[nodiscard]] std::string_view name() const override { return "opencv-farneback"; }
};

class Dis final : public FlowEstimator {
 public:
  explicit Dis(DisPreset preset)
      : preset_(preset), method_(cv::DISOpticalFlow::create(static_cast<int>(preset))) {}

  FlowField estimate(const cv::Mat& first, const cv::Mat& second, const cv::Mat& initial) override {
    return guarded(first, second, [&] {
      cv::Mat vectors = start_of(initial, first);
      method_->calc(whole(first), whole(second), vectors);
      return vectors;
    });
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
    return guarded(first, second, [&] { return track(first, second, start_of(initial, first)); });
  }
  [[nodiscard]] std::string_view name() const override { return "opencv-pyrlk"; }

 private:
  static cv::Mat track(const cv::Mat& first, const cv::Mat& second, const cv::Mat& initial) {
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
    cv::Mat vectors(first.size(), CV_32FC2);
    for (std::size_t i = 0; i < from.size(); ++i) {
      const cv::Point2f w = to[i] - from[i];
      vectors.at<cv::Vec2f>(static_cast<int>(from[i].y), static_cast<int>(from[i].x)) =
          found[i] != 0 ? cv::Vec2f(w.x, w.y) : cv::Vec2f(kNone, kNone);
    }
    return vectors;
  }
};

}  // namespace

std::unique_ptr<FlowEstimator> make_opencv_farneback() { return std::make_unique<Farneback>(); }
std::unique_ptr<FlowEstimator> make_opencv_dis(DisPreset preset) { return std::make_unique<Dis>(preset); }
std::unique_ptr<FlowEstimator> make_opencv_pyrlk() { return std::make_unique<PyrLk>(); }

}  // namespace pade::flow

// Optical flow alone: the image moves by 3.25 pixels to the right and 1.5 up, and the flow says so, with its
// standard deviation per pixel.
#include <cmath>
#include <cstdio>

#include <opencv2/imgproc.hpp>
#include <pade/flow/flow_estimator.hpp>

int main() {
  cv::Mat first(240, 320, CV_8U);  // blurred noise
  cv::randu(first, 0, 256);
  cv::GaussianBlur(first, first, {}, 2);
  cv::normalize(first, first, 0, 255, cv::NORM_MINMAX);
  const cv::Matx23d shift(1, 0, 3.25, 0, 1, -1.5);
  cv::Mat second;
  cv::warpAffine(first, second, shift, first.size(), cv::INTER_CUBIC, cv::BORDER_REFLECT);

  pade::flow::FlowOptions options;
  options.confidence = pade::flow::FlowConfidence::local;
  auto method = pade::flow::make_flow_estimator("clg-fast", options);
  if (!method) return std::fprintf(stderr, "%s\n", method.error().message.c_str()), 1;
  const pade::FlowField flow = (*method)->estimate(first, second);  // first(p) = second(p + flow(p))

  const auto w = flow.vectors.at<cv::Vec2f>(120, 160);
  const auto sigma = static_cast<double>(flow.sigma.at<float>(120, 160));
  std::printf("flow (%.2f, %.2f) px, standard deviation %.2f px\n", static_cast<double>(w[0]),
              static_cast<double>(w[1]), sigma);
  return std::hypot(w[0] - 3.25F, w[1] + 1.5F) < 0.1F && sigma < 0.5 ? 0 : 1;
}

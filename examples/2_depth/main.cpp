// Depth alone, from a flow of any origin and the motion between the two frames: the camera moved 10 cm to the
// right in front of a wall 5 m away.
#include <cmath>
#include <cstdio>

#include <pade/depth/depth_estimator.hpp>

int main() {
  const pade::Camera camera{.width = 320, .height = 240, .fx = 320, .fy = 320, .cx = 159.5, .cy = 119.5};
  pade::RelativeMotion motion;  // of the other camera, seen from the reference
  motion.t_reference_other = {0.1, 0, 0};
  motion.covariance.topLeftCorner<3, 3>().diagonal().setConstant(0.002 * 0.002);  // 2 mm per axis

  // What stands 5 m away moves by fx * 0.1 / 5 = 6.4 pixels to the left.
  pade::FlowField flow;
  flow.vectors = cv::Mat(camera.size(), CV_32FC2, cv::Scalar(-6.4, 0));
  flow.sigma = cv::Mat(camera.size(), CV_32F, cv::Scalar(0.1));

  pade::depth::DepthEstimator estimator(pade::depth::DepthOptions{});
  const pade::DepthImage image = estimator.estimate({.camera = camera, .motion = motion, .flow = flow});
  const auto depth = static_cast<double>(image.depth.at<float>(120, 160));
  const double sigma = std::sqrt(static_cast<double>(image.variance.at<float>(120, 160)));
  const auto state = image.state.at<unsigned char>(120, 160);
  std::printf("%s: %.2f m, standard deviation %.2f m\n", pade::depth_state_names[state].data(), depth, sigma);
  // 0.1 of 6.4 pixels and 2 mm of 10 cm: 2.5 % of 5 m.
  return std::abs(depth - 5) < 0.01 && sigma > 0.11 && sigma < 0.16 ? 0 : 1;
}

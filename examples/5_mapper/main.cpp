// A vehicle slides along a textured wall, 4 m away. PADE is told the images and where the camera was, and
// says how far the wall is.
#include <cmath>
#include <cstdio>

#include <opencv2/imgproc.hpp>
#include <pade/pade.hpp>

int main() {
  const pade::Camera camera{.width = 320, .height = 240, .fx = 320, .fy = 320, .cx = 159.5, .cy = 119.5};
  auto mapper = pade::ObstacleMapper::create(camera);
  if (!mapper) return std::fprintf(stderr, "%s\n", mapper.error().message.c_str()), 1;

  cv::Mat wall(240, 400, CV_8U);  // blurred noise
  cv::randu(wall, 0, 256);
  cv::GaussianBlur(wall, wall, {}, 2);
  cv::normalize(wall, wall, 0, 255, cv::NORM_MINMAX);

  float depth = 0;
  for (int k = 0; k < 5; ++k) {
    // Camera x is to the right: 5 cm move what is 4 m away by fx * 0.05 / 4 = 4 pixels to the left.
    pade::Pose T_world_camera;
    T_world_camera.translation.x() = 0.05 * k;
    const cv::Mat image = wall(cv::Rect(4 * k, 0, camera.width, camera.height));
    const auto& update = mapper->add(image, pade::Time::from_seconds(0.1 * k), T_world_camera);
    if (update.outcome != pade::MapperUpdate::Outcome::mapped) continue;
    depth = update.depth.depth.at<float>(120, 160);
    std::printf("t = %.1f s: the wall is %.2f m away\n", update.reference.time.seconds(), depth);
  }
  return std::abs(depth - 4) < 0.05 ? 0 : 1;
}

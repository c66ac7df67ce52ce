#include "pade/evaluation/flow_truth.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

namespace pade::evaluation {
namespace {

cv::Mat grey(const cv::Mat& image) {
  if (image.channels() == 1) return image;
  cv::Mat result;
  cv::cvtColor(image, result, cv::COLOR_BGR2GRAY);
  return result;
}

}  // namespace

cv::Mat flow_from_depth(const Camera& camera, const cv::Mat& depth, const Pose& T_world_first,
                        const Pose& T_world_second) {
  CV_Assert(depth.type() == CV_32FC1 && depth.size() == camera.size() && camera.is_pinhole());
  constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
  const Pose T_second_first = T_world_second.inverse() * T_world_first;
  const Eigen::Matrix3d R = T_second_first.matrix3();
  cv::Mat flow(depth.size(), CV_32FC2, cv::Scalar::all(kNone));
  for (int v = 0; v < depth.rows; ++v) {
    for (int u = 0; u < depth.cols; ++u) {
      const auto z = static_cast<double>(depth.at<float>(v, u));
      if (!(z > 0)) continue;
      const Eigen::Vector3d ray((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1);
      const auto pixel = camera.project(R * (z * ray) + T_second_first.translation);
      if (!pixel || pixel->x() < 0 || pixel->y() < 0 || pixel->x() > camera.width - 1 ||
          pixel->y() > camera.height - 1) {
        continue;
      }
      flow.at<cv::Vec2f>(v, u) = {static_cast<float>(pixel->x() - u), static_cast<float>(pixel->y() - v)};
    }
  }
  return flow;
}

Result<std::vector<RecordedPair>> recorded_pairs(const io::Sequence& sequence, int step, int count,
                                                 std::vector<io::Skipped>* skipped) {
  std::vector<io::Skipped> bad;
  const auto skip = [&](const std::filesystem::path& file, const Error& error) {
    if (!file.empty()) bad.push_back(io::skipped_in(sequence.folder(), file.string(), error.message));
  };
  const std::string name = sequence.folder().string();
  if (!sequence.has_truth()) return Error{fmt::format("{}: a sequence without true depth", name)};
  const auto stride = static_cast<std::size_t>(std::max(step, 1));
  const std::size_t possible = sequence.size() > stride ? sequence.size() - stride : 0;
  const std::size_t wanted = std::min(possible, static_cast<std::size_t>(std::max(count, 1)));
  std::vector<RecordedPair> pairs;
  for (std::size_t i = 0; i < wanted; ++i) {
    const std::size_t frame = i * possible / wanted;
    const Result<Frame> first = sequence.frame(frame);
    const Result<Frame> second = sequence.frame(frame + stride);
    const Result<cv::Mat> depth = sequence.truth(frame);
    if (!first) skip(sequence.image_file(frame), first.error());
    if (!second) skip(sequence.image_file(frame + stride), second.error());
    if (!depth) skip(sequence.depth_file(frame), depth.error());
    if (!first || !second || !depth) continue;
    cv::Mat truth =
        flow_from_depth(sequence.camera(), *depth, sequence.pose(frame), sequence.pose(frame + stride));
    truth.setTo(cv::Scalar::all(std::numeric_limits<double>::quiet_NaN()), sequence.mask() == 0);
    std::vector<cv::Mat> components;
    cv::split(truth, components);
    cv::Mat known;
    cv::compare(components[0], components[0], known, cv::CMP_EQ);
    if (cv::countNonZero(known) == 0) continue;
    pairs.push_back({frame, grey(first->image), grey(second->image), std::move(truth)});
  }
  if (pairs.empty()) {
    return Error{fmt::format("{}: no two frames {} apart with true depth of what both see{}", name, stride,
                             bad.empty() ? "" : fmt::format("; first: {}: {}", bad[0].file, bad[0].reason))};
  }
  if (skipped != nullptr) *skipped = std::move(bad);
  return pairs;
}

}  // namespace pade::evaluation

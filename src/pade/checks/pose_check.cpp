#include "pade/checks/pose_check.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "pade/core/compute/median.hpp"

namespace pade::evaluation {
namespace {

constexpr int kGridStep = 3;            // photometric comparison at every third pixel of every third row
constexpr double kLargestResidual = 8;  // pixels; farther from the epipolar line is just wrong
constexpr double kNearest = 0.2;        // metres, plausible depth of a track
constexpr double kFarthest = 60;
constexpr std::size_t kFewestTracks = 30;
constexpr double kClearlyBetter = 0.85;  // of the error of the poses as given

Pose rotated(const Pose& pose, const Eigen::Matrix3d& R_camera_optical) {
  return {pose.rotation * Eigen::Quaterniond(R_camera_optical), pose.translation};
}

Eigen::Matrix3d columns(const Eigen::Vector3d& x, const Eigen::Vector3d& y, const Eigen::Vector3d& z) {
  Eigen::Matrix3d matrix;
  matrix << x, y, z;
  return matrix;
}

// How one pair fits one motion.
struct Fit {
  double error = std::numeric_limits<double>::infinity();
  double visible_error = 0;  // of the pixels that are seen in both images
  double positive_depth = 0;
};

double bilinear(const cv::Mat& image, double x, double y) {
  const int u = static_cast<int>(x), v = static_cast<int>(y);
  const double du = x - u, dv = y - v;
  const auto* upper = image.ptr<std::uint8_t>(v) + u;
  const auto* lower = image.ptr<std::uint8_t>(v + 1) + u;
  return std::lerp(std::lerp(double(upper[0]), double(upper[1]), du),
                   std::lerp(double(lower[0]), double(lower[1]), du), dv);
}

// Mean absolute difference between the first image and the second as seen from the first. Where the motion
// leads out of the second image, unrelated pixels stand in, so that a wrong motion gains nothing by looking
// away.
Fit photometric_fit(const PoseCheckPair& pair, const Camera& camera, const Pose& T_second_first) {
  cv::Scalar mean, deviation;
  cv::meanStdDev(pair.first, mean, deviation);
  const double unrelated = 1.128 * deviation[0];  // mean |a - b| of two independent normal values
  const Eigen::Matrix3d R = T_second_first.matrix3();
  double sum = 0;
  std::size_t count = 0, visible = 0;
  for (int v = 0; v < pair.first.rows; v += kGridStep) {
    for (int u = 0; u < pair.first.cols; u += kGridStep) {
      const double z = pair.depth.at<float>(v, u);
      if (!(z > 0) || std::isinf(z)) continue;
      ++count;
      const Eigen::Vector3d ray((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1);
      const Eigen::Vector3d point = R * (z * ray) + T_second_first.translation;
      const double x = camera.fx * point.x() / point.z() + camera.cx;
      const double y = camera.fy * point.y() / point.z() + camera.cy;
      const bool inside = point.z() > 0 && x >= 0 && y >= 0 && x < camera.width - 1 && y < camera.height - 1;
      if (!inside) continue;
      ++visible;
      sum += std::abs(bilinear(pair.second, x, y) - pair.first.at<std::uint8_t>(v, u));
    }
  }
  if (visible == 0) return {count == 0 ? std::numeric_limits<double>::infinity() : unrelated, unrelated, 0};
  const double hidden = static_cast<double>(count - visible) * unrelated;
  return {(sum + hidden) / static_cast<double>(count), sum / static_cast<double>(visible), 1};
}

struct Track {
  Eigen::Vector3d first, second;  // viewing rays, z = 1
};

std::vector<Track> tracks_of(const PoseCheckPair& pair, const Camera& camera) {
  std::vector<cv::Point2f> corners, there, back;
  cv::goodFeaturesToTrack(pair.first, corners, 600, 0.005, 8);
  std::vector<Track> tracks;
  if (corners.empty()) return tracks;
  std::vector<std::uint8_t> found, found_back;
  cv::Mat residual;
  cv::calcOpticalFlowPyrLK(pair.first, pair.second, corners, there, found, residual, {21, 21}, 4);
  cv::calcOpticalFlowPyrLK(pair.second, pair.first, there, back, found_back, residual, {21, 21}, 4);
  const auto ray = [&camera](const cv::Point2f& p) {
    return Eigen::Vector3d((p.x - camera.cx) / camera.fx, (p.y - camera.cy) / camera.fy, 1);
  };
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const bool returns = found[i] != 0 && found_back[i] != 0 && cv::norm(back[i] - corners[i]) < 0.5;
    if (returns) tracks.push_back({ray(corners[i]), ray(there[i])});
  }
  return tracks;
}

// Distance of the second ray from the epipolar line of the first, pixels; and whether the two rays meet in
// front of both cameras. A track that does not counts as far off the line.
Fit epipolar_fit(const std::vector<Track>& tracks, const Camera& camera, const Pose& T_second_first) {
  if (tracks.size() < kFewestTracks) return {};
  const Eigen::Matrix3d R = T_second_first.matrix3();
  const Eigen::Vector3d& t = T_second_first.translation;
  std::vector<double> distances;
  std::size_t positive = 0;
  for (const Track& track : tracks) {
    const Eigen::Vector3d line = t.cross(R * track.first);
    const double distance =
        camera.fx * std::abs(line.dot(track.second)) / std::max(1e-12, line.head<2>().norm());
    // z1 R r1 + t = z2 r2 in the least-squares sense.
    Eigen::Matrix<double, 3, 2> rays;
    rays << R * track.first, -track.second;
    const Eigen::Matrix2d normal = rays.transpose() * rays;
    const Eigen::Vector2d depths = normal.determinant() > 1e-14
                                       ? Eigen::Vector2d(normal.inverse() * (rays.transpose() * -t))
                                       : Eigen::Vector2d(kFarthest, kFarthest);
    const bool plausible = depths.minCoeff() > kNearest && depths.maxCoeff() < kFarthest;
    positive += plausible ? 1 : 0;
    distances.push_back(plausible ? std::min(distance, kLargestResidual) : kLargestResidual);
  }
  double sum = 0;
  for (const double distance : distances) sum += distance;
  const auto count = static_cast<double>(tracks.size());
  return {sum / count, sum / count, static_cast<double>(positive) / count};
}

// How far the tracks moved beyond the rotation, in the same units: the error of a camera that stood still.
double parallax_of(const std::vector<Track>& tracks, const Camera& camera, const Pose& T_second_first) {
  if (tracks.empty()) return 0;
  const Eigen::Matrix3d R = T_second_first.matrix3();
  double sum = 0;
  for (const Track& track : tracks) {
    sum += std::min(kLargestResidual,
                    camera.fx * ((R * track.first).hnormalized() - track.second.head<2>()).norm());
  }
  return sum / static_cast<double>(tracks.size());
}

// The fits of all conventions to one pair, and of a camera at rest.
struct PairFits {
  std::array<Fit, pose_conventions.size()> fits;
  double without_motion = 0;
};

/// The motion that a convention makes of a pair; empty where it needs rows that there are not.
std::optional<Pose> motion_of(PoseConvention convention, const PoseCheckPair& pair) {
  const auto& rows = convention == PoseConvention::row_before ? pair.rows_before : pair.rows_after;
  if (convention == PoseConvention::row_before || convention == PoseConvention::row_after) {
    if (!rows) return std::nullopt;
    return relative_pose(PoseConvention::as_given, (*rows)[0], (*rows)[1]);
  }
  return relative_pose(convention, pair.first_pose, pair.second_pose);
}

std::optional<PairFits> fit_pair(const PoseCheckPair& pair, const Camera& camera) {
  PairFits result;
  const std::vector<Track> tracks = pair.depth.empty() ? tracks_of(pair, camera) : std::vector<Track>();
  for (std::size_t i = 0; i < pose_conventions.size(); ++i) {
    const auto motion = motion_of(pose_conventions[i], pair);
    if (!motion) continue;
    result.fits[i] =
        pair.depth.empty() ? epipolar_fit(tracks, camera, *motion) : photometric_fit(pair, camera, *motion);
  }
  result.without_motion =
      pair.depth.empty()
          ? parallax_of(tracks, camera,
                        relative_pose(PoseConvention::as_given, pair.first_pose, pair.second_pose))
          : photometric_fit(pair, camera, Pose{}).visible_error;
  if (!std::isfinite(result.fits[0].error)) return std::nullopt;
  return result;
}

std::string explain(PoseConvention convention) {
  switch (convention) {
    case PoseConvention::inverted:
      return "these poses look inverted: world to camera where camera to world is expected";
    case PoseConvention::inverse_relative:
      return "the motion between frames looks reversed: poses and images seem to run in opposite order";
    case PoseConvention::gl_axes:
      return "these poses look in another axis convention: camera axes x right, y up, z backward (OpenGL) "
             "where x "
             "right, y down, z forward is expected";
    case PoseConvention::frd_axes:
      return "these poses look in another axis convention: body axes x forward, y right, z down (FRD) where "
             "the "
             "camera's x right, y down, z forward is expected";
    case PoseConvention::flu_axes:
      return "these poses look in another axis convention: body axes x forward, y left, z up (FLU) where the "
             "camera's "
             "x right, y down, z forward is expected";
    case PoseConvention::scalar_first:
      return "the quaternions look as if written w x y z where x y z w is expected";
    case PoseConvention::images_turned:
      return "the images look turned by 180 degrees: the camera hangs upside down, and poses or images do "
             "not know it";
    case PoseConvention::millimetres:
      return "the positions look like millimetres where metres are expected";
    case PoseConvention::left_handed:
      return "camera and world look left-handed (x right, y up, z forward, as ICL-NUIM has them): the sign "
             "of y is to be "
             "turned in both";
    case PoseConvention::row_before:
      return "the poses look one frame late: each image fits the row of the frame before it";
    case PoseConvention::row_after:
      return "the poses look one frame early: each image fits the row of the frame after it";
    case PoseConvention::as_given:
      break;
  }
  return "the poses fit the images as given";
}

/// The convention with the least error. In steady flight neighbouring rows, and near rest every scale,
/// explain the images as well as the right ones: these count only where they are clearly better.
const ConventionScore& best_of(const std::vector<ConventionScore>& scores) {
  const auto needs_clarity = [](PoseConvention convention) {
    return convention == PoseConvention::row_before || convention == PoseConvention::row_after ||
           convention == PoseConvention::millimetres;
  };
  const ConventionScore* best = &scores.front();
  for (const ConventionScore& score : scores) {
    if (!needs_clarity(score.convention) && score.error < best->error) best = &score;
  }
  const double least = kClearlyBetter * best->error;
  for (const ConventionScore& score : scores) {
    if (needs_clarity(score.convention) && score.error < std::min(least, best->error)) best = &score;
  }
  return *best;
}

void judge(PoseCheck& check) {
  const ConventionScore& best = best_of(check.scores);
  const double given = check.scores.front().error;
  check.best = best.convention;
  // At rest every convention is as good as another.
  const bool moves =
      check.photometric ? best.visible_error + 0.1 < 0.9 * check.without_motion : check.without_motion > 1;
  const bool explains = check.photometric || best.positive_depth > 0.5;
  constexpr double kWorseThanRest = 1.5;
  const bool contradicts =
      check.photometric && check.scores.front().visible_error > kWorseThanRest * check.without_motion;
  if (!moves && contradicts) {
    check.sentence =
        "no convention explains the images: a camera at rest would fit them better than these poses; they "
        "may be in "
        "another unit, of another time or of another flight";
  } else if (!moves || !explains) {
    check.sentence =
        !moves ? "the camera hardly moves between the frames that were tried: the convention cannot be told"
               : "no convention explains the images: the poses may not belong to them";
  } else if (best.convention == PoseConvention::as_given) {
    check.verdict = PoseCheck::Verdict::good;
    check.sentence = explain(check.best);
  } else if (best.error < kClearlyBetter * given && best.wins > 0.5) {
    check.verdict = PoseCheck::Verdict::wrong;
    check.sentence = explain(check.best);
  } else {
    check.sentence =
        fmt::format("the poses as given and '{}' explain the images about equally well", name_of(check.best));
  }
}

}  // namespace

std::string_view name_of(PoseConvention convention) {
  constexpr std::array<std::string_view, pose_conventions.size()> names = {
      "as given",     "inverted",      "inverse relative", "GL axes",     "FRD axes",   "FLU axes",
      "scalar first", "images turned", "millimetres",      "left handed", "row before", "row after"};
  return names[static_cast<std::size_t>(convention)];
}

Pose relative_pose(PoseConvention convention, const Pose& a, const Pose& b) {
  using Eigen::Vector3d;
  const auto with_axes = [&](const Eigen::Matrix3d& R) { return rotated(b, R).inverse() * rotated(a, R); };
  switch (convention) {
    case PoseConvention::inverted:
      return b * a.inverse();
    case PoseConvention::inverse_relative:
      return a.inverse() * b;
    case PoseConvention::gl_axes:
      return with_axes(columns(Vector3d::UnitX(), -Vector3d::UnitY(), -Vector3d::UnitZ()));
    case PoseConvention::frd_axes:
      return with_axes(columns(Vector3d::UnitY(), Vector3d::UnitZ(), Vector3d::UnitX()));
    case PoseConvention::flu_axes:
      return with_axes(forward_camera_rotation());
    case PoseConvention::scalar_first: {
      const auto reordered = [](const Pose& pose) {
        const Eigen::Quaterniond& q = pose.rotation;
        return Pose{Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w()), pose.translation};
      };
      return reordered(b).inverse() * reordered(a);
    }
    case PoseConvention::images_turned:
      return with_axes(columns(-Vector3d::UnitX(), -Vector3d::UnitY(), Vector3d::UnitZ()));
    case PoseConvention::millimetres: {
      Pose motion = b.inverse() * a;
      motion.translation *= 1e-3;
      return motion;
    }
    case PoseConvention::left_handed: {
      const Pose motion = b.inverse() * a;
      const Eigen::Quaterniond& q = motion.rotation;
      const Vector3d& t = motion.translation;
      return {Eigen::Quaterniond(q.w(), -q.x(), q.y(), -q.z()), Vector3d(t.x(), -t.y(), t.z())};
    }
    case PoseConvention::as_given:
    case PoseConvention::row_before:
    case PoseConvention::row_after:
      break;
  }
  return b.inverse() * a;
}

PoseCheck check_poses(std::span<const PoseCheckPair> pairs, const Camera& camera) {
  PoseCheck check;
  check.photometric =
      std::any_of(pairs.begin(), pairs.end(), [](const auto& pair) { return !pair.depth.empty(); });
  std::vector<PairFits> fits;
  for (const PoseCheckPair& pair : pairs) {
    if (pair.depth.empty() == check.photometric) continue;
    if (const std::optional<PairFits> fit = fit_pair(pair, camera)) fits.push_back(*fit);
  }
  check.pairs = static_cast<int>(fits.size());
  if (fits.empty()) {
    check.sentence = "no pair of frames has enough texture to check the poses";
    return check;
  }
  const auto over_pairs = [&fits](auto figure) {
    std::vector<double> values;
    for (const PairFits& fit : fits) values.push_back(figure(fit));
    return median(std::move(values), std::numeric_limits<double>::infinity());
  };
  for (std::size_t i = 0; i < pose_conventions.size(); ++i) {
    ConventionScore score;
    score.convention = pose_conventions[i];
    score.error = over_pairs([i](const PairFits& fit) { return fit.fits[i].error; });
    score.visible_error = over_pairs([i](const PairFits& fit) { return fit.fits[i].visible_error; });
    score.positive_depth = over_pairs([i](const PairFits& fit) { return fit.fits[i].positive_depth; });
    const auto wins = std::count_if(fits.begin(), fits.end(), [i](const PairFits& pair) {
      return std::all_of(pair.fits.begin(), pair.fits.end(),
                         [&](const Fit& other) { return pair.fits[i].error <= other.error; });
    });
    score.wins = static_cast<double>(wins) / static_cast<double>(fits.size());
    check.scores.push_back(score);
  }
  check.without_motion = over_pairs([](const PairFits& fit) { return fit.without_motion; });
  judge(check);
  return check;
}

}  // namespace pade::evaluation

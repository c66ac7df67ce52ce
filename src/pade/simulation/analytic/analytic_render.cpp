#include "pade/simulation/analytic/analytic_render.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "pade/core/compute/parallel.hpp"

namespace pade::simulation {
namespace {

/// A camera at a pose: viewing rays in the world, of unit Z in the camera.
class Eye {
 public:
  Eye(const Camera& camera, const Pose& T_world_camera)
      : camera_(camera), R_world_camera_(T_world_camera.matrix3()), origin_(T_world_camera.translation) {}

  [[nodiscard]] const Eigen::Vector3d& origin() const { return origin_; }
  [[nodiscard]] std::optional<Eigen::Vector3d> direction(double u, double v) const {
    const auto ray = camera_.unproject({u, v});
    if (!ray) return std::nullopt;
    return R_world_camera_ * *ray;
  }

 private:
  const Camera& camera_;
  Eigen::Matrix3d R_world_camera_;
  Eigen::Vector3d origin_;
};

/// What the ray through one pixel centre sees.
struct Sight {
  std::optional<Eigen::Vector3d> direction;  ///< empty = outside the lens
  std::optional<RayHit> hit;                 ///< empty = sky

  /// Pixels that may be blended without an edge between them.
  [[nodiscard]] bool same_face(const Sight& other) const {
    if (direction.has_value() != other.direction.has_value()) return false;
    if (hit.has_value() != other.hit.has_value()) return false;
    return !hit || (hit->surface == other.hit->surface && hit->face == other.hit->face);
  }
};

Sight look(const AnalyticScene& scene, const Eye& eye, double u, double v) {
  Sight sight;
  sight.direction = eye.direction(u, v);
  if (sight.direction) sight.hit = scene.cast(eye.origin(), *sight.direction);
  return sight;
}

/// Step on the tangent plane of the hit when the viewing direction changes by `turn` (ray differential, Igehy
/// 1999).
Eigen::Vector3d footprint(const RayHit& hit, const Eigen::Vector3d& direction, const Eigen::Vector3d& turn) {
  return hit.t * (turn - hit.normal.dot(turn) / hit.normal.dot(direction) * direction);
}

double brightness(const AnalyticScene& scene, const Eye& eye, const Sight& sight, double u, double v) {
  if (!sight.direction) return 0;
  if (!sight.hit) return AnalyticScene::sky_brightness(*sight.direction);
  const auto turn = [&](double du, double dv) -> Eigen::Vector3d {
    if (const auto next = eye.direction(u + du, v + dv)) return *next - *sight.direction;
    if (const auto previous = eye.direction(u - du, v - dv)) return *sight.direction - *previous;
    return Eigen::Vector3d::Zero();
  };
  const Eigen::Vector3d point = eye.origin() + sight.hit->t * *sight.direction;
  return scene.brightness(*sight.hit, point, footprint(*sight.hit, *sight.direction, turn(1, 0)),
                          footprint(*sight.hit, *sight.direction, turn(0, 1)));
}

/// A normal variate that depends on seed and index alone (splitmix64, Box-Muller).
double normal_variate(std::uint64_t seed, std::uint64_t index) {
  const auto mix = [](std::uint64_t x) {
    x += 0x9e3779b97f4a7c15U;
    x = (x ^ (x >> 30U)) * 0xbf58476d1ce4e5b9U;
    x = (x ^ (x >> 27U)) * 0x94d049bb133111ebU;
    return x ^ (x >> 31U);
  };
  const auto uniform = [](std::uint64_t x) { return (static_cast<double>(x >> 11U) + 0.5) * 0x1p-53; };
  const std::uint64_t a = mix(mix(seed) ^ index);
  return std::sqrt(-2 * std::log(uniform(a))) * std::cos(2 * std::numbers::pi * uniform(mix(a)));
}

bool at_edge(const std::vector<std::vector<Sight>>& sights, int v, int u) {
  const auto height = static_cast<int>(sights.size());
  const auto width = static_cast<int>(sights.front().size());
  const auto at = [&](int y, int x) -> const Sight& {
    return sights[static_cast<std::size_t>(y)][static_cast<std::size_t>(x)];
  };
  for (int y = std::max(v - 1, 0); y <= std::min(v + 1, height - 1); ++y) {
    for (int x = std::max(u - 1, 0); x <= std::min(u + 1, width - 1); ++x) {
      if (!at(v, u).same_face(at(y, x))) return true;
    }
  }
  return false;
}

std::vector<std::vector<Sight>> look_at_all(const AnalyticScene& scene, const Camera& camera, const Eye& eye,
                                            int threads) {
  std::vector<std::vector<Sight>> sights(static_cast<std::size_t>(camera.height),
                                         std::vector<Sight>(static_cast<std::size_t>(camera.width)));
  parallel_rows(camera.height, threads, [&](int v) {
    for (int u = 0; u < camera.width; ++u) {
      sights[static_cast<std::size_t>(v)][static_cast<std::size_t>(u)] = look(scene, eye, u, v);
    }
  });
  return sights;
}

}  // namespace

cv::Mat render_image(const AnalyticScene& scene, const Camera& camera, const Pose& T_world_camera,
                     const AnalyticRenderOptions& options) {
  const Eye eye(camera, T_world_camera);
  const auto sights = look_at_all(scene, camera, eye, options.threads);
  cv::Mat image(camera.size(), CV_8UC1);
  parallel_rows(camera.height, options.threads, [&](int v) {
    auto* row = image.ptr<std::uint8_t>(v);
    for (int u = 0; u < camera.width; ++u) {
      const Sight& centre = sights[static_cast<std::size_t>(v)][static_cast<std::size_t>(u)];
      double value = 0;
      if (options.samples > 1 && at_edge(sights, v, u)) {
        for (int i = 0; i < options.samples * options.samples; ++i) {
          const double x = u + (i % options.samples + 0.5) / options.samples - 0.5;
          const double y =
              v + (i / options.samples + 0.5) / options.samples - 0.5;  // NOLINT(bugprone-integer-division)
          value += brightness(scene, eye, look(scene, eye, x, y), x, y);
        }
        value /= options.samples * options.samples;
      } else {
        value = brightness(scene, eye, centre, u, v);
      }
      value *= 255;
      if (options.noise_sigma > 0 && centre.direction) {
        const auto index = static_cast<std::uint64_t>(v) * static_cast<std::uint64_t>(camera.width) +
                           static_cast<std::uint64_t>(u);
        value += options.noise_sigma * normal_variate(options.noise_seed, index);
      }
      row[u] = cv::saturate_cast<std::uint8_t>(value);
    }
  });
  return image;
}

cv::Mat exact_depth(const AnalyticScene& scene, const Camera& camera, const Pose& T_world_camera,
                    int threads) {
  const Eye eye(camera, T_world_camera);
  cv::Mat depth(camera.size(), CV_32FC1);
  parallel_rows(camera.height, threads, [&](int v) {
    auto* row = depth.ptr<float>(v);
    for (int u = 0; u < camera.width; ++u) {
      const Sight sight = look(scene, eye, u, v);
      row[u] = sight.hit ? static_cast<float>(sight.hit->t) : std::numeric_limits<float>::quiet_NaN();
    }
  });
  return depth;
}

cv::Mat exact_labels(const AnalyticScene& scene, const Camera& camera, const Pose& T_world_camera,
                     int threads) {
  const Eye eye(camera, T_world_camera);
  cv::Mat labels(camera.size(), CV_8UC1);
  parallel_rows(camera.height, threads, [&](int v) {
    auto* row = labels.ptr<std::uint8_t>(v);
    for (int u = 0; u < camera.width; ++u) {
      const Sight sight = look(scene, eye, u, v);
      row[u] = sight.hit ? static_cast<std::uint8_t>(sight.hit->surface + 1) : std::uint8_t{0};
    }
  });
  return labels;
}

cv::Mat textured_mask(const AnalyticScene& scene, const cv::Mat& labels) {
  cv::Mat table(1, 256, CV_8UC1, cv::Scalar(0));
  for (std::size_t i = 0; i < std::min<std::size_t>(scene.surfaces().size(), 255); ++i) {
    table.at<std::uint8_t>(static_cast<int>(i) + 1) = scene.surfaces()[i].material.textured() ? 255 : 0;
  }
  cv::Mat mask;
  cv::LUT(labels, table, mask);
  return mask;
}

std::optional<ExactFlow> exact_flow_at(const AnalyticScene& scene, const Camera& camera,
                                       const Pose& T_world_from, const Pose& T_world_to,
                                       const Eigen::Vector2d& pixel) {
  const Eye eye(camera, T_world_from);
  const Sight sight = look(scene, eye, pixel.x(), pixel.y());
  if (!sight.direction) return std::nullopt;

  const Eigen::Vector3d& target = T_world_to.translation;
  const Eigen::Vector3d towards =
      sight.hit ? Eigen::Vector3d(eye.origin() + sight.hit->t * *sight.direction - target) : *sight.direction;
  const auto image = camera.project(T_world_to.rotation.conjugate() * towards);
  if (!image) return std::nullopt;

  const bool inside =
      image->x() >= 0 && image->y() >= 0 && image->x() <= camera.width - 1 && image->y() <= camera.height - 1;
  // A surface point is hidden where a ray toward it meets something before it. The tolerance keeps the point
  // from hiding itself.
  const double reach = sight.hit ? 1 - 1e-7 : std::numeric_limits<double>::infinity();
  return ExactFlow{*image - pixel, inside && !scene.cast(target, towards, reach)};
}

ExactFlowField exact_flow(const AnalyticScene& scene, const Camera& camera, const Pose& T_world_from,
                          const Pose& T_world_to, int threads) {
  ExactFlowField field{{cv::Mat(camera.size(), CV_32FC2), {}}, cv::Mat(camera.size(), CV_8UC1)};
  parallel_rows(camera.height, threads, [&](int v) {
    auto* vectors = field.flow.vectors.ptr<cv::Vec2f>(v);
    auto* visible = field.visible.ptr<std::uint8_t>(v);
    for (int u = 0; u < camera.width; ++u) {
      const auto flow = exact_flow_at(scene, camera, T_world_from, T_world_to, Eigen::Vector2d(u, v));
      constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
      vectors[u] = flow
                       ? cv::Vec2f(static_cast<float>(flow->vector.x()), static_cast<float>(flow->vector.y()))
                       : cv::Vec2f(kNone, kNone);
      visible[u] = flow && flow->visible ? 255 : 0;
    }
  });
  return field;
}

}  // namespace pade::simulation

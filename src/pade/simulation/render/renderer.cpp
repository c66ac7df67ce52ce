#include "pade/simulation/render/renderer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <vector>

#include "pade/core/compute/parallel.hpp"
#include "pade/core/option_check.hpp"
#include "pade/simulation/render/sun_map.hpp"
#include "pade/simulation/render/truth.hpp"
#include "pade/simulation/world/texture.hpp"

namespace pade::simulation {
namespace {

constexpr int kLanes = ray_packet_size;
constexpr int kMostSamples = 16;
constexpr float kInfinity = std::numeric_limits<float>::infinity();
/// Shadow rays start this fraction of the depth before the surface, so that it does not shade itself.
constexpr double kLift = 3e-4;

/// How a visual is coloured.
struct Paint {
  const Texture* texture = nullptr;
  Eigen::Array3f colour = Eigen::Array3f::Ones();
  Eigen::Array3f mean = Eigen::Array3f::Ones();
  float scale = 1;  ///< texture coordinates per metre of the surface
  float contrast = 1;
  bool stained = false;  ///< large soft stains hide that a pattern repeats
};

struct Lane {
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< world, Z = 1 in the camera
  Primitive primitive;
  double depth = 0;
};

/// A surface that shows in a pixel, with the share of samples that hit it and that the sun reaches.
struct Fragment {
  std::uint32_t id = Primitive::none;
  SurfacePoint point;
  float sun_cosine = 0;
  int covered = 0;
  int lit = 0;
};

}  // namespace

std::vector<Eigen::Vector2d> sample_pattern(int samples) {
  std::vector<Eigen::Vector2d> offsets;
  if (samples == 1) return {Eigen::Vector2d::Zero()};
  for (int i = 0; i < samples; ++i) {
    const int half = samples / 2;
    // Rows in an order that spreads neighbours, mirrored by construction: odd positions for an even number;
    // for an odd one, where odd positions would meet their own mirror images, from both ends in turn.
    const int k = i < half ? i : samples - 1 - i;
    const int from_both_ends = k % 2 == 1 ? samples - 1 - k : k;
    const int row = samples % 2 == 1 ? from_both_ends : (2 * k + 1) % samples;
    const double x = (k + 0.5) / samples - 0.5;
    const double y = (row + 0.5) / samples - 0.5;
    offsets.emplace_back(i < half ? x : -x, i < half ? y : -y);
  }
  if (samples % 2 == 1) offsets[static_cast<std::size_t>(samples / 2)].setZero();
  return offsets;
}

struct Renderer::Implementation {
  const Scene& scene;
  std::map<PatternKind, Texture> patterns;
  std::map<const cv::Mat*, Texture> images;
  Texture clouds = Texture::clouds();
  std::vector<Paint> paints;
  Eigen::Vector3d to_sun = Eigen::Vector3d::UnitZ();
  Eigen::Array3f sun = Eigen::Array3f::Zero();
  std::optional<SunMap> sun_map;  ///< where the sun casts shadows
  Eigen::Array3f ambient;

  explicit Implementation(const Scene& of);
  [[nodiscard]] Eigen::Array3f shade(const Fragment& fragment, const Eigen::Vector3d& right,
                                     const Eigen::Vector3d& down, const Lane& lane, int samples) const;
  [[nodiscard]] Eigen::Array3f sky(const Eigen::Vector3d& direction, int samples) const;
};

Renderer::Implementation::Implementation(const Scene& of) : scene(of) {
  const World& world = scene.world();
  ambient = world.ambient.cast<float>().array();
  if (world.sun) {
    to_sun = -world.sun->direction.normalized();
    sun = world.sun->colour.cast<float>().array();
    if (world.sun->casts_shadows) sun_map.emplace(scene.geometry(), to_sun);
  }
  for (const Visual& visual : world.visuals) {
    const Material& material = visual.material;
    Paint paint;
    paint.colour = material.colour.cast<float>().array();
    if (material.image) {
      auto known = images.find(material.image.get());
      if (known == images.end())
        known = images.emplace(material.image.get(), Texture::from_image(*material.image)).first;
      paint.texture = &known->second;
    } else if (material.pattern.kind != PatternKind::none) {
      const PatternKind kind = material.pattern.kind;
      auto known = patterns.find(kind);
      if (known == patterns.end()) known = patterns.emplace(kind, Texture::from_pattern(kind)).first;
      paint.texture = &known->second;
      paint.scale = static_cast<float>(1 / material.pattern.scale);
      paint.contrast = static_cast<float>(material.pattern.contrast);
      paint.stained = true;
    }
    if (paint.texture != nullptr) paint.mean = paint.texture->mean();
    paints.push_back(paint);
  }
}

/// `right` and `down`: how the world direction of the ray changes from pixel to pixel.
Eigen::Array3f Renderer::Implementation::shade(const Fragment& fragment, const Eigen::Vector3d& right,
                                               const Eigen::Vector3d& down, const Lane& lane,
                                               int samples) const {
  const Paint& paint = paints[static_cast<std::size_t>(fragment.point.visual)];
  Eigen::Array3f albedo = paint.colour;
  if (paint.texture != nullptr) {
    const Eigen::Vector3d normal = fragment.point.normal.cast<double>();
    const double facing = std::min(normal.dot(lane.direction), -1e-4);
    // Where the neighbouring pixels' rays meet the tangent plane.
    const auto on_plane = [&](const Eigen::Vector3d& step) -> Eigen::Vector3f {
      return (lane.depth * (step - lane.direction * (normal.dot(step) / facing))).cast<float>();
    };
    const Eigen::Vector3f across = on_plane(right);
    const Eigen::Vector3f along = on_plane(down);
    const TextureFrame& frame = fragment.point.texture;
    const Eigen::Vector2f at = paint.scale * frame.at(fragment.point.position.cast<float>());
    const Eigen::Vector2f du =
        paint.scale * Eigen::Vector2f(frame.gradient_u.dot(across), frame.gradient_v.dot(across));
    const Eigen::Vector2f dv =
        paint.scale * Eigen::Vector2f(frame.gradient_u.dot(along), frame.gradient_v.dot(along));
    const int most_taps = samples == 1 ? 1 : std::min(2 * samples, 8);  // no finer than the rays
    Eigen::Array3f texel = paint.texture->sample(at, du, dv, most_taps);
    if (paint.stained && samples > 1) {  // a preview does without
      // Turned and scaled by numbers that share no period with the tile.
      constexpr float kC = 0.83F;
      constexpr float kS = 0.56F;
      const Eigen::Vector2f turned(kC * at.x() - kS * at.y(), kS * at.x() + kC * at.y());
      texel *= 0.72F + 0.56F * clouds.sample(turned, du, dv, most_taps);
    }
    albedo *= (paint.mean + paint.contrast * (texel - paint.mean)).max(0.005F);
  }
  // Light from the sky falls more on what faces up.
  const float sky_light = (0.75F + 0.25F * fragment.point.normal.z()) * fragment.point.sky_view;
  const float sun_light =
      fragment.sun_cosine * static_cast<float>(fragment.lit) / static_cast<float>(samples);
  const float share = static_cast<float>(fragment.covered) / static_cast<float>(samples);
  return albedo * (sun_light * sun + share * sky_light * ambient);
}

Eigen::Array3f Renderer::Implementation::sky(const Eigen::Vector3d& direction, int samples) const {
  const World& world = scene.world();
  Eigen::Array3f colour = world.background.cast<float>().array();
  if (!world.sky) return colour;
  const Eigen::Vector3f d = direction.normalized().cast<float>();
  const float height = std::max(d.z(), 0.0F);
  // Clouds on a flat layer, faded toward the horizon, where they would crowd.
  const Eigen::Vector2f at = Eigen::Vector2f(d.x(), d.y()) / (height + 0.15F) * 2.5F;
  const float cloud = clouds.sample(at, {0.05F, 0}, {0, 0.05F}, samples == 1 ? 1 : 8).x();
  const float cover = std::clamp(2.2F * (cloud - 0.45F), 0.0F, 1.0F) * std::min(1.0F, 4 * height);
  colour += (0.85F - colour) * 0.7F * std::exp(-5 * height);
  return colour + (0.95F - colour) * 0.8F * cover;
}

namespace {

/// The pixels of one packet: a tile of neighbours, with their samples and the surfaces that these hit.
class Block {
 public:
  Block(const Scene& scene, const RayGrid& grid, const Pose& pose, const VisibleSurface& centres,
        const std::vector<Eigen::Vector2d>& offsets, const std::vector<VisibleSurface>& sampled)
      : scene_(scene),
        grid_(grid),
        R_(pose.matrix3()),
        origin_(pose.translation),
        centres_(centres),
        offsets_(offsets),
        sampled_(sampled) {}

  void take(int left, int top);
  void find_fragments(const RenderOptions& options, const Eigen::Vector3d& to_sun);
  void find_shadows(const Eigen::Vector3d& to_sun, const SunMap& sun_map);

  [[nodiscard]] bool seen(int lane) const { return seen_[static_cast<std::size_t>(lane)]; }
  [[nodiscard]] const Lane& centre(int lane) const { return centre_[static_cast<std::size_t>(lane)]; }
  [[nodiscard]] const Eigen::Vector3d& right(int lane) const {
    return right_[static_cast<std::size_t>(lane)];
  }
  [[nodiscard]] const Eigen::Vector3d& down(int lane) const { return down_[static_cast<std::size_t>(lane)]; }

  struct Pixel {
    std::array<Fragment, kMostSamples> fragments;
    std::array<Lane, kMostSamples> where;  ///< the ray at which a fragment shades
    int count = 0;
    int sky = 0;  ///< samples that hit nothing
  };
  [[nodiscard]] const Pixel& pixel(int lane) const { return pixels_[static_cast<std::size_t>(lane)]; }

 private:
  const Scene& scene_;
  const RayGrid& grid_;
  Eigen::Matrix3d R_;
  Eigen::Vector3d origin_;
  const VisibleSurface& centres_;
  const std::vector<Eigen::Vector2d>& offsets_;
  const std::vector<VisibleSurface>& sampled_;  ///< at each offset
  std::array<bool, kLanes> seen_{};
  std::array<Eigen::Vector3d, kLanes> right_;
  std::array<Eigen::Vector3d, kLanes> down_;
  std::array<Lane, kLanes> centre_;
  std::array<std::array<Lane, kLanes>, kMostSamples> samples_;
  std::array<std::array<int, kLanes>, kMostSamples> fragment_of_{};  ///< of each sample; -1 = sky
  std::array<Pixel, kLanes> pixels_;
};

void Block::take(int left, int top) {
  for (int lane = 0; lane < kLanes; ++lane) {
    const auto i = static_cast<std::size_t>(lane);
    const int column = left + lane % ray_packet_side;
    const int row = top + lane / ray_packet_side;
    seen_[i] = column < grid_.camera().width && row < grid_.camera().height &&
               grid_.ray(column, row).x() == grid_.ray(column, row).x();
    if (!seen_[i]) continue;
    const auto look = [&](const VisibleSurface& surface, const Eigen::Vector3d& direction) -> Lane {
      return {direction,
              {static_cast<std::uint32_t>(surface.primitive.at<std::int32_t>(row, column))},
              static_cast<double>(surface.depth.at<float>(row, column))};
    };
    const Eigen::Vector2d& ray = grid_.ray(column, row);
    const Eigen::Matrix2d step = grid_.step(column, row);
    right_[i] = R_.leftCols<2>() * step.col(0);
    down_[i] = R_.leftCols<2>() * step.col(1);
    centre_[i] = look(centres_, R_ * Eigen::Vector3d(ray.x(), ray.y(), 1));
    for (std::size_t s = 0; s < offsets_.size(); ++s) {
      samples_[s][i] =
          look(sampled_[s], centre_[i].direction + offsets_[s].x() * right_[i] + offsets_[s].y() * down_[i]);
    }
  }
}

void Block::find_fragments(const RenderOptions& options, const Eigen::Vector3d& to_sun) {
  for (std::size_t i = 0; i < kLanes; ++i) {
    Pixel& pixel = pixels_[i];
    pixel.count = pixel.sky = 0;
    if (!seen_[i]) continue;
    const std::uint32_t centre_id = scene_.surface_id(centre_[i].primitive);
    for (std::size_t s = 0; s < offsets_.size(); ++s) {
      const Lane& sample = samples_[s][i];
      fragment_of_[s][i] = -1;
      if (!sample.primitive.hit()) {
        ++pixel.sky;
        continue;
      }
      const std::uint32_t id = scene_.surface_id(sample.primitive);
      int found = 0;
      while (found < pixel.count && pixel.fragments[static_cast<std::size_t>(found)].id != id) ++found;
      fragment_of_[s][i] = found;
      Fragment& fragment = pixel.fragments[static_cast<std::size_t>(found)];
      if (found == pixel.count) {
        ++pixel.count;
        const Lane& where = id == centre_id ? centre_[i] : sample;
        pixel.where[static_cast<std::size_t>(found)] = where;
        fragment = {};
        fragment.id = id;
        fragment.point = scene_.surface(where.primitive, origin_ + where.depth * where.direction,
                                        where.direction, options.ambient_occlusion);
        fragment.sun_cosine = std::max(fragment.point.normal.dot(to_sun.cast<float>()), 0.0F);
      }
      ++fragment.covered;
      ++fragment.lit;  // until a shadow is found
    }
  }
}

/// Rays of all samples together, sixteen at a time, where the map leaves it open.
void Block::find_shadows(const Eigen::Vector3d& to_sun, const SunMap& sun_map) {
  RayPacket rays{};
  std::array<Fragment*, kLanes> asks{};
  int count = 0;
  const auto trace = [&] {
    const auto hidden = scene_.occluded(rays, Scene::Blockers::shadow_casters);
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      if (hidden[i]) --asks[i]->lit;
    }
    rays.active.fill(0);
    count = 0;
  };
  for (std::size_t s = 0; s < offsets_.size(); ++s) {
    for (std::size_t i = 0; i < kLanes; ++i) {
      if (!seen_[i] || fragment_of_[s][i] < 0) continue;
      Fragment& fragment = pixels_[i].fragments[static_cast<std::size_t>(fragment_of_[s][i])];
      if (fragment.sun_cosine <= 0) continue;
      const Lane& sample = samples_[s][i];
      const Eigen::Vector3d from = origin_ + (1 - kLift) * sample.depth * sample.direction;
      const SunMap::Sun sun = sun_map.at(from, fragment.id);
      if (sun == SunMap::Sun::hidden) --fragment.lit;
      if (sun != SunMap::Sun::unknown) continue;
      rays.set(count, from, to_sun, 1e-4F, kInfinity);
      asks[static_cast<std::size_t>(count)] = &fragment;
      if (++count == kLanes) trace();
    }
  }
  if (count > 0) trace();
}

}  // namespace

Status check(const RenderOptions& options) {
  const std::array<OptionRange, 1> ranges = {
      {{"samples", static_cast<double>(options.samples), 1, kMostSamples}}};
  return check_ranges(ranges);
}

Renderer::Renderer(const Scene& scene) : implementation_(std::make_unique<Implementation>(scene)) {}
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;
Renderer::~Renderer() = default;

Rendering Renderer::render(const RayGrid& grid, const Pose& T_world_camera, const RenderOptions& options,
                           int threads) const {
  const Implementation& self = *implementation_;
  const cv::Size size = grid.camera().size();
  const int samples = std::clamp(options.samples, 1, kMostSamples);
  const std::vector<Eigen::Vector2d> offsets = sample_pattern(samples);
  const VisibleSurface centres = visible_surface(self.scene, grid, T_world_camera, threads);
  std::vector<VisibleSurface> sampled;
  for (const Eigen::Vector2d& offset : offsets) {
    sampled.push_back(samples == 1 ? centres
                                   : visible_surface(self.scene, grid, T_world_camera, threads, offset));
  }
  Rendering out{cv::Mat::zeros(size, CV_32FC3), centres.depth};
  const auto make_block = [&] { return Block(self.scene, grid, T_world_camera, centres, offsets, sampled); };
  parallel_tiles(
      size.width, size.height, ray_packet_side, threads, make_block, [&](Block& block, int left, int top) {
        block.take(left, top);
        block.find_fragments(options, self.to_sun);
        if (options.shadows && self.sun_map) block.find_shadows(self.to_sun, *self.sun_map);
        for (int lane = 0; lane < kLanes; ++lane) {
          if (!block.seen(lane)) continue;
          const int column = left + lane % ray_packet_side;
          const int row = top + lane / ray_packet_side;
          const Block::Pixel& pixel = block.pixel(lane);
          Eigen::Array3f light = Eigen::Array3f::Zero();
          for (std::size_t f = 0; f < static_cast<std::size_t>(pixel.count); ++f) {
            light +=
                self.shade(pixel.fragments[f], block.right(lane), block.down(lane), pixel.where[f], samples);
          }
          if (pixel.sky > 0) {
            light += self.sky(block.centre(lane).direction, samples) *
                     (static_cast<float>(pixel.sky) / static_cast<float>(samples));
          }
          out.radiance.at<cv::Vec3f>(row, column) = {light[0], light[1], light[2]};
        }
      });
  return out;
}

}  // namespace pade::simulation

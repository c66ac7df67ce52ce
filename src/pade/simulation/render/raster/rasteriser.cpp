#include "pade/simulation/render/raster/rasteriser.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "pade/core/compute/parallel.hpp"

namespace pade::simulation {
namespace {

// Small enough that what is drawn stays in the second cache, and large enough that few clusters lie in
// several.
constexpr int kTileBlocks = 32;
constexpr int kTilePixels = kTileBlocks * raster_side;
constexpr std::size_t kClusterTriangles = 4 * raster_lanes;

/// Where a box lies in the image, with nothing of it outside; empty where no pixel can show it.
struct Extent {
  float nearest;       ///< along the optical axis
  int x0, x1, y0, y1;  ///< pixels
  /// No point within is nearer than that, in spite of rounding.
  [[nodiscard]] float nearest_inverse() const {
    return nearest > 0 ? 1.001F / nearest : std::numeric_limits<float>::infinity();
  }
};

/// Blocks of a tile.
struct Blocks {
  int x0, x1, y0, y1;
};
Blocks blocks_of(const Extent& extent, const RasterTile& tile) {
  return {std::max(extent.x0 / raster_side - tile.left, 0),
          std::min(extent.x1 / raster_side - tile.left, tile.columns - 1),
          std::max(extent.y0 / raster_side - tile.top, 0),
          std::min(extent.y1 / raster_side - tile.top, tile.rows - 1)};
}

class Viewer {
 public:
  Viewer(const Camera& camera, const Pose& T_world_camera)
      : camera_(camera),
        R_(T_world_camera.matrix3().transpose().cast<float>()),
        absolute_(R_.cwiseAbs()),
        origin_(T_world_camera.translation.cast<float>()) {}

  [[nodiscard]] std::optional<Extent> extent(const Eigen::AlignedBox3f& box) const {
    constexpr float kNear = 1e-3F;
    const Eigen::Vector3f centre = R_ * (0.5F * (box.min() + box.max()) - origin_);
    // More than the half sizes by what rounding could take.
    const Eigen::Vector3f half =
        1.0001F * (absolute_ * (0.5F * box.sizes())) + Eigen::Vector3f::Constant(1e-6F * centre.norm());
    const float nearest = centre.z() - half.z();
    const float farthest = centre.z() + half.z();
    if (farthest <= 0) return std::nullopt;
    Extent out{std::max(nearest, 0.0F), 0, camera_.width - 1, 0, camera_.height - 1};
    if (nearest < kNear) {
      // Wholly beyond one side of the image?
      const auto beyond = [&](int axis, double focal, double centre_pixel, int last) {
        const auto low = static_cast<float>((-1 - centre_pixel) / focal);
        const auto high = static_cast<float>((last + 1 - centre_pixel) / focal);
        return centre[axis] - low * centre.z() + half[axis] + std::abs(low) * half.z() < 0 ||
               centre[axis] - high * centre.z() - half[axis] - std::abs(high) * half.z() > 0;
      };
      if (beyond(0, camera_.fx, camera_.cx, camera_.width - 1) ||
          beyond(1, camera_.fy, camera_.cy, camera_.height - 1))
        return std::nullopt;
      return out;
    }
    const auto span = [&](int axis, double focal, double centre_pixel, int last, int& from, int& to) {
      const float low = centre[axis] - half[axis];
      const float high = centre[axis] + half[axis];
      const float first = low / (low < 0 ? nearest : farthest);
      const float second = high / (high > 0 ? nearest : farthest);
      const auto pixel = [&](float slope) {
        return std::clamp(static_cast<double>(slope) * focal + centre_pixel, -2.0, last + 2.0);
      };
      from = std::max(static_cast<int>(std::floor(pixel(first))), 0);
      to = std::min(static_cast<int>(std::ceil(pixel(second))), last);
      return from <= to;
    };
    if (!span(0, camera_.fx, camera_.cx, camera_.width - 1, out.x0, out.x1)) return std::nullopt;
    if (!span(1, camera_.fy, camera_.cy, camera_.height - 1, out.y0, out.y1)) return std::nullopt;
    return out;
  }

 private:
  const Camera& camera_;
  Eigen::Matrix3f R_;  // camera from world
  Eigen::Matrix3f absolute_;
  Eigen::Vector3f origin_;
};

Eigen::AlignedBox3f box_of(const Geometry& geometry, std::uint32_t triangle) {
  Eigen::AlignedBox3f box;
  for (const std::uint32_t corner : geometry.triangles[triangle])
    box.extend(Eigen::Map<const Eigen::Vector3f>(geometry.vertices[corner].data()));
  return box;
}

struct Item {
  Eigen::Vector3f centre;
  std::uint32_t triangle;
};

/// Orders the triangles so that each run of kClusterTriangles is close together.
void sort_by_place(std::vector<Item>& items, std::size_t first, std::size_t last) {
  if (last - first <= kClusterTriangles) return;
  Eigen::AlignedBox3f box;
  for (std::size_t i = first; i < last; ++i) box.extend(items[i].centre);
  Eigen::Index axis = 0;
  box.sizes().maxCoeff(&axis);
  const std::size_t clusters = (last - first + kClusterTriangles - 1) / kClusterTriangles;
  const std::size_t middle = first + (clusters + 1) / 2 * kClusterTriangles;
  const auto at = [&](std::size_t i) { return items.begin() + static_cast<std::ptrdiff_t>(i); };
  std::nth_element(at(first), at(middle), at(last), [axis](const Item& a, const Item& b) {
    return a.centre[axis] != b.centre[axis] ? a.centre[axis] < b.centre[axis] : a.triangle < b.triangle;
  });
  sort_by_place(items, first, middle);
  sort_by_place(items, middle, last);
}

}  // namespace

Rasteriser::Rasteriser(const Geometry& geometry) : geometry_(geometry) {
  // Large triangles (walls, ground) would make the boxes of the clusters that they are in as large.
  constexpr float kLarge = 8;  // times the mean
  std::vector<float> size(geometry.triangles.size());
  for (std::uint32_t i = 0; i < size.size(); ++i) size[i] = box_of(geometry, i).sizes().maxCoeff();
  const double sum = std::accumulate(size.begin(), size.end(), 0.0);
  const float large =
      kLarge * static_cast<float>(sum / static_cast<double>(std::max<std::size_t>(size.size(), 1)));
  for (const bool large_ones : {true, false}) {
    std::vector<std::uint32_t> triangles;
    for (std::uint32_t i = 0; i < size.size(); ++i) {
      if ((size[i] > large) == large_ones) triangles.push_back(i);
    }
    add_clusters(triangles);
  }
  if (planes_.empty()) planes_.emplace_back();  // one to look at where there is none to see
}

void Rasteriser::add_clusters(std::vector<std::uint32_t>& triangles) {
  std::vector<Item> items;
  items.reserve(triangles.size());
  for (const std::uint32_t i : triangles) items.push_back({box_of(geometry_, i).center(), i});
  sort_by_place(items, 0, items.size());
  for (std::size_t from = 0; from < items.size(); from += kClusterTriangles) {
    const std::size_t to = std::min(from + kClusterTriangles, items.size());
    Cluster cluster;
    cluster.first = static_cast<std::uint32_t>(packets_.size());
    for (std::size_t i = from; i < to; ++i) {
      const std::uint32_t triangle = items[i].triangle;
      const std::size_t lane = (i - from) % raster_lanes;
      if (lane == 0) {
        packets_.emplace_back();
        packets_.back() = {};
        triangle_of_slot_.resize(packets_.size() * raster_lanes, 0);
        planes_.resize(packets_.size() * raster_lanes, TrianglePlane{});
      }
      for (std::size_t corner = 0; corner < 3; ++corner) {
        const auto& p = geometry_.vertices[geometry_.triangles[triangle][corner]];
        for (std::size_t axis = 0; axis < 3; ++axis) packets_.back().corner[corner][axis][lane] = p[axis];
      }
      const std::size_t slot = (packets_.size() - 1) * raster_lanes + lane;
      const Facet& facet = geometry_.facets[geometry_.facet_of_triangle[triangle]];
      triangle_of_slot_[slot] = triangle;
      planes_[slot] = {{facet.normal.x(), facet.normal.y(), facet.normal.z()}, facet.offset};
      cluster.box.extend(box_of(geometry_, triangle));
    }
    cluster.last = static_cast<std::uint32_t>(packets_.size());
    clusters_.push_back(cluster);
  }
}

struct Rasteriser::Frame {
  Frame(const Camera& camera, const Pose& T_world_camera);
  simd::InstructionSet set = simd::InstructionSet::baseline;
  RasterView view{};
  Eigen::Matrix3d R;  // world from camera
  Eigen::Vector3d origin;
  int width, height;
  int tiles_across, tiles_down;
  std::vector<float> x_of_lanes, y_of_lanes, x_of_blocks, y_of_blocks;
  std::vector<double> x_of_pixels, y_of_pixels;
  struct Seen {
    std::uint32_t index;
    Extent extent;
  };
  std::vector<Seen> clusters, quadrics;                      ///< quadrics: of the piece
  std::vector<std::vector<std::uint32_t>> clusters_of_tile;  ///< into `clusters`, from near to far
  std::vector<std::vector<std::uint32_t>> quadrics_of_tile;

  void assign(const std::vector<Seen>& seen, std::vector<std::vector<std::uint32_t>>& of_tile) const;
};

Rasteriser::Frame::Frame(const Camera& camera, const Pose& T_world_camera)
    : R(T_world_camera.matrix3()),
      origin(T_world_camera.translation),
      width(camera.width),
      height(camera.height),
      tiles_across((width + kTilePixels - 1) / kTilePixels),
      tiles_down((height + kTilePixels - 1) / kTilePixels) {
  // What is drawn beyond the image is not looked at.
  for (int u = 0; u < tiles_across * kTilePixels; ++u) x_of_pixels.push_back((u - camera.cx) / camera.fx);
  for (int v = 0; v < tiles_down * kTilePixels; ++v) y_of_pixels.push_back((v - camera.cy) / camera.fy);
  const auto blocks = [](const std::vector<double>& pixels, std::vector<float>& of_blocks) {
    for (std::size_t i = 0; i < pixels.size(); i += raster_side)
      of_blocks.push_back(static_cast<float>(pixels[i]));
  };
  blocks(x_of_pixels, x_of_blocks);
  blocks(y_of_pixels, y_of_blocks);
  for (std::size_t i = 0; i < x_of_pixels.size(); i += raster_side) {
    for (std::size_t lane = 0; lane < raster_lanes; ++lane)
      x_of_lanes.push_back(static_cast<float>(x_of_pixels[i + lane % raster_side]));
  }
  for (std::size_t i = 0; i < y_of_pixels.size(); i += raster_side) {
    for (std::size_t lane = 0; lane < raster_lanes; ++lane)
      y_of_lanes.push_back(static_cast<float>(y_of_pixels[i + lane / raster_side]));
  }
  for (int i = 0; i < 3; ++i) view.origin[i] = origin[i];
  for (int i = 0; i < 9; ++i) view.rotation[i] = R(i % 3, i / 3);
  view.fx = static_cast<float>(camera.fx);
  view.fy = static_cast<float>(camera.fy);
  view.cx = static_cast<float>(camera.cx);
  view.cy = static_cast<float>(camera.cy);
  view.x_of_lanes = x_of_lanes.data();
  view.y_of_lanes = y_of_lanes.data();
  view.x_of_blocks = x_of_blocks.data();
  view.y_of_blocks = y_of_blocks.data();
  view.x_of_pixels = x_of_pixels.data();
  view.y_of_pixels = y_of_pixels.data();
}

void Rasteriser::Frame::assign(const std::vector<Seen>& seen,
                               std::vector<std::vector<std::uint32_t>>& of_tile) const {
  of_tile.resize(static_cast<std::size_t>(tiles_across * tiles_down));
  for (std::uint32_t i = 0; i < seen.size(); ++i) {
    const Extent& e = seen[i].extent;
    for (int y = e.y0 / kTilePixels; y <= e.y1 / kTilePixels; ++y) {
      for (int x = e.x0 / kTilePixels; x <= e.x1 / kTilePixels; ++x)
        of_tile[static_cast<std::size_t>(y * tiles_across + x)].push_back(i);
    }
  }
}

VisibleSurface Rasteriser::draw(const Camera& camera, const Pose& T_world_camera, int threads,
                                simd::InstructionSet set) const {
  Frame frame(camera, T_world_camera);
  frame.set = set;
  const Viewer viewer(camera, T_world_camera);
  for (std::uint32_t i = 0; i < clusters_.size(); ++i) {
    if (const auto extent = viewer.extent(clusters_[i].box)) frame.clusters.push_back({i, *extent});
  }
  std::sort(frame.clusters.begin(), frame.clusters.end(), [](const Frame::Seen& a, const Frame::Seen& b) {
    return a.extent.nearest != b.extent.nearest ? a.extent.nearest < b.extent.nearest : a.index < b.index;
  });
  for (std::uint32_t i = 0; i < geometry_.quadric_pieces.size(); ++i) {
    const Geometry::QuadricPiece& piece = geometry_.quadric_pieces[i];
    const Eigen::AlignedBox3d box = geometry_.quadrics[piece.quadric].bounds(piece.from, piece.to);
    if (const auto extent = viewer.extent(box.cast<float>())) frame.quadrics.push_back({i, *extent});
  }
  frame.assign(frame.clusters, frame.clusters_of_tile);
  frame.assign(frame.quadrics, frame.quadrics_of_tile);

  const cv::Size size(frame.width, frame.height);
  VisibleSurface image{cv::Mat(size, CV_32SC1), cv::Mat(size, CV_32FC1)};
  parallel_rows(frame.tiles_across * frame.tiles_down, threads,
                [&](int tile) { draw_tile(frame, tile, image); });
  return image;
}

QuadricView Rasteriser::quadric_view(const Frame& frame, std::uint32_t quadric, float nearest_inverse) const {
  const Quadric& shape = geometry_.quadrics[quadric];
  const Eigen::Vector3d origin = shape.T_unit_world * frame.origin;
  const Eigen::Matrix3d direction = shape.T_unit_world.linear() * frame.R;
  QuadricView out{};
  for (int i = 0; i < 3; ++i) out.origin[i] = origin[i];
  for (int i = 0; i < 9; ++i) out.direction[i] = direction(i / 3, i % 3);
  out.round_in_z = shape.kind == Quadric::Kind::sphere;
  out.capped = shape.kind == Quadric::Kind::cylinder;
  out.nearest = nearest_inverse;
  out.slot = quadric | Primitive::quadric_bit;
  return out;
}

void Rasteriser::draw_triangles(const Frame& frame, std::size_t index, const RasterTile& tile) const {
  const auto draw = PADE_DISPATCH(raster_triangles, frame.set);
  for (const std::uint32_t i : frame.clusters_of_tile[index]) {
    const Frame::Seen& seen = frame.clusters[i];
    const Blocks blocks = blocks_of(seen.extent, tile);
    const float nearest = seen.extent.nearest_inverse();
    bool hidden = true;
    for (int y = blocks.y0; hidden && y <= blocks.y1; ++y) {
      const float* row = tile.farthest_inverse + y * tile.columns;
      hidden = std::all_of(row + blocks.x0, row + blocks.x1 + 1, [nearest](float w) { return w >= nearest; });
    }
    if (!hidden)
      draw(frame.view, packets_.data(), clusters_[seen.index].first, clusters_[seen.index].last, tile);
  }
}

void Rasteriser::draw_quadrics(const Frame& frame, std::size_t index, const RasterTile& tile) const {
  const auto draw = PADE_DISPATCH(raster_quadric, frame.set);
  for (const std::uint32_t i : frame.quadrics_of_tile[index]) {
    const Frame::Seen& seen = frame.quadrics[i];
    const std::uint32_t quadric = geometry_.quadric_pieces[seen.index].quadric;
    const Blocks blocks = blocks_of(seen.extent, tile);
    draw(frame.view, quadric_view(frame, quadric, seen.extent.nearest_inverse()), tile, blocks.x0, blocks.x1,
         blocks.y0, blocks.y1);
  }
}

void Rasteriser::draw_tile(const Frame& frame, int index, VisibleSurface& image) const {
  constexpr std::size_t kPixels = static_cast<std::size_t>(kTilePixels) * kTilePixels;
  const int left = index % frame.tiles_across * kTileBlocks;
  const int top = index / frame.tiles_across * kTileBlocks;
  const int rows = std::min(kTileBlocks, (frame.height - raster_side * top + raster_side - 1) / raster_side);
  std::vector<float> inverse_depth(kPixels, 0);
  std::vector<float> farthest_inverse(kPixels / raster_lanes, 0);
  std::vector<float> depth(kPixels);
  std::vector<std::uint32_t> slot(kPixels, Primitive::none);
  const RasterTile tile{
      left, top, kTileBlocks, rows, inverse_depth.data(), slot.data(), farthest_inverse.data()};
  draw_triangles(frame, static_cast<std::size_t>(index), tile);
  draw_quadrics(frame, static_cast<std::size_t>(index), tile);
  PADE_DISPATCH(raster_depth, frame.set)(frame.view, planes_.data(), tile, depth.data());

  for (int y = 0; y < raster_side * rows && raster_side * top + y < frame.height; ++y) {
    auto* primitive_row = image.primitive.ptr<std::int32_t>(raster_side * top + y);
    auto* depth_row = image.depth.ptr<float>(raster_side * top + y);
    for (int x = 0; x < kTilePixels && raster_side * left + x < frame.width; ++x) {
      const int block = y / raster_side * kTileBlocks + x / raster_side;
      const auto pixel =
          static_cast<std::size_t>(block * raster_lanes + y % raster_side * raster_side + x % raster_side);
      std::uint32_t primitive = slot[pixel];
      if ((primitive & Primitive::quadric_bit) == 0) primitive = triangle_of_slot_[primitive];
      primitive_row[raster_side * left + x] = static_cast<std::int32_t>(primitive);
      depth_row[raster_side * left + x] = depth[pixel];
    }
  }
}

}  // namespace pade::simulation

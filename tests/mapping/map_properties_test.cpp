// What must hold for any depth image: which voxels may change, and which must not.
#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>
#include <octomap/OcTree.h>
#include <opencv2/core.hpp>

#include "pade/io/formats/map_files.hpp"
#include "pade/mapping/back_projection.hpp"
#include "pade/mapping/occupancy_map.hpp"
#include "pade/simulation/analytic/analytic_flights.hpp"

#include "mapping/flown_map.hpp"

namespace pade::mapping {
namespace {

using Eigen::Vector3d;
using simulation::AnalyticFlight;
using simulation::make_analytic_flight;

const Camera kSmall = simulation::analytic_camera(128, 96);

/// What one image shows is believed at once, so that one image is enough to see what it says.
MapOptions one_look() {
  MapOptions options;
  options.looks_baseline = 0;
  return options;
}

OccupancyMap new_map(const MapOptions& options = one_look()) {
  return std::move(OccupancyMap::create(options)).value();
}

/// The flight seen from a camera that is turned about all axes, so that nothing is aligned with the voxels.
AnalyticFlight tilted(const char* name) {
  AnalyticFlight flight = *make_analytic_flight(name, 3, kSmall);
  for (Pose& pose : flight.T_world_camera) {
    pose.rotation = pose.rotation * rotation_exp({0.11, -0.07, 0.13});
    pose.translation += Vector3d(0.0123, 0.0456, 0.0371);
  }
  return flight;
}

void for_each_voxel(const OccupancyMap& map, Occupancy wanted,
                    const std::function<void(const Vector3d&)>& visitor) {
  const double voxel = map.options().voxel;
  map.for_each([&](const MapCell& cell, Occupancy state) {
    if (state != wanted) return;
    const int n = 1 << (16 - static_cast<int>(cell.depth));
    for (int z = 0; z < n; ++z) {
      for (int y = 0; y < n; ++y) {
        for (int x = 0; x < n; ++x) {
          visitor(cell.centre.cast<double>() + voxel * (Vector3d(x, y, z).array() - 0.5 * (n - 1)).matrix());
        }
      }
    }
  });
}

using VoxelSet = std::set<std::tuple<long, long, long>>;
VoxelSet voxels(const OccupancyMap& map, Occupancy state) {
  VoxelSet set;
  for_each_voxel(map, state, [&](const Vector3d& centre) {
    const Vector3d index = centre / map.options().voxel;
    set.emplace(std::lround(index.x() - 0.5), std::lround(index.y() - 0.5), std::lround(index.z() - 0.5));
  });
  return set;
}

std::size_t difference(const VoxelSet& a, const VoxelSet& b) {
  std::vector<VoxelSet::value_type> only;
  std::set_symmetric_difference(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(only));
  return only.size();
}

TEST(MapUpdate, DoesNotDependOnTheOrderOfThePixels) {
  // Seen by a camera that hangs upside down, the same rays come in the reverse order.
  const AnalyticFlight flight = tilted("forward");
  const DepthImage image = depth_image(flight, 0, 0.01);
  OccupancyMap upright = new_map();
  upright.integrate(image, kSmall, flight.T_world_camera[0]);

  DepthImage turned = image;
  cv::rotate(image.depth, turned.depth, cv::ROTATE_180);
  cv::rotate(image.variance, turned.variance, cv::ROTATE_180);
  cv::rotate(image.state, turned.state, cv::ROTATE_180);
  Pose pose = flight.T_world_camera[0];
  pose.rotation = pose.rotation * Eigen::Quaterniond(0, 0, 0, 1);
  OccupancyMap hanging = new_map();
  hanging.integrate(turned, kSmall, pose);

  const VoxelSet occupied = voxels(upright, Occupancy::occupied);
  const VoxelSet free = voxels(upright, Occupancy::free);
  ASSERT_GT(occupied.size(), 1000U);
  ASSERT_GT(free.size(), 20000U);
  // Rounding may move a point that lies on the face of a voxel.
  EXPECT_LE(difference(occupied, voxels(hanging, Occupancy::occupied)), occupied.size() / 500);
  EXPECT_LE(difference(free, voxels(hanging, Occupancy::free)), free.size() / 500);
}

TEST(MapUpdate, ClearsOnlyWhatIsSeenAndLiesTwoSigmaBeforeTheSurface) {
  const AnalyticFlight flight = tilted("forward");
  const Pose& pose = flight.T_world_camera[0];
  for (const double relative : {0.0, 0.03, 0.1}) {
    DepthImage image = depth_image(flight, 0);
    image.variance = relative * relative * image.depth.mul(image.depth);
    OccupancyMap map = new_map();
    map.integrate(image, kSmall, pose);
    std::size_t checked = 0;
    std::size_t before_sky = 0;  // where there is no depth: only along its edge, by part of a voxel
    for_each_voxel(map, Occupancy::free, [&](const Vector3d& centre) {
      const Vector3d ray = centre - pose.translation;
      const auto hit = flight.scene.cast(pose.translation, ray);
      if (!hit) {
        ++before_sky;
        return;
      }
      // The centre of the voxel lies at t = 1, the surface at hit->t, the same ratio as of their depths.
      EXPECT_LT(1, hit->t * (1 - 2 * relative) + 1e-6);
      ++checked;
    });
    EXPECT_GT(checked, 5000U) << relative;
    EXPECT_LT(before_sky, checked / 100) << relative;
  }
}

TEST(MapUpdate, LearnsNothingFromPixelsThatAreNotMeasuredAndHaveNoBound) {
  const AnalyticFlight flight = tilted("forward");
  const DepthImage exact = depth_image(flight, 0);
  for (const DepthState state : {DepthState::epipole, DepthState::low_parallax, DepthState::no_texture,
                                 DepthState::inconsistent, DepthState::out_of_view}) {
    // Even where the depth of such a pixel is a number.
    DepthImage blank = exact;
    blank.state = cv::Mat(exact.depth.size(), CV_8UC1, cv::Scalar(static_cast<int>(state)));
    OccupancyMap map = new_map();
    const MapChange change = map.integrate(blank, kSmall, flight.T_world_camera[0]);
    EXPECT_TRUE(change.became_free.empty() && change.became_occupied.empty());
    EXPECT_EQ(map.octree()->size(), 0U);
  }
}

TEST(MapUpdate, LeavesTheConeBehindBlankPixelsUnknown) {
  const AnalyticFlight flight = tilted("sideways");
  const Pose& pose = flight.T_world_camera[0];
  DepthImage image = depth_image(flight, 0);
  const cv::Rect blank(30, 20, 40, 50);
  image.state(blank).setTo(static_cast<int>(DepthState::no_texture));
  image.depth(blank).setTo(std::numeric_limits<float>::quiet_NaN());
  OccupancyMap map = new_map();
  map.integrate(image, kSmall, pose);
  std::size_t known = 0;
  for (const Occupancy state : {Occupancy::free, Occupancy::occupied}) {
    for_each_voxel(map, state, [&](const Vector3d& centre) {
      ++known;
      const Vector3d p = pose.inverse() * centre;
      if (p.z() < 0.3) return;
      const auto pixel = *kSmall.project(p);
      const double radius = 0.87 * map.options().voxel * kSmall.fx / p.z() + 2;  // of the voxel in the image
      const bool deep_inside =
          pixel.x() > blank.x + radius && pixel.x() < blank.x + blank.width - 1 - radius &&
          pixel.y() > blank.y + radius && pixel.y() < blank.y + blank.height - 1 - radius;
      EXPECT_FALSE(deep_inside) << pixel.transpose() << " at " << p.z() << " m";
    });
  }
  EXPECT_GT(known, 10000U);
}

TEST(MapUpdate, GivesEachVoxelOneHitOrOneMissPerImage) {
  const AnalyticFlight flight = tilted("courtyard");
  OccupancyMap map = new_map();
  map.integrate(depth_image(flight, 0, 0.01), kSmall, flight.T_world_camera[0]);
  const auto tree = map.octree();
  ASSERT_GT(tree->size(), 1000U);
  for (auto leaf = tree->begin_leafs(); leaf != tree->end_leafs(); ++leaf) {
    const double p = leaf->getOccupancy();
    EXPECT_TRUE(std::abs(p - 0.7) < 1e-6 || std::abs(p - 0.4) < 1e-6) << p;
  }
}

TEST(MapUpdate, ReportsExactlyWhatChanged) {
  const AnalyticFlight flight = tilted("courtyard");
  OccupancyMap map = new_map();
  VoxelSet occupied;
  VoxelSet free;
  for (std::size_t k = 0; k < 3; ++k) {
    const MapChange change = map.integrate(depth_image(flight, k, 0.02), kSmall, flight.T_world_camera[k]);
    const auto apply = [&](const std::vector<MapCell>& cells, VoxelSet& to, VoxelSet& from) {
      for (const MapCell& cell : cells) {
        const int n = 1 << (16 - static_cast<int>(cell.depth));
        for (int i = 0; i < n * n * n; ++i) {
          const VoxelSet::value_type voxel{cell.key[0] - 32768 + i % n, cell.key[1] - 32768 + i / n % n,
                                           cell.key[2] - 32768 + i / (n * n)};
          EXPECT_TRUE(to.insert(voxel).second);
          from.erase(voxel);
        }
      }
    };
    apply(change.became_occupied, occupied, free);
    apply(change.became_free, free, occupied);
  }
  EXPECT_EQ(occupied, voxels(map, Occupancy::occupied));
  EXPECT_EQ(free, voxels(map, Occupancy::free));
}

TEST(MapUpdate, GivesTheSameBytesAgain) {
  const AnalyticFlight flight = tilted("courtyard");
  const OccupancyMap a = map_of(flight, 0.01);
  const OccupancyMap b = map_of(flight, 0.01);
  EXPECT_EQ(io::bytes_of(io::encode_map(a, io::MapFormat::ot)),
            io::bytes_of(io::encode_map(b, io::MapFormat::ot)));
}

TEST(MapUpdate, ForgetsAnObstacleThatHasGone) {
  AnalyticFlight with = *make_analytic_flight("forward", 1, kSmall);
  with.scene.add("visitor", simulation::Sphere{{3, 0.3, 1.6}, 0.3});
  const AnalyticFlight without = *make_analytic_flight("forward", 1, kSmall);
  const Pose& pose = with.T_world_camera[0];
  const Vector3d front(2.72, 0.3, 1.6);
  OccupancyMap map = new_map();
  for (int i = 0; i < 5; ++i) map.integrate(depth_image(with, 0), kSmall, pose);
  ASSERT_EQ(map.at(front), Occupancy::occupied);
  std::size_t cleared = 0;
  for (int i = 0; i < 12; ++i)
    cleared += map.integrate(depth_image(without, 0), kSmall, pose).became_free.size();
  EXPECT_EQ(map.at(front), Occupancy::free);
  EXPECT_GT(cleared, 10U);
}

TEST(MapUpdate, DoesNotClearTheEdgeOfAnObstacleThatWindowsHaveBlurred) {
  // In a window that straddles the edge of the ball the mean of the flow gives a depth between ball and
  // facade.
  constexpr int n = 4;
  AnalyticFlight flight = *make_analytic_flight("forward", 1, simulation::analytic_camera(320, 240));
  const DepthImage exact = depth_image(flight, 0);
  DepthImage image;
  image.window = n;
  image.depth.create(60, 80, CV_32FC1);
  for (int v = 0; v < 60; ++v) {
    for (int u = 0; u < 80; ++u) {
      cv::Mat inverse = 1 / exact.depth(cv::Rect(u * n, v * n, n, n));
      image.depth.at<float>(v, u) = static_cast<float>(1 / cv::mean(inverse)[0]);
    }
  }
  OccupancyMap map = new_map();
  map.integrate(image, flight.camera, flight.T_world_camera[0]);
  std::size_t checked = 0;
  for_each_voxel(map, Occupancy::free, [&](const Vector3d& centre) {
    EXPECT_GT(flight.scene.signed_distance(centre), -0.02);
    ++checked;
  });
  EXPECT_GT(checked, 20000U);
}

TEST(MapUpdate, AgreesWithOctoMapsOwnRayCastingWithoutNoise) {
  const AnalyticFlight flight = tilted("courtyard");
  const Pose& pose = flight.T_world_camera[0];
  MapOptions options = one_look();
  options.range = 7;
  const DepthImage image = depth_image(flight, 0);
  OccupancyMap map = new_map(options);
  map.integrate(image, kSmall, pose);

  // insertPointCloud limits the length of rays and not their depth: cut them here.
  octomap::OcTree tree(options.voxel);
  const octomap::point3d eye(static_cast<float>(pose.translation.x()),
                             static_cast<float>(pose.translation.y()),
                             static_cast<float>(pose.translation.z()));
  octomap::KeySet free;
  octomap::KeySet occupied;
  octomap::KeyRay ray;
  for (const CloudPoint& point : back_project(image, kSmall, pose)) {
    const double z = (pose.inverse() * Vector3d(point.x, point.y, point.z)).z();
    const octomap::point3d end = eye + (octomap::point3d(point.x, point.y, point.z) - eye) *
                                           static_cast<float>(std::min(1.0, options.range / z));
    if (tree.computeRayKeys(eye, end, ray)) free.insert(ray.begin(), ray.end());
    // A voxel counts by its centre, so points a little beyond the range may make one occupied.
    if (z <= options.range + options.voxel) occupied.insert(tree.coordToKey(point.x, point.y, point.z));
  }

  std::size_t ours = 0;
  std::size_t theirs_too = 0;
  for_each_voxel(map, Occupancy::free, [&](const Vector3d& centre) {
    const octomap::OcTreeKey key = tree.coordToKey(centre.x(), centre.y(), centre.z());
    ++ours;
    theirs_too += free.count(key) > 0 ? 1 : 0;
    EXPECT_EQ(occupied.count(key), 0U);
  });
  for_each_voxel(map, Occupancy::occupied, [&](const Vector3d& centre) {
    EXPECT_EQ(occupied.count(tree.coordToKey(centre.x(), centre.y(), centre.z())), 1U);
  });
  ::testing::Test::RecordProperty("free_ours", static_cast<int>(ours));
  ::testing::Test::RecordProperty("free_octomap", static_cast<int>(free.size()));
  EXPECT_GE(static_cast<double>(theirs_too), 0.98 * static_cast<double>(ours));
  EXPECT_GE(static_cast<double>(theirs_too), 0.8 * static_cast<double>(free.size()));
}

TEST(MapUpdate, CountsPointsBeyondTheOctreeAndGoesOn) {
  AnalyticFlight flight = *make_analytic_flight("forward", 1, kSmall);
  const DepthImage image = depth_image(flight, 0);
  Pose far = flight.T_world_camera[0];
  far.translation.x() = 3270;
  OccupancyMap map = new_map();
  const MapChange change = map.integrate(image, kSmall, far);
  EXPECT_GT(change.outside, 100U);
  far.translation.x() = 1e7;
  EXPECT_GT(map.integrate(image, kSmall, far).outside, 5000U);
  far.translation.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(map.integrate(image, kSmall, far).became_free.empty());
}

TEST(MapOptions, ThatMakeNoSenseAreRefusedByName) {
  const std::vector<std::pair<const char*, std::function<void(MapOptions&)>>> wrong = {
      {"voxel", [](MapOptions& o) { o.voxel = 0; }},
      {"voxel", [](MapOptions& o) { o.voxel = std::nan(""); }},
      {"range", [](MapOptions& o) { o.range = -1; }},
      {"p_hit", [](MapOptions& o) { o.p_hit = 0.5; }},
      {"p_miss", [](MapOptions& o) { o.p_miss = 0.6; }},
      {"clamp_min", [](MapOptions& o) { o.clamp_min = 0.99; }},
      {"clamp_max", [](MapOptions& o) { o.clamp_max = 1; }},
      {"occupancy_threshold", [](MapOptions& o) { o.occupancy_threshold = 0.05; }},
      {"free_margin_sigmas", [](MapOptions& o) { o.free_margin_sigmas = -1; }},
      {"free_hole", [](MapOptions& o) { o.free_hole = -0.1; }},
      {"free_hole", [](MapOptions& o) { o.free_hole = std::numeric_limits<double>::infinity(); }},
      {"looks_baseline", [](MapOptions& o) { o.looks_baseline = std::nan(""); }},
      {"hit_max_relative_sigma", [](MapOptions& o) { o.hit_max_relative_sigma = 0.6; }},
      {"hit_near", [](MapOptions& o) { o.hit_near = -1; }},
      {"hit_min_share", [](MapOptions& o) { o.hit_min_share = 2; }},
      {"hit_min_of_peak", [](MapOptions& o) { o.hit_min_of_peak = 1.5; }},
  };
  for (const auto& [name, spoil] : wrong) {
    MapOptions options;
    spoil(options);
    const auto map = OccupancyMap::create(options);
    ASSERT_FALSE(map.ok()) << name;
    EXPECT_NE(map.error().message.find(name), std::string::npos) << map.error().message;
  }
}

TEST(MapOptions, EachThatIsNoNumberIsRefusedByName) {
  std::vector<std::string> names;
  MapOptions options;
  MapOptions::visit(options, [&](const char* name, double&, const char*) { names.emplace_back(name); });
  for (std::size_t i = 0; i < names.size(); ++i) {
    MapOptions spoilt;
    std::size_t field = 0;
    MapOptions::visit(spoilt, [&](const char*, double& value, const char*) {
      if (field++ == i) value = std::nan("");
    });
    const auto map = OccupancyMap::create(spoilt);
    ASSERT_FALSE(map.ok()) << names[i];
    EXPECT_NE(map.error().message.find(names[i]), std::string::npos) << map.error().message;
  }
}

TEST(BackProjection, InvertsProjection) {
  const AnalyticFlight flight = tilted("forward");
  for (const int window : {1, 4}) {
    DepthImage image;
    image.window = window;
    image.depth.create(96 / window, 128 / window, CV_32FC1);
    cv::randu(image.depth, 1.0, 15.0);
    image.depth.at<float>(3, 5) = std::numeric_limits<float>::quiet_NaN();
    image.variance = 0.01 * image.depth;
    cv::Mat grey(96, 128, CV_8UC1);
    for (int v = 0; v < grey.rows; ++v) {
      for (int u = 0; u < grey.cols; ++u) grey.at<std::uint8_t>(v, u) = static_cast<std::uint8_t>(v + u);
    }
    const PointCloud cloud = back_project(image, kSmall, flight.T_world_camera[1], grey);
    ASSERT_EQ(cloud.size(), image.depth.total() - 1);
    std::size_t i = 0;
    for (int v = 0; v < image.depth.rows; ++v) {
      for (int u = 0; u < image.depth.cols; ++u) {
        if (std::isnan(image.depth.at<float>(v, u))) continue;
        const CloudPoint& point = cloud[i++];
        const Vector3d p = flight.T_world_camera[1].inverse() * Vector3d(point.x, point.y, point.z);
        const auto pixel = kSmall.project(p);
        ASSERT_TRUE(pixel);
        EXPECT_NEAR(pixel->x(), cell_centre(u, window), 1e-3);
        EXPECT_NEAR(pixel->y(), cell_centre(v, window), 1e-3);
        EXPECT_NEAR(p.z(), image.depth.at<float>(v, u), 1e-4);
        EXPECT_FLOAT_EQ(point.sigma, std::sqrt(image.variance.at<float>(v, u)));
        EXPECT_NEAR(point.colour[0], pixel->x() + pixel->y(), 1.01);
      }
    }
  }
}

TEST(BackProjection, TakesEveryNthCellOfEveryNthRow) {
  DepthImage image;
  image.depth = cv::Mat(96, 128, CV_32FC1, cv::Scalar(5));
  const PointCloud all = back_project(image, kSmall, {});
  const PointCloud some = back_project(image, kSmall, {}, {}, 5);
  ASSERT_EQ(some.size(), 20U * 26U);
  EXPECT_EQ(some[1], all[5]);
  EXPECT_EQ(some[26], all[5 * 128]);
}

}  // namespace
}  // namespace pade::mapping

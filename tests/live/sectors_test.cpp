// OBSTACLE_DISTANCE through what the autopilots make of it, written down from their sources (PX4's
// CollisionPrevention, ArduPilot's AP_Proximity_MAV).
#include "pade/live/sectors.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <octomap/OcTree.h>

namespace pade::live {
namespace {

using Eigen::Vector3d;
using mapping::MapView;
using mapping::OccupancyMap;

constexpr double kVoxel = 0.25;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kRadian = std::numbers::pi / 180;

mapping::MapOptions options_of_map() {
  mapping::MapOptions options;
  options.voxel = kVoxel;
  return options;
}

SectorOptions options_of_sectors() {
  SectorOptions options;
  options.max_distance = 10;
  return options;
}

double wrap360(double degrees) {
  const double rest = std::fmod(degrees, 360);
  return rest < 0 ? rest + 360 : rest;
}

/// Angle between two bearings, degrees.
double apart(double a, double b) { return std::abs(std::remainder(a - b, 360)); }

/// What an autopilot believes of the direction of a bearing.
struct Belief {
  double distance = kInfinity;  ///< m; infinite: free
  bool known = false;
};

/// PX4: 36 bins of its own, each with one element of the message.
std::vector<Belief> px4(const mavlink::ObstacleDistance& m) {
  std::vector<Belief> bins(36);
  const double increment = m.increment_f > 0 ? static_cast<double>(m.increment_f) : m.increment;
  for (std::size_t i = 0; i < bins.size(); ++i) {
    const double bearing = wrap360(10.0 * static_cast<double>(i) - static_cast<double>(m.angle_offset));
    const auto element = static_cast<std::size_t>(std::ceil(bearing / increment));
    const std::uint16_t d = m.distances.at(element);  // throws where PX4 would read past the end
    if (d == kUnknownDistance) continue;
    bins[i].known = true;
    if (d < m.max_distance) bins[i].distance = 0.01 * d;
  }
  return bins;
}

/// ArduPilot: faces of 45°, each with the nearest element whose middle lies in it.
struct Face {
  Belief belief;
  double bearing = 0;  ///< of the middle of that element, degrees
};

std::vector<Face> ardupilot(const mavlink::ObstacleDistance& m) {
  std::vector<Face> faces(8);
  const double increment = m.increment_f > 0 ? static_cast<double>(m.increment_f) : m.increment;
  for (std::size_t k = 0; k < kBins; ++k) {
    const std::uint16_t d = m.distances[k];
    if (d == kUnknownDistance || d == 0 || d < m.min_distance || d > m.max_distance) continue;
    const double middle = wrap360(static_cast<double>(k) * increment + static_cast<double>(m.angle_offset));
    Face& face = faces[static_cast<std::size_t>(wrap360(middle + 22.5) / 45)];
    face.belief.known = true;
    if (0.01 * d < face.belief.distance) {
      face.belief.distance = 0.01 * d;
      face.bearing = middle;
    }
  }
  return faces;
}

/// A voxel as it is seen from the body: by dense points on its outline.
struct Seen {
  double distance = kInfinity;  ///< horizontal, m
  double bearing = 0;           ///< of the nearest point, degrees clockwise from ahead
  std::vector<double> bearings;
};

Seen seen(const Vector3d& centre, const Pose& body) {
  Seen result;
  constexpr int kPoints = 16;
  const Vector3d forward = body.rotation * Vector3d::UnitX();
  const double heading = std::atan2(forward.y(), forward.x());
  const auto add = [&](double x, double y) {
    const double dx = centre.x() + x - body.translation.x();
    const double dy = centre.y() + y - body.translation.y();
    const double bearing = wrap360((heading - std::atan2(dy, dx)) / kRadian);
    result.bearings.push_back(bearing);
    if (std::hypot(dx, dy) < result.distance) {
      result.distance = std::hypot(dx, dy);
      result.bearing = bearing;
    }
  };
  constexpr double kHalf = kVoxel / 2 - 1e-9;
  for (int i = 0; i <= kPoints; ++i) {
    const double s = kHalf * (2.0 * i / kPoints - 1);
    add(s, -kHalf), add(s, kHalf), add(-kHalf, s), add(kHalf, s);
  }
  return result;
}

OccupancyMap free_map(double half_side) {
  auto tree = std::make_unique<octomap::OcTree>(kVoxel);
  for (double x = -half_side + kVoxel / 2; x < half_side; x += kVoxel) {
    for (double y = -half_side + kVoxel / 2; y < half_side; y += kVoxel) {
      for (double z = -1.5 + kVoxel / 2; z < 1.5; z += kVoxel) {
        tree->setNodeValue(
            octomap::point3d(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)), -1.0F);
      }
    }
  }
  tree->updateInnerOccupancy();
  return std::move(OccupancyMap::create(options_of_map(), std::move(tree))).value();
}

OccupancyMap with_voxels(const OccupancyMap& map, const std::vector<Vector3d>& centres) {
  std::unique_ptr<octomap::OcTree> tree = map.octree();
  for (const Vector3d& c : centres) {
    tree->setNodeValue(
        octomap::point3d(static_cast<float>(c.x()), static_cast<float>(c.y()), static_cast<float>(c.z())),
        2.0F);
  }
  return std::move(OccupancyMap::create(options_of_map(), std::move(tree))).value();
}

Vector3d centre_of_voxel(double x, double y, double z) {
  const auto snap = [](double v) { return (std::floor(v / kVoxel) + 0.5) * kVoxel; };
  return {snap(x), snap(y), snap(z)};
}

Pose body_at(std::mt19937& random, double spread) {
  std::uniform_real_distribution<double> place(-spread, spread), turn(-std::numbers::pi, std::numbers::pi),
      tilt(-0.3, 0.3);
  Pose body;
  body.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(turn(random), Vector3d::UnitZ()) *
                                     Eigen::AngleAxisd(tilt(random), Vector3d::UnitY()) *
                                     Eigen::AngleAxisd(tilt(random), Vector3d::UnitX()));
  body.translation = {place(random), place(random), 0.2 * place(random) / spread};
  return body;
}

mavlink::ObstacleDistance message_of(const MapView& view, const Pose& body) {
  const SectorOptions options = options_of_sectors();
  return obstacle_distance_message(obstacle_distances(view, body, options), {1'000'000}, options);
}

/// How a set of obstacles comes out.
struct Tally {
  int obstacles = 0;
  int px4_lost = 0, ardupilot_lost = 0;  // reported farther than true, or not at all
  int px4_near = 0, ardupilot_near = 0;  // within a bin and a voxel

  /// A single obstacle. It is lost where a bin or face of the autopilot that it reaches into is believed
  /// farther than it; it is well placed if the nearest belief is within a voxel of the truth, and each
  /// bearing at which something is believed within 10° (a bin of PX4, two of the message) of some part of it.
  void judge(const mavlink::ObstacleDistance& m, const Seen& truth) {
    ++obstacles;
    const double least = std::max(truth.distance, 0.01 * m.min_distance);
    const auto beside = [&](double bearing) {
      return std::any_of(truth.bearings.begin(), truth.bearings.end(),
                         [&](double b) { return apart(b, bearing) <= 10; });
    };
    std::vector<std::pair<Belief, double>> bins, faces;
    for (const Belief& bin : px4(m)) bins.emplace_back(bin, 10.0 * static_cast<double>(bins.size()));
    for (const Face& face : ardupilot(m)) faces.emplace_back(face.belief, face.bearing);
    const auto lost = [&](const auto& beliefs, double width) {
      return std::any_of(truth.bearings.begin(), truth.bearings.end(), [&](double bearing) {
        const auto i = static_cast<std::size_t>(wrap360(bearing + width / 2) / width);
        return beliefs[i].first.distance > least + 1e-9;
      });
    };
    const auto near = [&](const auto& beliefs) {
      double nearest = kInfinity;
      bool placed = true;
      for (const auto& [belief, bearing] : beliefs) {
        if (!(belief.distance < kInfinity)) continue;
        nearest = std::min(nearest, belief.distance);
        placed = placed && beside(bearing);
      }
      return placed && std::abs(nearest - least) <= kVoxel;
    };
    px4_lost += lost(bins, 10) ? 1 : 0;
    px4_near += near(bins) ? 1 : 0;
    ardupilot_lost += lost(faces, 45) ? 1 : 0;
    ardupilot_near += near(faces) ? 1 : 0;
  }
};

TEST(Sectors, SingleObstaclesAreLostByNeitherAutopilot) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> range(0.2, 8), turn(0, 2 * std::numbers::pi);
  const OccupancyMap empty = free_map(2);
  Tally tally;
  for (int map = 0; map < 200; ++map) {
    const double r = range(random);
    const double angle = turn(random);
    const Vector3d obstacle = centre_of_voxel(r * std::cos(angle), r * std::sin(angle), 0.1);
    const auto view = MapView::of(with_voxels(empty, {obstacle}));
    for (int round = 0; round < 100; ++round) {
      const Pose body = body_at(random, 1);
      const Seen truth = seen(obstacle, body);
      tally.judge(message_of(*view, body), truth);
    }
  }
  RecordProperty("obstacles", tally.obstacles);
  RecordProperty("px4_lost", tally.px4_lost);
  RecordProperty("ardupilot_lost", tally.ardupilot_lost);
  RecordProperty("px4_near", tally.px4_near);
  RecordProperty("ardupilot_near", tally.ardupilot_near);
  EXPECT_EQ(tally.obstacles, 20'000);
  EXPECT_EQ(tally.px4_lost, 0);
  EXPECT_EQ(tally.ardupilot_lost, 0);
  EXPECT_GE(tally.px4_near, 19'000);
  EXPECT_GE(tally.ardupilot_near, 19'000);
}

TEST(Sectors, WallsAreNowhereReportedFartherThanTheyAre) {
  std::mt19937 random(8);
  std::uniform_real_distribution<double> range(1, 6);
  const OccupancyMap empty = free_map(2);
  int bins_judged = 0;
  for (int map = 0; map < 40; ++map) {
    const double x = range(random);
    std::vector<Vector3d> wall;
    for (double y = -6; y < 6; y += kVoxel) wall.push_back(centre_of_voxel(x, y, 0.1));
    const auto view = MapView::of(with_voxels(empty, wall));
    for (int round = 0; round < 50; ++round) {
      const Pose body = body_at(random, 0.5);
      const auto m = message_of(*view, body);
      const auto bins = px4(m);
      const auto faces = ardupilot(m);
      for (const Vector3d& part : wall) {
        const Seen truth = seen(part, body);
        if (truth.distance > options_of_sectors().max_distance - kVoxel) continue;
        const double least = std::max(truth.distance, 0.01 * m.min_distance);
        const auto bin = static_cast<std::size_t>(wrap360(truth.bearing + 5) / 10);
        const auto face = static_cast<std::size_t>(wrap360(truth.bearing + 22.5) / 45);
        ASSERT_LE(bins[bin].distance, least + 1e-9);
        ASSERT_LE(faces[face].belief.distance, least + 1e-9);
        ++bins_judged;
      }
    }
  }
  EXPECT_GT(bins_judged, 50'000);
}

TEST(Sectors, OnlyWhatWasSeenWhollyIsFree) {
  // Free but for unknown voxels at random: a bin is free if and only if no point of it within reach, beyond
  // the vehicle's own, is unknown. The points are tried one by one.
  std::mt19937 random(9);
  std::uniform_real_distribution<double> place(-9, 9);
  auto options = options_of_sectors();
  options.max_distance = 6;
  std::unique_ptr<octomap::OcTree> tree = free_map(9).octree();
  for (int hole = 0; hole < 6; ++hole) {
    const Vector3d c = centre_of_voxel(place(random), place(random), 0.1);
    const octomap::point3d point(static_cast<float>(c.x()), static_cast<float>(c.y()),
                                 static_cast<float>(c.z()));
    tree->deleteNode(point);
  }
  const OccupancyMap map = std::move(OccupancyMap::create(options_of_map(), std::move(tree))).value();
  const auto view = MapView::of(map);
  int free_bins = 0, unknown_bins = 0;
  for (int round = 0; round < 20; ++round) {
    const Pose body = body_at(random, 2.5);
    const Vector3d forward = body.rotation * Vector3d::UnitX();
    const double heading = std::atan2(forward.y(), forward.x());
    const auto distances = obstacle_distances(*view, body, options);
    for (std::size_t k = 0; k < kBins; ++k) {
      bool all_known = true;
      for (double bearing = 5.0 * static_cast<double>(k) - 4.9; bearing < 5.0 * static_cast<double>(k) + 9.95;
           bearing += 0.7) {
        const double angle = heading - bearing * kRadian;
        for (double r = options.own_radius + 2 * kVoxel; r < options.max_distance; r += 0.1) {
          for (double z = -options.below; z <= options.above; z += 0.25) {
            const Vector3d p = body.translation + Vector3d(r * std::cos(angle), r * std::sin(angle), z);
            all_known = all_known && view->at(p) != mapping::Occupancy::unknown;
          }
        }
      }
      if (distances[k] == kUnknownDistance) {
        ++unknown_bins;
      } else {
        ASSERT_EQ(distances[k], 601);
        ASSERT_TRUE(all_known) << k;
        ++free_bins;
      }
    }
  }
  EXPECT_GT(free_bins, 150);
  EXPECT_GT(unknown_bins, 50);
}

TEST(Sectors, WhereNobodyHasLookedNothingIsSaid) {
  const OccupancyMap map = std::move(OccupancyMap::create(options_of_map())).value();
  for (const std::uint16_t d : obstacle_distances(*MapView::of(map), Pose{}, options_of_sectors())) {
    EXPECT_EQ(d, kUnknownDistance);
  }
}

/// Far from the origin of its estimate a vehicle comes to where no map can hold anything.
TEST(Sectors, NothingIsFreeWhereNoMapCanReach) {
  constexpr double kBorder = 32768 * kVoxel;
  const double edges[] = {-kBorder, kBorder};
  for (const double edge : edges) {
    // All is free as far as it can be addressed.
    auto tree = std::make_unique<octomap::OcTree>(kVoxel);
    const double inwards = edge > 0 ? -1 : 1;
    for (double x = kVoxel / 2; x < 14; x += kVoxel) {
      for (double y = -12 + kVoxel / 2; y < 12; y += kVoxel) {
        for (double z = -1.5 + kVoxel / 2; z < 1.5; z += kVoxel)
          tree->setNodeValue(octomap::point3d(static_cast<float>(edge + inwards * x), static_cast<float>(y),
                                              static_cast<float>(z)),
                             -1.0F);
      }
    }
    tree->updateInnerOccupancy();
    const auto view = MapView::of(std::move(OccupancyMap::create(options_of_map(), std::move(tree))).value());
    Pose body;
    const std::size_t east = edge > 0 ? 0 : 36;  // the bin that looks over the border
    body.translation = {edge + 3 * inwards, 0, 0};
    const auto near = obstacle_distances(*view, body, options_of_sectors());
    EXPECT_EQ(near[east], kUnknownDistance);
    EXPECT_EQ(near[(east + 18) % kBins], 1001) << "along the border all was seen";
    for (const double beyond : {0.5, 5.0, 9.0, 50.0, 800.0, 1e5, 1e9, 1e15}) {
      body.translation = {edge - beyond * inwards, 0, 0};
      const auto outside = obstacle_distances(*view, body, options_of_sectors());
      EXPECT_EQ(outside[east], kUnknownDistance) << beyond;
      for (const std::uint16_t d : outside) {  // what nobody has seen is the vehicle's own up to 1 m
        if (beyond > 1) {
          ASSERT_EQ(d, kUnknownDistance) << beyond;
        }
      }
      body.translation = {edge + 3 * inwards, 0, edge - beyond * inwards};
      for (const std::uint16_t d : obstacle_distances(*view, body, options_of_sectors()))
        ASSERT_EQ(d, kUnknownDistance) << beyond << " up";
    }
  }
}

TEST(Sectors, BearingsCountClockwiseFromAheadAndTheSlabIsLevel) {
  const OccupancyMap empty = free_map(2);
  const Vector3d left = centre_of_voxel(0.1, 3, 0.1);
  Pose body;
  auto m = message_of(*MapView::of(with_voxels(empty, {left})), body);
  EXPECT_EQ(m.distances[54], 300);  // 270°
  EXPECT_EQ(m.distances[18], kUnknownDistance);
  EXPECT_EQ(m.increment, 5);
  EXPECT_EQ(m.frame, 12);
  EXPECT_EQ(m.max_distance, 1000);
  body.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi / 2, Vector3d::UnitZ()));  // north
  m = message_of(*MapView::of(with_voxels(empty, {left})), body);
  EXPECT_EQ(m.distances[0], 300);
  const Vector3d high = centre_of_voxel(0.1, 3, 1.1);
  m = message_of(*MapView::of(with_voxels(empty, {high})), body);
  EXPECT_EQ(m.distances[0], kUnknownDistance);
  const Vector3d touching = centre_of_voxel(0.1, 0.1, 0.1);
  m = message_of(*MapView::of(with_voxels(empty, {touching})), body);
  for (const std::uint16_t d : m.distances) EXPECT_EQ(d, 30);  // all around, as the least distance
}

/// What the map remembers of places that the camera does not see is old: somebody may have stepped there.
TEST(Sectors, OutsideTheViewOfTheCameraNothingIsSaid) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> place(-7, 7);
  std::vector<Vector3d> obstacles;
  for (int i = 0; i < 60; ++i) obstacles.push_back(centre_of_voxel(place(random), place(random), 0.1));
  const auto view = MapView::of(with_voxels(free_map(9), obstacles));
  auto options = options_of_sectors();
  options.max_distance = 6;
  int inside = 0, outside = 0, at_the_edge = 0, free_bins = 0;
  for (int round = 0; round < 60; ++round) {
    const Pose body = body_at(random, 2);
    const SectorView sight{round % 2 == 0 ? 0.0 : -70.0, 20.0 + round};
    const auto all = obstacle_distances(*view, body, options);
    const auto seen = obstacle_distances(*view, body, options, sight);
    for (std::size_t k = 0; k < kBins; ++k) {
      const double low = 5.0 * static_cast<double>(k) - 5;
      int parts = 0;
      for (int i = 0; i <= 30; ++i) parts += apart(low + 0.5 * i, sight.middle) <= sight.half ? 1 : 0;
      if (parts == 31) {
        EXPECT_EQ(seen[k], all[k]);
        free_bins += all[k] == 601 ? 1 : 0;
        ++inside;
      } else if (parts == 0 && apart(low + 7.5, sight.middle) > sight.half + 20) {
        // But for a voxel so near that it reaches into the view.
        EXPECT_TRUE(seen[k] == kUnknownDistance || seen[k] < 150) << seen[k];
        ++outside;
      } else {
        EXPECT_NE(seen[k], 601) << "free, and only part of it is seen";
        EXPECT_TRUE(seen[k] == kUnknownDistance || seen[k] >= all[k]);
        ++at_the_edge;
      }
    }
  }
  EXPECT_GT(inside, 500);
  EXPECT_GT(outside, 500);
  EXPECT_GT(at_the_edge, 200);
  EXPECT_GT(free_bins, 20);
}

TEST(Sectors, TheViewIsThatOfTheCameraAsItIsMounted) {
  Camera camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = camera.fy = 320 / std::tan(30 * kRadian);
  camera.cx = 319.5;
  camera.cy = 239.5;
  const auto turned = [](double yaw, double pitch) {
    Pose T_body_camera;
    T_body_camera.rotation = Eigen::AngleAxisd(yaw * kRadian, Vector3d::UnitZ()) *
                             Eigen::AngleAxisd(pitch * kRadian, Vector3d::UnitY()) *
                             Eigen::Quaterniond(forward_camera_rotation());
    return T_body_camera;
  };
  const SectorView ahead = SectorView::of(camera, turned(0, 0));
  EXPECT_NEAR(ahead.middle, 0, 1e-9);
  EXPECT_NEAR(ahead.half, 30, 1e-9);
  const SectorView left = SectorView::of(camera, turned(40, 20));
  EXPECT_NEAR(left.middle, -40, 1e-9);
  EXPECT_NEAR(left.half, std::atan(std::tan(30 * kRadian) / std::cos(20 * kRadian)) / kRadian, 1e-6);
  EXPECT_EQ(SectorView::of(camera, turned(0, 90)).half, 0) << "a camera that looks down sees nothing around";
}

TEST(Sectors, OptionsThatMakeNoSenseAreRefused) {
  SectorOptions own;
  own.max_distance = 5;
  own.own_radius = 4;  // what nobody has seen would be most of what is called free
  EXPECT_FALSE(check(own));

  SectorOptions options;
  EXPECT_TRUE(check(options));
  options.max_distance = 700;  // more than 16 bits hold
  EXPECT_FALSE(check(options));
  options.max_distance = 0.2;  // less than the least
  EXPECT_FALSE(check(options));
}

}  // namespace
}  // namespace pade::live

// Routes through maps of simulated flights, judged by the true world:
//
//   pade_route_evaluation RUN WORLD.sdf [PAIRS] [SEED] [IMPROVEMENTS]
//
// RUN is what `pade map` made of the flight with true poses. Pairs of places that are clear in the map that
// exact depth gives of the same flight are drawn at random, and a route between them is planned in that map
// (which says whether there is one), in the run's map, and in maps of exact depth with noise of 5 % of Z,
// once with its sigma and once without.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "pade/evaluation/map/surface.hpp"
#include "pade/io/formats/map_files.hpp"
#include "pade/io/run/run_reader.hpp"
#include "pade/io/sequence/sequence.hpp"
#include "pade/planning/global/route.hpp"
#include "pade/simulation/render/truth.hpp"
#include "pade/simulation/sdf/sdf_reader.hpp"
#include "pade/simulation/world/world_solids.hpp"

namespace pade {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;
using mapping::MapView;
using mapping::OccupancyMap;
using mapping::UnknownSpace;
using planning::Route;
using planning::RouteOptions;

constexpr double kVehicle = 0.35;  // radius, m
constexpr double kApart = 5;       // start and goal, m
constexpr double kNoise = 0.05;    // of Z

/// The same flight as different depth sees it.
struct Flown {
  OccupancyMap exact, with_sigma, without_sigma;
  std::vector<Vector3d> track;
};

DepthImage with_noise(const cv::Mat& depth, double relative, bool sigma, std::mt19937_64& random) {
  DepthImage image;
  image.depth = depth.clone();
  std::normal_distribution<double> normal;
  for (int v = 0; v < depth.rows; ++v)
    for (int u = 0; u < depth.cols; ++u) {
      auto& z = image.depth.at<float>(v, u);
      z *= static_cast<float>(std::max(1 + relative * normal(random), 0.01));
    }
  if (sigma) image.variance = relative * relative * depth.mul(depth);
  return image;
}

Result<Flown> fly(const simulation::Scene& scene, const io::Sequence& sequence,
                  const mapping::MapOptions& options) {
  const auto make = [&] { return std::move(OccupancyMap::create(options)).value(); };
  Flown flown{make(), make(), make(), {}};
  const simulation::RayGrid grid(sequence.camera());
  std::mt19937_64 random(1);
  for (std::size_t i = 0; i < sequence.size(); ++i) {
    const Pose& pose = sequence.pose(i);
    const cv::Mat depth = simulation::exact_depth(scene, grid, pose);
    DepthImage image;
    image.depth = depth;
    flown.exact.integrate(image, sequence.camera(), pose);
    flown.with_sigma.integrate(with_noise(depth, kNoise, true, random), sequence.camera(), pose);
    flown.without_sigma.integrate(with_noise(depth, kNoise, false, random), sequence.camera(), pose);
    flown.track.push_back(pose.translation);
  }
  return flown;
}

/// What became of the pairs in one map.
struct Tally {
  const char* name;
  std::shared_ptr<const MapView> view;
  UnknownSpace unknown;
  int solvable = 0, found = 0, found_else = 0, refused = 0, collisions = 0;
  double excess = 0, seconds = 0;
  double nearest = std::numeric_limits<double>::infinity();
};

struct Truth {
  const evaluation::PlacedSurface& surface;
  const simulation::WorldSolids& solids;
  [[nodiscard]] double clearance(const Route& route) const {
    double least = 2;
    for (const planning::MotionPoint& point : route.points) {
      if (solids.inside(point.position)) return 0;
      least = std::min(least, surface.distance(point.position, least));
    }
    return least;
  }
};

void run_pairs(std::vector<Tally>& tallies, const Truth& truth, int pairs, std::uint64_t seed,
               int improvements) {
  RouteOptions options;
  options.improvements = improvements;
  const MapView& exact = *tallies.front().view;
  const Eigen::AlignedBox3d box = exact.bounds();
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  const auto place = [&] {
    for (;;) {
      const double x = unit(random);
      const double y = unit(random);
      const Vector3d at = box.min() + Vector3d(x, y, unit(random)).cwiseProduct(box.sizes());
      if (!exact.sweep(std::array{at}, options.radius + 0.01, UnknownSpace::blocked)) return at;
    }
  };
  for (int i = 0; i < pairs; ++i) {
    Vector3d start = place();
    Vector3d goal = place();
    while ((goal - start).norm() < kApart) {
      start = place();
      goal = place();
    }
    double shortest = std::numeric_limits<double>::infinity();
    std::vector<double> lengths;
    for (Tally& tally : tallies) {
      options.unknown = tally.unknown;
      const std::clock_t begin = std::clock();
      const auto route = planning::plan_route(*tally.view, start, goal, options);
      tally.seconds += static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
      lengths.push_back(route ? route->length : std::nan(""));
      if (!route) {
        tally.refused += route.error().message.starts_with("found no way") ? 0 : 1;
        continue;
      }
      shortest = std::min(shortest, route->length);
      const double clearance = truth.clearance(*route);
      tally.nearest = std::min(tally.nearest, clearance);
      tally.collisions += clearance < kVehicle ? 1 : 0;
    }
    const bool solvable = !std::isnan(lengths.front());
    for (std::size_t k = 0; k < tallies.size(); ++k) {
      tallies[k].solvable += solvable ? 1 : 0;
      if (std::isnan(lengths[k])) continue;
      ++(solvable ? tallies[k].found : tallies[k].found_else);
      tallies[k].excess += lengths[k] / shortest;
    }
  }
}

int evaluate(int argc, char** argv) {
  const auto fail = [](const std::string& message) {
    std::fprintf(stderr, "pade_route_evaluation: %s\n", message.c_str());
    return 1;
  };
  if (argc < 3) return fail("needs RUN WORLD.sdf [PAIRS] [SEED] [IMPROVEMENTS]");
  const auto number = [&](int i, int otherwise) { return argc > i ? std::atoi(argv[i]) : otherwise; };
  cv::setNumThreads(1);
  auto run = io::read_run(argv[1]);
  if (!run) return fail(run.error().message);
  const auto own = io::read_map(run->folder / "map.ot");
  if (!own) return fail(own.error().message);
  io::SequenceOptions true_poses;
  true_poses.origin = "none";
  const auto sequence = io::Sequence::open(run->info.sequence, true_poses);
  if (!sequence) return fail(sequence.error().message);
  auto world = simulation::read_sdf(argv[2], {});
  if (!world) return fail(world.error().message);
  auto scene = simulation::Scene::build(std::move(world).value());
  if (!scene) return fail(scene.error().message);
  const evaluation::Surface surface(simulation::surface_triangles(scene->world()));
  const evaluation::PlacedSurface placed(surface,
                                         Pose{Eigen::Quaterniond::Identity(), -run->info.local_origin});
  const simulation::WorldSolids solids(scene->world());
  const auto flown = fly(*scene, *sequence, own->options());
  if (!flown) return fail(flown.error().message);

  const double around = RouteOptions().radius + 0.2;
  const auto view = [&](const OccupancyMap& map) { return MapView::of(map)->flown(flown->track, around); };
  std::vector<Tally> tallies{{"exact depth", view(flown->exact), UnknownSpace::blocked},
                             {"own depth", view(*own), UnknownSpace::blocked},
                             {"own depth, unknown free", view(*own), UnknownSpace::free},
                             {"5 % noise, sigma", view(flown->with_sigma), UnknownSpace::blocked},
                             {"5 % noise, no sigma", view(flown->without_sigma), UnknownSpace::blocked}};
  const int pairs = number(3, 100);
  run_pairs(tallies, {placed, solids}, pairs, static_cast<std::uint64_t>(number(4, 1)), number(5, 500));
  std::printf(
      "| %s: map | found of solvable | found beyond | ends refused | length / shortest | collisions | least "
      "clearance, m | CPU s per pair |\n|---|---|---|---|---|---|---|---|\n",
      fs::path(argv[2]).stem().c_str());
  for (const Tally& t : tallies) {
    const int found = t.found + t.found_else;
    std::printf("| %s | %d of %d | %d | %d | %.3f | %d | %.2f | %.2f |\n", t.name, t.found, t.solvable,
                t.found_else, t.refused, found > 0 ? t.excess / found : 0, t.collisions, t.nearest,
                t.seconds / pairs);
  }
  return 0;
}

}  // namespace
}  // namespace pade

int main(int argc, char** argv) { return pade::evaluate(argc, argv); }

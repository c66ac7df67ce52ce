// For the thread sanitizer: a mapper that integrates, packs, forgets and puts out views, and planners that
// ask them whatever there is to ask.
#include <array>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "pade/mapping/query/distance_field.hpp"
#include "pade/mapping/query/map_view.hpp"
#include "pade/mapping/query/surroundings.hpp"

#include "mapping/flown_map.hpp"

namespace pade::mapping {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

/// The newest views: of all, and of a window.
struct Published {
  std::shared_ptr<const MapView> whole;
  std::shared_ptr<const MapView> window;
};

/// All that a planner asks of a view, as numbers.
std::vector<double> answers(const MapView& view, const std::vector<Vector3d>& path) {
  std::vector<double> all;
  const auto add = [&](const std::optional<Hit>& hit) { all.push_back(hit ? hit->length : -1); };
  const Vector3d middle = 0.5 * (path.front() + path.back());
  const AlignedBox3d box(middle.array() - 1.0, middle.array() + 1.0);
  for (const UnknownSpace unknown : {UnknownSpace::blocked, UnknownSpace::free}) {
    add(view.sweep(path, 0.3, unknown));
    add(view.ray(path.front(), path.back() - path.front(), 5, unknown));
    all.push_back(DistanceField::of(view, box, unknown, 1).distance(middle));
    for (const double distance : sectors(view, middle, 5, 0.5, 0.5, unknown))
      all.push_back(std::isfinite(distance) ? distance : -1);
  }
  add(view.flown(path, 0.3)->sweep(path, 0.3, UnknownSpace::blocked));
  const Contents contents = view.in_ball(middle, 0.5);
  all.push_back(static_cast<double>(contents.occupied));
  all.push_back(static_cast<double>(contents.free));
  all.push_back(static_cast<double>(frontiers(view, box).size()));
  all.push_back(static_cast<double>(view.memory()));
  std::size_t leaves = 0;
  view.for_each_leaf([&](const MapLeaf&) { ++leaves; });
  all.push_back(static_cast<double>(leaves));
  return all;
}

TEST(MapperAndPlanners, WorkSideBySide) {
  const simulation::AnalyticFlight flight =
      *simulation::make_analytic_flight("forward", 8, simulation::analytic_camera(64, 48));
  const std::vector<Vector3d> path{flight.T_world_camera[0].translation,
                                   flight.T_world_camera[7].translation};
  MapOptions options;
  options.pack_beyond = 1;
  options.forget_after = 0.2;
  OccupancyMap map = std::move(OccupancyMap::create(options)).value();
  const auto window_at = [&](std::size_t k) {
    const Vector3d place = flight.T_world_camera[k].translation;
    return MapView::of(map, {place.array() - 4.0, place.array() + 4.0});
  };
  std::mutex mutex;
  Published latest{MapView::of(map), window_at(0)};
  std::atomic<bool> done = false;
  std::array<std::size_t, 2> asked{};
  std::array<bool, 2> differs{};
  std::vector<std::thread> planners;
  for (std::size_t who = 0; who < asked.size(); ++who) {
    planners.emplace_back([&, who] {
      do {
        Published mine;
        {
          const std::lock_guard lock(mutex);
          mine = latest;
        }
        const std::shared_ptr<const MapView>& view = who == 0 ? mine.whole : mine.window;
        // While the mapper goes on a view says the same.
        if (answers(*view, path) != answers(*view, path)) differs[who] = true;
        ++asked[who];
      } while (!done);
    });
  }
  for (std::size_t k = 0; k < flight.times.size(); ++k) {
    for (const bool is_image : {true, false}) {
      const MapChange change =
          is_image ? map.integrate(depth_image(flight, k), flight.camera, flight.T_world_camera[k])
                   : map.forget(flight.times[k]);
      Published next{latest.whole->after(map, change), latest.window->after(map, change)};
      if (is_image && k % 3 == 0) next.window = window_at(k);
      const std::lock_guard lock(mutex);
      latest = std::move(next);
    }
  }
  done = true;
  for (std::thread& planner : planners) planner.join();
  for (std::size_t who = 0; who < asked.size(); ++who) {
    EXPECT_GT(asked[who], 0U);
    EXPECT_FALSE(differs[who]) << who;
  }
  EXPECT_GT(latest.whole->in_box(latest.whole->bounds()).free, 1000U);
}

}  // namespace
}  // namespace pade::mapping

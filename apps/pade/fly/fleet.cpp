#include "fleet.hpp"

#include <algorithm>
#include <memory>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "pade/core/version.hpp"
#include "pade/evaluation/binomial.hpp"
#include "pade/io/atomic_output.hpp"
#include "pade/io/options_json.hpp"
#include "pade/io/text.hpp"
#include "pade/simulation/sdf/sdf_reader.hpp"

#include "../cache.hpp"
#include "flight_files.hpp"

namespace pade::cli {
namespace {

namespace fs = std::filesystem;
using closed_loop::ChainMoment;
using closed_loop::FlightRecord;
using closed_loop::FlightTask;
using closed_loop::FlightWatch;
using closed_loop::fly_chain;
using closed_loop::fly_exact;
using closed_loop::Outcome;
using nlohmann::ordered_json;
using simulation::OpenWorldScene;

/// Straight from start to goal at full speed, whatever stands there.
FlightRecord fly_straight(const FlightTask& task, const planning::LocalPlannerOptions& options) {
  FlightWatch watch(task, options.vehicle.radius);
  const Eigen::Vector3d way = task.goal - task.start;
  const double speed = options.vehicle.speed;
  planning::MotionState state;
  state.velocity = speed * way.normalized();
  state.yaw = std::atan2(way.y(), way.x());
  constexpr double kSampleRate = 100;
  for (int i = 0; i / kSampleRate * speed <= way.norm(); ++i) {
    state.time = i / kSampleRate;
    state.position = task.start + state.time * state.velocity;
    if (!watch.look(state)) break;
  }
  return watch.finished(Outcome::arrived);
}

Result<OpenWorldScene> own_world(const FlightPlace& place) {
  auto world = simulation::read_sdf(place.file);
  if (!world) return world.error();
  for (const std::string& warning : world->warnings) fmt::print(stderr, "pade fly: warning: {}\n", warning);
  auto scene = simulation::Scene::build(std::move(world).value());
  if (!scene) return Error{fmt::format("{}: {}", place.file.string(), scene.error().message)};
  auto surface = simulation::SurfaceDistance::build(*scene);
  if (!surface) return surface.error();
  return OpenWorldScene{std::move(scene).value(), std::move(surface).value(), place.start, place.goal, 0};
}

/// The same world with a goal nearer on the straight way, or a little beside it where something stands there.
Result<OpenWorldScene> shortened(OpenWorldScene world, double way) {
  constexpr double kRoom = 1;     // m about the goal
  constexpr double kAside = 0.5;  // m
  constexpr int kSteps = 16;
  const Eigen::Vector3d along = (world.goal - world.start).normalized();
  const Eigen::Vector3d left = Eigen::Vector3d::UnitZ().cross(along).normalized();
  for (int step = 0; step < 2 * kSteps; ++step) {
    const int away = (step + 1) / 2;
    const double aside = kAside * away * (step % 2 == 0 ? 1 : -1);
    const Eigen::Vector3d goal = world.start + way * along + aside * left;
    if (world.surface.touches(goal, kRoom) || !simulation::is_passable(world.surface, world.start, goal))
      continue;
    world.goal = goal;
    return world;
  }
  return Error{fmt::format("--way: found no free place about {} m ahead, expected one (another seed)", way)};
}

/// A way that is none, or that begins or ends within something.
Status check_way(const FlightTask& task, double climb, double radius) {
  constexpr double kShortest = 2;  // m
  if (!((task.goal - task.start).norm() >= kShortest))
    return Error{fmt::format("--start and --goal: found {:.2f} m between them, expected {} m or more",
                             (task.goal - task.start).norm(), kShortest)};
  const Eigen::Vector3d take_off = task.start - climb * Eigen::Vector3d::UnitZ();
  for (const auto& [name, place] :
       {std::pair{"--start", task.start}, std::pair{"the place of take-off", take_off},
        std::pair{"--goal", task.goal}}) {
    if (task.surface.touches(place, radius))
      return Error{
          fmt::format("{}: found a surface nearer than {} m to ({:.2f}, {:.2f}, {:.2f}), expected free space",
                      name, radius, place.x(), place.y(), place.z())};
  }
  return {};
}

ordered_json parsed(const std::string& text) { return ordered_json::parse(text); }

ordered_json record_of(const FleetOptions& options) {
  ordered_json made = {{"made_by", fmt::format("pade {} fly", version)}, {"world", options.place.name}};
  if (options.place.random) {
    made["density_per_ha"] = options.place.density;
    if (options.place.way) made["way_m"] = *options.place.way;
  } else {
    const auto row = [](const Eigen::Vector3d& p) { return std::vector<double>{p.x(), p.y(), p.z()}; };
    made["start"] = row(options.place.start);
    made["goal"] = row(options.place.goal);
  }
  made["flier"] = to_name(options.flier);
  made["options"] =
      parsed(options.flier == Flier::chain ? io::to_json(options.chain) : io::to_json(options.exact));
  return made;
}

}  // namespace

Fleet::Fleet(FleetOptions options)
    : options_(std::move(options)),
      flown_(options_.seeds.size()),
      share_(options_.seeds.size(), 0),
      made_of_(record_of(options_)) {}

Status Fleet::fly(const std::function<void(std::size_t, const std::string&)>& progress) {
  progress_ = progress;
  {
    std::vector<std::jthread> helpers;
    for (int i = 1; i < options_.threads; ++i) helpers.emplace_back([this] { take_flights(); });
    take_flights();
  }
  return failure_;
}

void Fleet::take_flights() {
  for (std::size_t i = next_++; i < options_.seeds.size(); i = next_++) {
    const Status status = fly_one(i);
    const std::scoped_lock lock(mutex_);
    if (!status && failure_.ok()) failure_ = status;
    if (!status || io::interrupted()) next_ = options_.seeds.size();
    ++done_;
  }
}

/// False stops the flight.
bool Fleet::report(std::size_t index, double share) {
  const std::scoped_lock lock(mutex_);
  share_[index] = share;
  std::string note;
  for (std::size_t i = 0; i < share_.size(); ++i) {
    if (share_[i] > 0 && share_[i] < 1 && flown_[i].is_null())
      note +=
          fmt::format("{}{} at {:.0f} %", note.empty() ? "seed " : ", ", options_.seeds[i], 100 * share_[i]);
  }
  if (progress_) progress_(done_, note);
  return !io::interrupted();
}

Result<OpenWorldScene> Fleet::world_of(std::uint64_t seed) {
  const std::scoped_lock lock(mutex_);  // libsdformat keeps its callbacks globally
  const FlightPlace& place = options_.place;
  if (!place.random) return own_world(place);
  const fs::path file = default_cache() / "worlds" /
                        fmt::format("{}-{}-{}", place.name, seed, place.density) / (place.name + ".sdf");
  auto world = simulation::make_open_world(*place.random, seed, place.density, file);
  if (world && place.way) return shortened(std::move(world).value(), *place.way);
  return world;
}

fs::path Fleet::folder_of(std::uint64_t seed) const { return options_.out / std::to_string(seed); }

Status Fleet::fly_one(std::size_t index) {
  if (const Status s = find_flown(index); !s) return s;
  if (!flown_[index].is_null()) return {};
  const std::uint64_t seed = options_.seeds[index];
  auto found = world_of(seed);
  if (!found) return found.error();
  const auto world = closed_loop::built_for(options_.chain.fault.kind, std::move(found).value());
  if (!world) return world.error();
  const FlightTask task{world->scene, world->surface, world->start, world->goal, seed};
  const bool chain = options_.flier == Flier::chain;
  const auto& vehicle = chain ? options_.chain.planner.vehicle : options_.exact.planner.vehicle;
  if (const Status s = check_way(task, chain ? options_.chain.climb : 0, vehicle.radius); !s) return s;
  return fly_with(index, task);
}

Status Fleet::fly_with(std::size_t index, const FlightTask& task) {
  const bool writes = !options_.out.empty();
  const double radius = options_.flier == Flier::chain ? options_.chain.planner.vehicle.radius
                                                       : options_.exact.planner.vehicle.radius;
  ordered_json flown = {{"seed", task.seed}};
  const auto finish = [&](const ordered_json& measures, const auto& write) -> Status {
    flown.update(measures);
    const ordered_json whole = {{"made_of", made_of_}, {"flight", flown}};
    if (writes) {
      if (const Status s = write(folder_of(task.seed), whole); !s) return s;
    }
    const std::scoped_lock lock(mutex_);
    flown_[index] = flown;
    return {};
  };
  if (options_.flier != Flier::chain) {
    auto record = options_.flier == Flier::exact
                      ? fly_exact(task, options_.exact)
                      : Result<FlightRecord>(fly_straight(task, options_.exact.planner));
    if (!record) return record.error();
    report(index, 1);
    return finish(measures_of(task, *record, radius), [&](const fs::path& folder, const ordered_json& whole) {
      return write_flight(folder, whole, *record);
    });
  }
  FlightStrip strip;
  const auto record = fly_chain(task, options_.chain, [&](const ChainMoment& moment) {
    if (writes) strip.look(moment);
    return report(index, moment.done);
  });
  if (io::interrupted()) return {};  // whoever called knows
  if (!record) return record.error();
  return finish(measures_of(task, *record, radius), [&](const fs::path& folder, const ordered_json& whole) {
    return write_flight(folder, whole, task, *record, strip);
  });
}

/// Takes a flight that an earlier run has finished.
Status Fleet::find_flown(std::size_t index) {
  if (options_.out.empty() || options_.force) return {};
  const fs::path file = folder_of(options_.seeds[index]) / "flight.json";
  if (!io::path_exists(file)) return {};
  const auto text = io::read_file(file);
  if (!text) return text.error();
  const auto found = ordered_json::parse(*text, nullptr, false);
  if (!found.is_object() || found.value("made_of", ordered_json()) != made_of_ || !found.contains("flight"))
    return Error{
        fmt::format("{}: found a flight of other options, expected one of this command or none "
                    "(--force flies again)",
                    file.string())};
  flown_[index] = found["flight"];
  return {};
}

ordered_json summary_of(const Fleet& fleet) {
  ordered_json all = fleet.made_of();
  all["totals"] = totals_of(fleet.flown());
  all["flights"] = fleet.flown();
  return all;
}

ordered_json totals_of(const std::vector<ordered_json>& flown) {
  const auto n = flown.size();
  const auto share = [&](const auto& is) -> ordered_json {
    const auto k = static_cast<std::size_t>(std::count_if(flown.begin(), flown.end(), is));
    const evaluation::RateInterval interval = evaluation::clopper_pearson(k, n, 0.95);
    return {{"flights", k}, {"low", interval.low}, {"high", interval.high}};
  };
  const auto ended = [](Outcome outcome) {
    return [outcome](const ordered_json& f) { return f["outcome"] == to_name(outcome); };
  };
  double velocity = 0;
  for (const auto& f : flown) velocity += f["goal_velocity_m_s"].get<double>() / static_cast<double>(n);
  ordered_json totals = {{"flights", n},
                         {"arrived", share(ended(Outcome::arrived))},
                         {"collided", share(ended(Outcome::collided))}};
  for (const Outcome rest : {Outcome::timed_out, Outcome::astray, Outcome::never_ready})
    totals[std::string(to_name(rest))] = std::count_if(flown.begin(), flown.end(), ended(rest));
  totals["straight_way_is_free"] =
      share([](const ordered_json& f) { return f["straight_way_is_free"] == true; });
  totals["mean_goal_velocity_m_s"] = velocity;
  return totals;
}

}  // namespace pade::cli

#include "fleet.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "pade/closed_loop/world_measures.hpp"
#include "pade/core/fingerprint.hpp"
#include "pade/core/version.hpp"
#include "pade/evaluation/binomial.hpp"
#include "pade/io/atomic_output.hpp"
#include "pade/io/options_json.hpp"
#include "pade/io/text.hpp"
#include "pade/simulation/sdf/sdf_reader.hpp"
#include "pade/simulation/world/world_fingerprint.hpp"

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
using closed_loop::free_about;
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
  constexpr double kRoom = 1.5;   // m about the goal
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

/// A way that is none, that begins or ends within something or at heights that are not flown, or a climb that
/// meets something.
Status check_way(const FlightTask& task, double climb, const planning::VehicleLimits& vehicle) {
  constexpr double kShortest = 2;  // m
  constexpr double kStep = 0.1;    // m
  if (!((task.goal - task.start).norm() >= kShortest))
    return Error{fmt::format("--start and --goal: found {:.2f} m between them, expected {} m or more",
                             (task.goal - task.start).norm(), kShortest)};
  for (const auto& [name, place] : {std::pair{"--start", task.start}, std::pair{"--goal", task.goal}}) {
    if (place.z() < vehicle.lowest || place.z() > vehicle.highest)
      return Error{
          fmt::format("{}: found height {:.2f} m, expected {} to {} m (planner.vehicle.lowest, highest)",
                      name, place.z(), vehicle.lowest, vehicle.highest)};
  }
  const auto check_place = [&](const char* name, const Eigen::Vector3d& place) -> Status {
    if (!task.surface.touches(place, vehicle.radius) && !task.surface.inside(place)) return {};
    return Error{
        fmt::format("{}: found a surface nearer than {} m to ({:.2f}, {:.2f}, {:.2f}), expected free space",
                    name, vehicle.radius, place.x(), place.y(), place.z())};
  };
  if (const Status s = check_place("--start", task.start); !s) return s;
  if (const Status s = check_place("--goal", task.goal); !s) return s;
  for (double below = climb; below > 0; below -= kStep) {
    const Eigen::Vector3d at = task.start - below * Eigen::Vector3d::UnitZ();
    if (const Status s = check_place(below == climb ? "the place of take-off" : "the climb", at); !s)
      return s;
  }
  if (task.scene.distance(task.start - climb * Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitZ()) < climb)
    return Error{
        fmt::format("the climb of {} m to --start: found a surface across it, expected free space", climb)};
  return {};
}

ordered_json record_of(const FleetOptions& options) {
  ordered_json made = {{"made_by", fmt::format("pade {} fly", version)},
                       {"flight_revision", flight_revision},
                       {"world", options.place.name}};
  if (options.place.random) {
    made["density_per_ha"] = options.place.density;
    if (options.place.way) made["way_m"] = *options.place.way;
  } else {
    const auto row = [](const Eigen::Vector3d& p) { return std::vector<double>{p.x(), p.y(), p.z()}; };
    made["start"] = row(options.place.start);
    made["goal"] = row(options.place.goal);
  }
  made["flier"] = to_name(options.flier);
  made["options"] = options.flier == Flier::chain ? io::json_of(options.chain) : io::json_of(options.exact);
  return made;
}

}  // namespace

std::uint64_t instrument_seed(const FlightPlace& place, closed_loop::Fault fault, std::uint64_t seed) {
  if (!place.random) return seed;
  constexpr std::uint64_t kLow = 0xffffffff;  // a number that every reader of JSON keeps
  Fingerprint hash;
  hash.text(to_name(*place.random));
  hash.text(to_name(fault));
  hash.number(seed);
  return (hash.value() ^ (hash.value() >> 32)) & kLow;
}

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
  const auto is_refused = [](const ordered_json& f) { return f.is_null() || f.contains("reason"); };
  for (const ordered_json& f : flown_) {
    if (is_refused(f) && !f.is_null()) refused_.push_back(f);
  }
  std::erase_if(flown_, is_refused);
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

Result<std::optional<OpenWorldScene>> Fleet::world_of(std::uint64_t seed, std::string& reason) {
  const std::scoped_lock lock(mutex_);  // libsdformat keeps its callbacks globally
  const FlightPlace& place = options_.place;
  std::optional<OpenWorldScene> world;
  if (place.random) {
    const fs::path file = default_cache() / "worlds" /
                          fmt::format("{}-{}-{}", place.name, seed, place.density) / (place.name + ".sdf");
    auto found = simulation::find_open_world(*place.random, seed, place.density, file);
    if (!found) return found.error();
    if (!*found) {
      reason = "none of the 10 worlds of this seed has a way for a ball of 0.5 m";
      return std::optional<OpenWorldScene>();
    }
    world = std::move(*found);
  } else {
    auto own = own_world(place);
    if (!own) return own.error();
    world = std::move(own).value();
  }
  auto fitted = place.random && place.way ? shortened(std::move(*world), *place.way)
                                          : Result<OpenWorldScene>(std::move(*world));
  if (fitted) fitted = closed_loop::built_for(options_.chain.fault.kind, std::move(fitted).value());
  if (fitted) return std::optional(std::move(fitted).value());
  reason = fitted.error().message;
  return std::optional<OpenWorldScene>();
}

void Fleet::refuse(std::size_t index, const std::string& reason) {
  const std::scoped_lock lock(mutex_);
  flown_[index] = {{"seed", options_.seeds[index]}, {"reason", reason}};
}

fs::path Fleet::folder_of(std::uint64_t seed) const { return options_.out / std::to_string(seed); }

Status Fleet::fly_one(std::size_t index) {
  const std::uint64_t seed = options_.seeds[index];
  std::string reason;
  const auto world = world_of(seed, reason);
  if (!world) return world.error();
  if (!*world) {
    refuse(index, reason);
    return {};
  }
  const bool chain = options_.flier == Flier::chain;
  const FlightTask task{(*world)->scene, (*world)->surface, (*world)->start, (*world)->goal,
                        instrument_seed(options_.place, options_.chain.fault.kind, seed)};
  const auto& vehicle = chain ? options_.chain.planner.vehicle : options_.exact.planner.vehicle;
  if (const Status s = check_way(task, chain ? options_.chain.climb : 0, vehicle); !s) {
    refuse(index, s.error().message);
    return {};
  }
  const ordered_json identity = {{"seed", seed},
                                 {"instrument_seed", task.seed},
                                 {"world_attempt", (*world)->attempt + 1},
                                 {"world_fingerprint", simulation::world_fingerprint(task.scene.world())}};
  if (const Status s = find_flown(index, identity); !s) return s;
  return flown_[index].is_null() ? fly_with(index, task, identity) : Status();
}

Status Fleet::fly_with(std::size_t index, const FlightTask& task, const ordered_json& identity) {
  const bool writes = !options_.out.empty();
  const double radius = options_.flier == Flier::chain ? options_.chain.planner.vehicle.radius
                                                       : options_.exact.planner.vehicle.radius;
  const fs::path folder = folder_of(options_.seeds[index]);
  ordered_json flown = identity;
  const auto finish = [&](const ordered_json& measures, const auto& write) -> Status {
    flown.update(measures);
    const ordered_json whole = {{"made_of", made_of_}, {"flight", flown}};
    if (writes) {
      if (const Status s = write(whole); !s) return s;
    }
    const std::scoped_lock lock(mutex_);
    flown_[index] = flown;
    return {};
  };
  if (options_.flier != Flier::chain) {
    closed_loop::ExactFlightOptions exact = options_.exact;
    exact.known_start = free_about(task, 0, exact.known_start);
    auto record = options_.flier == Flier::exact
                      ? fly_exact(task, exact)
                      : Result<FlightRecord>(fly_straight(task, options_.exact.planner));
    if (!record) return record.error();
    report(index, 1);
    return finish(measures_of(task, *record, radius),
                  [&](const ordered_json& whole) { return write_flight(folder, whole, *record); });
  }
  FlightStrip strip;
  closed_loop::ChainFlightOptions options = options_.chain;
  options.known_start = free_about(task, options.climb, options.known_start);
  const auto record = fly_chain(task, options, [&](const ChainMoment& moment) {
    if (writes) strip.look(moment);
    return report(index, moment.done);
  });
  if (io::interrupted()) return {};  // whoever called knows
  if (!record) return record.error();
  return finish(measures_of(task, *record, radius, options.fault),
                [&](const ordered_json& whole) { return write_flight(folder, whole, task, *record, strip); });
}

/// Takes a flight that an earlier run has finished, if it was flown by this program with these options in
/// this world.
Status Fleet::find_flown(std::size_t index, const ordered_json& identity) {
  if (options_.out.empty() || options_.force) return {};
  const fs::path file = folder_of(options_.seeds[index]) / "flight.json";
  if (!io::path_exists(file)) return {};
  const auto text = io::read_file(file);
  if (!text) return text.error();
  const auto found = ordered_json::parse(*text, nullptr, false);
  const auto is_of_this = [&] {
    if (!found.is_object() || found.value("made_of", ordered_json()) != made_of_ || !found.contains("flight"))
      return false;
    const ordered_json& flight = found["flight"];
    return std::all_of(identity.items().begin(), identity.items().end(), [&](const auto& item) {
      return flight.value(item.key(), ordered_json()) == item.value();
    });
  };
  if (!is_of_this())
    return Error{
        fmt::format("{}: found a flight of other options, another world or another revision of the program, "
                    "expected one of this command or none (--force flies again)",
                    file.string())};
  flown_[index] = found["flight"];
  return {};
}

ordered_json summary_of(const Fleet& fleet) {
  ordered_json all = fleet.made_of();
  all["totals"] = totals_of(fleet.flown());
  all["refused"] = fleet.refused();
  all["flights"] = fleet.flown();
  return all;
}

std::optional<double> mean_of(const std::vector<ordered_json>& flown, const char* measure) {
  double sum = 0;
  int n = 0;
  for (const ordered_json& f : flown) {
    if (!f.contains(measure) || !f[measure].is_number()) continue;
    sum += f[measure].get<double>();
    ++n;
  }
  return n > 0 ? std::optional(sum / n) : std::nullopt;
}

ordered_json totals_of(const std::vector<ordered_json>& flown) {
  const auto n = flown.size();
  const auto count = [&](const auto& is) {
    return static_cast<std::size_t>(std::count_if(flown.begin(), flown.end(), is));
  };
  const auto share = [&](const auto& is) -> ordered_json {
    const std::size_t k = count(is);
    if (n == 0) return {{"flights", 0}, {"low", 0.0}, {"high", 1.0}};
    const evaluation::RateInterval interval = evaluation::clopper_pearson(k, n, 0.95);
    return {{"flights", k}, {"low", interval.low}, {"high", interval.high}};
  };
  const auto ended = [](Outcome outcome) {
    return [outcome](const ordered_json& f) { return f["outcome"] == to_name(outcome); };
  };
  const auto stands = [&](const ordered_json& f) {
    return ended(Outcome::timed_out)(f) && f["stands_at_the_end"] == true;
  };
  ordered_json totals = {
      {"flights", n},
      {"arrived", share(ended(Outcome::arrived))},
      {"collided", share(ended(Outcome::collided))},
      {"safe", share([&](const ordered_json& f) { return ended(Outcome::arrived)(f) || stands(f); })},
      {"timed out, standing", count(stands)}};
  for (const Outcome rest : {Outcome::timed_out, Outcome::astray, Outcome::never_ready})
    totals[std::string(to_name(rest))] = count(ended(rest));
  totals["straight_way_is_free"] =
      share([](const ordered_json& f) { return f["straight_way_is_free"] == true; });
  totals["fault_not_met"] = count([](const ordered_json& f) { return f.value("fault_seconds", 1.0) <= 0; });
  std::vector<ordered_json> arrived;
  std::copy_if(flown.begin(), flown.end(), std::back_inserter(arrived), ended(Outcome::arrived));
  const auto or_null = [](const std::optional<double>& value) {
    return value ? ordered_json(*value) : ordered_json();
  };
  totals["mean_goal_velocity_m_s"] = or_null(mean_of(flown, "goal_velocity_m_s"));
  totals["mean_goal_velocity_of_arrived_m_s"] = or_null(mean_of(arrived, "goal_velocity_m_s"));
  return totals;
}

}  // namespace pade::cli

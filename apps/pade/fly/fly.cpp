// `pade fly`: closed-loop flights through worlds without lanes.
#include <algorithm>
#include <atomic>
#include <charconv>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pade/core/result.hpp"
#include "pade/core/version.hpp"

#include "../commands.hpp"

#ifdef PADE_HAS_SIMULATION
#include "pade/closed_loop/exact_flight.hpp"
#include "pade/io/atomic_output.hpp"
#include "pade/io/options_json.hpp"
#include "pade/io/text.hpp"
#include "pade/simulation/generator/open_world_scene.hpp"

#include "../cache.hpp"
#include "../progress.hpp"
#endif

namespace pade::cli {
namespace {

struct FlyArguments {
  std::string random;
  std::string seeds = "1";
  std::string out;
  double density = 400;
  double speed = 2;
  int width = 640;
  int threads = 1;
  bool unknown_is_free = false;
  bool json = false;
  bool force = false;
};

#ifdef PADE_HAS_SIMULATION

namespace fs = std::filesystem;
using namespace pade::closed_loop;
using namespace pade::simulation;

/// "7" or "101-150".
std::optional<std::vector<std::uint64_t>> parse_seeds(const std::string& text) {
  const auto number = [](std::string_view part) -> std::optional<std::uint64_t> {
    std::uint64_t value = 0;
    const auto [end, failed] = std::from_chars(part.data(), part.data() + part.size(), value);
    if (failed != std::errc() || end != part.data() + part.size()) return std::nullopt;
    return value;
  };
  const std::size_t dash = text.find('-');
  const auto first = number(std::string_view(text).substr(0, dash));
  const auto last = dash == std::string::npos ? first : number(std::string_view(text).substr(dash + 1));
  if (!first || !last || *last < *first || *last - *first >= 100000) return std::nullopt;
  std::vector<std::uint64_t> seeds;
  for (std::uint64_t seed = *first; seed <= *last; ++seed) seeds.push_back(seed);
  return seeds;
}

std::string track_csv(const FlightRecord& record) {
  std::string text = "# frame=ENU\nt_s,x,y,z,vx,vy,vz,yaw_rad,clearance_m\n";
  for (std::size_t i = 0; i < record.samples.size(); i += 5) {
    const FlightSample& s = record.samples[i];
    const Eigen::Vector3d& p = s.state.position;
    const Eigen::Vector3d& v = s.state.velocity;
    text += fmt::format("{:.2f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f}\n", s.state.time,
                        p.x(), p.y(), p.z(), v.x(), v.y(), v.z(), s.state.yaw, s.clearance);
  }
  return text;
}

std::string plans_csv(const FlightRecord& record) {
  constexpr std::array names = {"flying", "committed", "recovering", "arrived"};
  std::string text = "t_s,plan,valid,speed_limit_m_s,free_reach_m\n";
  for (const FlightPlan& p : record.plans)
    text += fmt::format("{:.2f},{},{},{:.3f},{:.3f}\n", p.time, names[static_cast<std::size_t>(p.kind)],
                        p.valid, p.speed_limit, p.free_reach);
  return text;
}

/// Whether the ball of the vehicle, flown straight from start to goal, touches nothing.
bool straight_way_is_free(const OpenWorldScene& world, double radius) {
  const Eigen::Vector3d way = world.goal - world.start;
  const int steps = static_cast<int>(way.norm() / 0.02);
  for (int i = 0; i <= steps; ++i) {
    if (world.surface.touches(world.start + way * (static_cast<double>(i) / steps), radius)) return false;
  }
  return true;
}

nlohmann::ordered_json summary(std::uint64_t seed, const OpenWorldScene& world, const FlightRecord& r,
                               double radius) {
  return {{"seed", seed},
          {"attempt", world.attempt + 1},
          {"outcome", to_name(r.outcome)},
          {"duration_s", r.duration},
          {"length_m", r.length},
          {"goal_velocity_m_s", r.goal_velocity},
          {"least_clearance_m", r.least_clearance},
          {"stops", r.stops},
          {"straight_way_is_free", straight_way_is_free(world, radius)}};
}

/// Flights of one kind, one a seed. With a folder each is written when it is done, and kept by the next run.
class Fleet {
 public:
  Fleet(const FlyArguments& arguments, OpenWorldKind kind, std::vector<std::uint64_t> seeds)
      : arguments_(arguments), kind_(kind), seeds_(std::move(seeds)), flown_(seeds_.size()) {
    options_.planner.vehicle.speed = arguments.speed;
    options_.planner.unknown_is_free = arguments.unknown_is_free;
    options_.width = arguments.width;
    made_of_ = {{"made_by", fmt::format("pade {} fly", version)},
                {"world", arguments.random},
                {"density_per_ha", arguments.density},
                {"options", nlohmann::ordered_json::parse(io::to_json(options_))}};
  }

  Status fly() {
    Progress line("Flying", seeds_.size());
    line_ = &line;
    {
      std::vector<std::jthread> helpers;
      for (int i = 1; i < arguments_.threads; ++i) helpers.emplace_back([this] { take_flights(); });
      take_flights();
    }
    return failure_;
  }
  [[nodiscard]] const std::vector<nlohmann::ordered_json>& flown() const { return flown_; }
  [[nodiscard]] const nlohmann::ordered_json& made_of() const { return made_of_; }

 private:
  void take_flights() {
    for (std::size_t i = next_++; i < seeds_.size(); i = next_++) {
      const Status status = fly_one(i);
      const std::scoped_lock lock(mutex_);
      if (!status && failure_.ok()) failure_ = status;
      if (!status || io::interrupted()) next_ = seeds_.size();
      line_->step();
    }
  }
  Status fly_one(std::size_t index) {
    const std::uint64_t seed = seeds_[index];
    if (const Status s = find_flown(index); !s) return s;
    if (!flown_[index].is_null()) return {};
    std::optional<Result<OpenWorldScene>> world;
    {
      const std::scoped_lock lock(mutex_);  // libsdformat keeps its callbacks globally
      const fs::path file = default_cache() / "worlds" /
                            fmt::format("{}-{}-{}", arguments_.random, seed, arguments_.density) /
                            (arguments_.random + ".sdf");
      world = make_open_world(kind_, seed, arguments_.density, file);
    }
    if (!*world) return world->error();
    const OpenWorldScene& made = **world;
    const auto record = fly_exact({made.scene, made.surface, made.start, made.goal}, options_);
    if (!record) return record.error();
    flown_[index] = summary(seed, made, *record, options_.planner.vehicle.radius);
    return write(seed, *record, flown_[index]);
  }
  [[nodiscard]] fs::path file_of(std::string_view what, std::uint64_t seed, std::string_view ending) const {
    return fs::path(arguments_.out) / fmt::format("{}-{}.{}", what, seed, ending);
  }
  /// Takes a flight that an earlier run has finished.
  Status find_flown(std::size_t index) {
    if (arguments_.out.empty() || arguments_.force) return {};
    const fs::path file = file_of("flight", seeds_[index], "json");
    if (!io::path_exists(file)) return {};
    const auto text = io::read_file(file);
    if (!text) return text.error();
    const auto found = nlohmann::ordered_json::parse(*text, nullptr, false);
    if (!found.is_object() || found.value("made_of", nlohmann::ordered_json()) != made_of_ ||
        !found.contains("flight"))
      return Error{
          fmt::format("{}: found a flight of other options, expected one of this command or none (--force "
                      "flies again)",
                      file.string())};
    flown_[index] = found["flight"];
    return {};
  }
  /// The flight's own file last: where it is, the flight is finished.
  [[nodiscard]] Status write(std::uint64_t seed, const FlightRecord& record,
                             const nlohmann::ordered_json& flight) const {
    if (arguments_.out.empty()) return {};
    const nlohmann::ordered_json whole = {{"made_of", made_of_}, {"flight", flight}};
    for (const auto& [file, text] : {std::pair{file_of("track", seed, "csv"), track_csv(record)},
                                     std::pair{file_of("plans", seed, "csv"), plans_csv(record)},
                                     std::pair{file_of("flight", seed, "json"), whole.dump(2) + "\n"}}) {
      if (const Status s = io::write_file(file, text, io::Overwrite::replace); !s) return s;
    }
    return {};
  }

  const FlyArguments& arguments_;
  OpenWorldKind kind_;
  std::vector<std::uint64_t> seeds_;
  std::vector<nlohmann::ordered_json> flown_;
  ExactFlightOptions options_;
  nlohmann::ordered_json made_of_;
  std::atomic<std::size_t> next_ = 0;
  std::mutex mutex_;
  Status failure_;
  Progress* line_ = nullptr;
};

using Flights = std::vector<nlohmann::ordered_json>;

void print_table(const Flights& all) {
  fmt::print("{:>6} {:<10} {:>7} {:>7} {:>7} {:>10} {:>6}  {}\n", "seed", "outcome", "s", "m", "m/s",
             "clearance", "stops", "straight way");
  for (const auto& f : all)
    fmt::print("{:>6} {:<10} {:>7.1f} {:>7.1f} {:>7.2f} {:>10.2f} {:>6}  {}\n",
               f["seed"].get<std::uint64_t>(), f["outcome"].get<std::string>(), f["duration_s"].get<double>(),
               f["length_m"].get<double>(), f["goal_velocity_m_s"].get<double>(),
               f["least_clearance_m"].get<double>(), f["stops"].get<int>(),
               f["straight_way_is_free"].get<bool>() ? "free" : "blocked");
}

nlohmann::ordered_json totals(const Flights& all) {
  const auto count = [&](Outcome outcome) {
    return std::count_if(all.begin(), all.end(),
                         [&](const auto& f) { return f["outcome"] == to_name(outcome); });
  };
  double velocity = 0;
  for (const auto& f : all)
    velocity += f["goal_velocity_m_s"].template get<double>() / static_cast<double>(all.size());
  return {{"flights", all.size()},
          {"arrived", count(Outcome::arrived)},
          {"collided", count(Outcome::collided)},
          {"timed_out", count(Outcome::timed_out)},
          {"straight_way_is_free",
           std::count_if(all.begin(), all.end(),
                         [](const auto& f) { return f["straight_way_is_free"] == true; })},
          {"mean_goal_velocity_m_s", velocity}};
}

Status make_folder(const fs::path& folder) {
  std::error_code failed;
  fs::create_directories(folder, failed);
  if (failed) return Error{fmt::format("{}: cannot be made: {}", folder.string(), failed.message())};
  return {};
}

Status fly(const FlyArguments& arguments) {
  const auto kind = from_name<OpenWorldKind>(arguments.random);
  if (!kind)
    return Error{fmt::format("--random: found '{}', expected forest, rubble, building-site or street",
                             arguments.random)};
  auto seeds = parse_seeds(arguments.seeds);
  if (!seeds)
    return Error{
        fmt::format("--seed: found '{}', expected a number or a range such as 1-50", arguments.seeds)};
  if (!arguments.out.empty()) {
    if (const Status s = make_folder(arguments.out); !s) return s;
  }
  Fleet fleet(arguments, *kind, std::move(*seeds));
  if (const Status s = fleet.fly(); !s) return s;
  if (io::interrupted()) return Error{"interrupted; with --out the flights that are finished are kept"};
  nlohmann::ordered_json all = fleet.made_of();
  all["totals"] = totals(fleet.flown());
  all["flights"] = fleet.flown();
  const std::string text = all.dump(2) + "\n";
  if (!arguments.out.empty()) {
    if (const Status s =
            io::write_file(fs::path(arguments.out) / "flights.json", text, io::Overwrite::replace);
        !s)
      return s;
  }
  if (arguments.json) {
    fmt::print("{}", text);
    return {};
  }
  print_table(fleet.flown());
  const nlohmann::ordered_json& sum = all["totals"];
  fmt::print(
      "{} flights: {} arrived, {} collided, {} timed out; mean goal velocity {:.2f} m/s; straight way free "
      "in {}\n",
      sum["flights"].get<std::size_t>(), sum["arrived"].get<long>(), sum["collided"].get<long>(),
      sum["timed_out"].get<long>(), sum["mean_goal_velocity_m_s"].get<double>(),
      sum["straight_way_is_free"].get<long>());
  return {};
}

#else

Status fly(const FlyArguments&) {
  return Error{"this build has no simulator to fly in (pade simulate says what is missing)"};
}

#endif

}  // namespace

void add_fly(CLI::App& app, Context& context) {
  auto* command = app.add_subcommand(
      "fly", "Fly through random worlds in a closed loop: the local planner on a map of exact depth");
  command->footer(
      "Examples:\n"
      "  pade fly --random forest --seed 7\n"
      "  pade fly --random forest --density 400 --seed 101-150 --threads 2 -o flights\n"
      "docs/fly.md: what is flown, and what came of it.");
  auto arguments = std::make_shared<FlyArguments>();
  command->add_option("--random", arguments->random, "the world: forest, rubble, building-site or street")
      ->required();
  command
      ->add_option("--seed", arguments->seeds,
                   "of the world; a range such as 101-150 flies one after the other")
      ->capture_default_str();
  command->add_option("--density", arguments->density, "obstacles per hectare")->capture_default_str();
  command->add_option("--speed", arguments->speed, "greatest speed, m/s")
      ->check(CLI::Range(0.3, 20.0))
      ->capture_default_str();
  command->add_option("--width", arguments->width, "of the depth image, px")
      ->check(CLI::Range(32, 4096))
      ->capture_default_str();
  command->add_flag("--unknown-is-free", arguments->unknown_is_free, "fly into what has not been seen");
  command->add_option(
      "--out,-o", arguments->out,
      "folder of flights.json, and of track and plans of each flight as CSV; flights that it holds are kept");
  command
      ->add_option("--threads", arguments->threads,
                   "flights side by side; the result is the same for any number")
      ->check(CLI::Range(1, 256))
      ->capture_default_str();
  command->add_flag("--json", arguments->json, "print flights.json instead of the table");
  command->add_flag("--force", arguments->force, "fly again what the folder holds already");
  command->callback([arguments, &context] {
#ifdef PADE_HAS_SIMULATION
    io::watch_for_interrupts();
#endif
    if (const Status status = fly(*arguments); !status) {
      fmt::print(stderr, "pade fly: {}\n", status.error().message);
      context.exit_code = 1;
#ifdef PADE_HAS_SIMULATION
      if (io::interrupted()) context.exit_code = 130;
#endif
    }
  });
}

}  // namespace pade::cli

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

#include "../commands.hpp"

#ifdef PADE_HAS_SIMULATION
#include "pade/closed_loop/exact_flight.hpp"
#include "pade/io/atomic_output.hpp"
#include "pade/io/options_json.hpp"
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

struct Flown {
  std::uint64_t seed = 0;
  int attempt = 0;
  FlightRecord record;
};

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

nlohmann::ordered_json summary(const Flown& flown) {
  const FlightRecord& r = flown.record;
  return {{"seed", flown.seed},
          {"attempt", flown.attempt + 1},
          {"outcome", to_name(r.outcome)},
          {"duration_s", r.duration},
          {"length_m", r.length},
          {"goal_velocity_m_s", r.goal_velocity},
          {"least_clearance_m", r.least_clearance},
          {"stops", r.stops}};
}

class Fleet {
 public:
  Fleet(const FlyArguments& arguments, OpenWorldKind kind, std::vector<std::uint64_t> seeds)
      : arguments_(arguments), kind_(kind), seeds_(std::move(seeds)), flown_(seeds_.size()) {
    options_.planner.vehicle.speed = arguments.speed;
    options_.planner.unknown_is_free = arguments.unknown_is_free;
    options_.width = arguments.width;
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
  [[nodiscard]] const std::vector<Flown>& flown() const { return flown_; }
  [[nodiscard]] const ExactFlightOptions& options() const { return options_; }

 private:
  void take_flights() {
    for (std::size_t i = next_++; i < seeds_.size(); i = next_++) {
      Status status = fly_one(i);
      const std::scoped_lock lock(mutex_);
      if (!status && failure_.ok()) failure_ = status;
      if (!status || io::interrupted()) next_ = seeds_.size();
      line_->step();
    }
  }
  Status fly_one(std::size_t index) {
    const std::uint64_t seed = seeds_[index];
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
    auto record = fly_exact({made.scene, made.surface, made.start, made.goal}, options_);
    if (!record) return record.error();
    flown_[index] = {seed, made.attempt, std::move(record).value()};
    return {};
  }

  const FlyArguments& arguments_;
  OpenWorldKind kind_;
  std::vector<std::uint64_t> seeds_;
  std::vector<Flown> flown_;
  ExactFlightOptions options_;
  std::atomic<std::size_t> next_ = 0;
  std::mutex mutex_;
  Status failure_;
  Progress* line_ = nullptr;
};

void print_table(const std::vector<Flown>& all) {
  fmt::print("{:>6} {:<10} {:>7} {:>7} {:>9} {:>10} {:>6}\n", "seed", "outcome", "s", "m", "m/s", "clearance",
             "stops");
  for (const Flown& f : all)
    fmt::print("{:>6} {:<10} {:>7.1f} {:>7.1f} {:>9.2f} {:>10.2f} {:>6}\n", f.seed, to_name(f.record.outcome),
               f.record.duration, f.record.length, f.record.goal_velocity, f.record.least_clearance,
               f.record.stops);
}

nlohmann::ordered_json totals(const std::vector<Flown>& all) {
  const auto count = [&](Outcome outcome) {
    return std::count_if(all.begin(), all.end(), [&](const Flown& f) { return f.record.outcome == outcome; });
  };
  double velocity = 0;
  for (const Flown& f : all) velocity += f.record.goal_velocity / static_cast<double>(all.size());
  return {{"flights", all.size()},
          {"arrived", count(Outcome::arrived)},
          {"collided", count(Outcome::collided)},
          {"timed_out", count(Outcome::timed_out)},
          {"mean_goal_velocity_m_s", velocity}};
}

Status write_run(const fs::path& folder, const std::vector<Flown>& all, const std::string& json, bool force) {
  const io::Overwrite overwrite = force ? io::Overwrite::replace : io::Overwrite::refuse;
  std::error_code failed;
  fs::create_directories(folder, failed);
  if (failed) return Error{fmt::format("{}: cannot be made: {}", folder.string(), failed.message())};
  for (const Flown& f : all) {
    if (const Status s =
            io::write_file(folder / fmt::format("track-{}.csv", f.seed), track_csv(f.record), overwrite);
        !s)
      return s;
    if (const Status s =
            io::write_file(folder / fmt::format("plans-{}.csv", f.seed), plans_csv(f.record), overwrite);
        !s)
      return s;
  }
  return io::write_file(folder / "flights.json", json, overwrite);
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
  Fleet fleet(arguments, *kind, std::move(*seeds));
  if (const Status s = fleet.fly(); !s) return s;
  if (io::interrupted()) return Error{"interrupted, nothing was written"};
  nlohmann::ordered_json flights = nlohmann::ordered_json::array();
  for (const Flown& f : fleet.flown()) flights.push_back(summary(f));
  const nlohmann::ordered_json all = {
      {"world", arguments.random},
      {"density_per_ha", arguments.density},
      {"options", nlohmann::ordered_json::parse(io::to_json(fleet.options()))},
      {"totals", totals(fleet.flown())},
      {"flights", flights}};
  const std::string text = all.dump(2) + "\n";
  if (!arguments.out.empty()) {
    if (const Status s = write_run(arguments.out, fleet.flown(), text, arguments.force); !s) return s;
  }
  if (arguments.json) {
    fmt::print("{}", text);
  } else {
    print_table(fleet.flown());
    const nlohmann::ordered_json sum = totals(fleet.flown());
    fmt::print("{} flights: {} arrived, {} collided, {} timed out; mean goal velocity {:.2f} m/s\n",
               sum["flights"].get<std::size_t>(), sum["arrived"].get<long>(), sum["collided"].get<long>(),
               sum["timed_out"].get<long>(), sum["mean_goal_velocity_m_s"].get<double>());
  }
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
  command->add_option("--out,-o", arguments->out,
                      "folder of flights.json, and of track and plans of each flight as CSV");
  command
      ->add_option("--threads", arguments->threads,
                   "flights side by side; the result is the same for any number")
      ->check(CLI::Range(1, 256))
      ->capture_default_str();
  command->add_flag("--json", arguments->json, "print flights.json instead of the table");
  command->add_flag("--force", arguments->force, "replace existing files");
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

// `pade fly`: closed-loop flights through worlds without lanes.
#include <charconv>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pade/core/result.hpp"

#include "../commands.hpp"

#ifdef PADE_HAS_SIMULATION
#include "pade/core/option_check.hpp"
#include "pade/io/atomic_output.hpp"
#include "pade/io/options_json.hpp"
#include "pade/io/text.hpp"
#include "pade/io/yaml.hpp"
#include "pade/offline/depth_from.hpp"

#include "../enum_option.hpp"
#include "../progress.hpp"
#include "fleet.hpp"
#include "flight_files.hpp"
#endif

namespace pade::cli {
namespace {

struct FlyArguments {
  std::string world;
  std::string random;
  std::string seeds = "1";
  std::string start, goal;
  std::string config;
  std::string out;
  std::string depth = "multi-view";
  std::string fault = "none";
  std::optional<double> density;
  std::optional<double> way;
  std::optional<double> speed;
  std::optional<int> width;
  int threads = 1;
  bool unknown_is_free = false;
  bool no_peering = false;
  bool no_refinement = false;
  bool json = false;
  bool force = false;
};

#ifdef PADE_HAS_SIMULATION

namespace fs = std::filesystem;
using nlohmann::ordered_json;
using namespace closed_loop;  // NOLINT: the file is about nothing else

/// "7" or "101-150".
Result<std::vector<std::uint64_t>> parse_seeds(const std::string& text) {
  const auto number = [](std::string_view part) -> std::optional<std::uint64_t> {
    std::uint64_t value = 0;
    const auto [end, failed] = std::from_chars(part.data(), part.data() + part.size(), value);
    if (failed != std::errc() || end != part.data() + part.size()) return std::nullopt;
    return value;
  };
  const std::size_t dash = text.find('-');
  const auto first = number(std::string_view(text).substr(0, dash));
  const auto last = dash == std::string::npos ? first : number(std::string_view(text).substr(dash + 1));
  if (!first || !last || *last < *first || *last - *first >= 100000)
    return Error{fmt::format("--seed: found '{}', expected a number or a range such as 1-50", text)};
  std::vector<std::uint64_t> seeds;
  for (std::uint64_t i = 0; i <= *last - *first; ++i) seeds.push_back(*first + i);
  return seeds;
}

/// "1,2,3".
Result<Eigen::Vector3d> parse_point(const std::string& option, const std::string& text) {
  Eigen::Vector3d point;
  const char* at = text.data();
  const char* const end = text.data() + text.size();
  for (int i = 0; i < 3; ++i) {
    const auto [next, failed] = std::from_chars(at, end, point[i]);
    const bool more = i < 2;
    if (failed != std::errc() || !std::isfinite(point[i]) ||
        (more ? next == end || *next != ',' : next != end))
      return Error{fmt::format("{}: found '{}', expected three numbers such as 0,0,1.6 (m)", option, text)};
    at = next + (more ? 1 : 0);
  }
  return point;
}

Result<FlightPlace> place_of(const FlyArguments& arguments) {
  FlightPlace place;
  if (arguments.density) place.density = *arguments.density;
  place.way = arguments.way;
  if (place.way && !std::isfinite(*place.way))
    return Error{fmt::format("--way: found {}, expected 5 to 60 m", *place.way)};
  if (arguments.world.empty() == arguments.random.empty())
    return Error{"found both or neither of WORLD and --random, expected one of them"};
  if (!arguments.random.empty()) {
    place.name = arguments.random;
    place.random = from_name<simulation::OpenWorldKind>(arguments.random);
    if (!place.random)
      return Error{fmt::format("--random: found '{}', expected forest, rubble, building-site or street",
                               arguments.random)};
    if (!arguments.start.empty() || !arguments.goal.empty())
      return Error{"--start and --goal: found with --random, whose worlds have a start and a goal"};
    return place;
  }
  if (arguments.way) return Error{"--way: found with a world of your own, whose --goal says how far it is"};
  if (arguments.density)
    return Error{"--density: found with a world of your own, expected --random, whose worlds have one"};
  place.file = arguments.world;
  place.name = place.file.stem().string();
  const auto start = parse_point("--start", arguments.start);
  if (!start) return start.error();
  const auto goal = parse_point("--goal", arguments.goal);
  if (!goal) return goal.error();
  place.start = *start;
  place.goal = *goal;
  return place;
}

Result<Flier> flier_of(const FlyArguments& arguments) {
  if (arguments.depth == "exact") return Flier::exact;
  if (arguments.depth == "none") return Flier::straight;
  if (from_name<DepthFrom>(arguments.depth)) return Flier::chain;
  return Error{fmt::format("--depth: found '{}', expected multi-view, two-view, pade, ttc, exact or none",
                           arguments.depth)};
}

/// What the command line says goes before what the file says.
Status set_chain(const FlyArguments& arguments, ChainFlightOptions& chain) {
  if (!arguments.config.empty()) {
    const auto text = io::read_file(arguments.config);
    if (!text) return text.error();
    if (Status s = io::from_yaml(*text, arguments.config, chain); !s) return s;
  }
  if (const auto from = from_name<DepthFrom>(arguments.depth)) choose_depth(*from, chain.mapper);
  const auto fault = from_name<Fault>(arguments.fault);
  if (!fault) {
    std::string names;
    for (const auto& entry : EnumNames<Fault>::names) names += fmt::format(" {}", entry.second);
    return Error{fmt::format("--fault: found '{}', expected one of{}", arguments.fault, names)};
  }
  if (*fault != Fault::none) chain.fault.kind = *fault;
  if (arguments.speed) chain.planner.vehicle.speed = *arguments.speed;
  if (arguments.width) chain.width = *arguments.width;
  if (arguments.unknown_is_free) chain.planner.unknown_is_free = true;
  if (arguments.no_peering) chain.planner.peering = false;
  if (arguments.no_refinement) {
    chain.mapper.refinement.on = false;
    chain.mapper.alignment.on = false;
  }
  return {};
}

/// Options that would change nothing.
Status check_use(const FlyArguments& arguments, Flier flier) {
  const auto refuse = [&](const char* option, const char* what) -> Status {
    return Error{fmt::format("{}: found with --depth {}, which has no {}", option, arguments.depth, what)};
  };
  if (flier != Flier::chain && arguments.no_refinement)
    return refuse("--no-refinement", "motion that images could refine");
  if (flier != Flier::straight) return {};
  if (arguments.width) return refuse("--width", "image");
  if (arguments.unknown_is_free) return refuse("--unknown-is-free", "planner");
  if (arguments.no_peering) return refuse("--no-peering", "planner");
  return {};
}

Result<FleetOptions> fleet_options(const FlyArguments& arguments) {
  FleetOptions options;
  auto place = place_of(arguments);
  if (!place) return place.error();
  auto seeds = parse_seeds(arguments.seeds);
  if (!seeds) return seeds.error();
  const auto flier = flier_of(arguments);
  if (!flier) return flier.error();
  options.place = *place;
  options.seeds = *seeds;
  options.flier = *flier;
  options.out = arguments.out;
  options.threads = arguments.threads;
  options.force = arguments.force;
  if (const Status s = set_chain(arguments, options.chain); !s) return s.error();
  if (options.flier != Flier::chain && (options.chain.fault.kind != Fault::none || !arguments.config.empty()))
    return Error{
        fmt::format("--fault and --config: found with --depth {}, which has no chain that they could change",
                    arguments.depth)};
  if (const Status s = check_use(arguments, options.flier); !s) return s.error();
  options.exact.planner = options.chain.planner;
  if (const Status s = within("planner", planning::check(options.exact.planner)); !s) return s.error();
  if (arguments.width) options.exact.width = *arguments.width;
  return options;
}

void print_table(const std::vector<ordered_json>& all) {
  fmt::print("{:>6} {:<10} {:>7} {:>7} {:>7} {:>10} {:>6} {:>6}  {}\n", "seed", "outcome", "s", "m", "m/s",
             "clearance", "stops", "blind", "straight way");
  for (const auto& f : all)
    fmt::print("{:>6} {:<10} {:>7.1f} {:>7.1f} {:>7.2f} {:>10.2f} {:>6} {:>6.1f}  {}\n",
               f["seed"].get<std::uint64_t>(), f["outcome"].get<std::string>(), f["duration_s"].get<double>(),
               f["length_m"].get<double>(), f["goal_velocity_m_s"].get<double>(),
               f["least_clearance_m"].get<double>(), f["stops"].get<int>(), f.value("seconds_blind", 0.0),
               f["straight_way_is_free"].get<bool>() ? "free" : "blocked");
}

void print_totals(const ordered_json& totals) {
  const auto share = [&](const char* name) {
    const ordered_json& t = totals[name];
    return fmt::format("{} ({:.0f}-{:.0f} %)", t["flights"].get<std::size_t>(), 100 * t["low"].get<double>(),
                       100 * t["high"].get<double>());
  };
  const ordered_json& velocity = totals["mean_goal_velocity_of_arrived_m_s"];
  fmt::print(
      "{} {}: {} arrived, {} collided (95 % intervals); mean goal velocity of those that arrived {}; "
      "straight way free in {}\n",
      totals["flights"].get<std::size_t>(), totals["flights"] == 1 ? "flight" : "flights", share("arrived"),
      share("collided"), velocity.is_null() ? "-" : fmt::format("{:.2f} m/s", velocity.get<double>()),
      totals["straight_way_is_free"]["flights"].get<std::size_t>());
}

Status fly(const FlyArguments& arguments) {
  auto options = fleet_options(arguments);
  if (!options) return options.error();
  if (!arguments.out.empty()) {
    std::error_code failed;
    fs::create_directories(arguments.out, failed);
    if (failed) return Error{fmt::format("{}: cannot be made: {}", arguments.out, failed.message())};
  }
  const std::size_t flights = options->seeds.size();
  Fleet fleet(std::move(*options));
  Progress line("Flying", flights);
  if (const Status s = fleet.fly([&](std::size_t done, const std::string& note) { line.show(done, note); });
      !s)
    return s;
  if (io::interrupted()) return Error{"interrupted; with --out the flights that are finished are kept"};
  for (const ordered_json& r : fleet.refused()) {
    const auto reason = r["reason"].get<std::string>();
    if (fleet.flown().empty()) return Error{reason};
    fmt::print(stderr, "pade fly: warning: no flight with seed {}: {}\n", r["seed"].get<std::uint64_t>(),
               reason);
  }
  const ordered_json all = summary_of(fleet);
  const std::string text = all.dump(2) + "\n";
  if (!arguments.out.empty()) {
    const fs::path out = arguments.out;
    if (const Status s = io::write_file(out / "flights.json", text, io::Overwrite::replace); !s) return s;
    if (const Status s = io::write_file(out / "report.html", fleet_page(all), io::Overwrite::replace); !s)
      return s;
  }
  if (arguments.json) {
    fmt::print("{}", text);
    return {};
  }
  print_table(fleet.flown());
  print_totals(all["totals"]);
  return {};
}

#else

Status fly(const FlyArguments&) {
  return Error{"this build has no simulator to fly in (pade simulate says what is missing)"};
}

#endif

void add_options(CLI::App& command, FlyArguments& a) {
  command.add_option("world", a.world, "a world of your own (SDF), with --start and --goal");
  command.add_option("--random", a.random, "a world from a seed: forest, rubble, building-site or street");
  command
      .add_option("--seed", a.seeds,
                  "of the world and the instruments; a range such as 101-150 flies one after the other")
      ->capture_default_str();
  command.add_option("--density", a.density, "of a random world, obstacles per hectare (default 400)");
  command.add_option("--way", a.way, "how far away the goal of a random world is, m (default 60)")
      ->check(CLI::Range(5.0, 60.0));
  command.add_option("--start", a.start, "x,y,z where the way begins, m");
  command.add_option("--goal", a.goal, "x,y,z where it ends, m");
  command
      .add_option(
          "--depth", a.depth,
          "multi-view, two-view, pade or ttc: the whole chain; exact: the planner alone, on exact depth and "
          "pose; none: straight on with closed eyes")
      ->capture_default_str();
  command.add_option("--fault", a.fault, "what goes wrong on purpose (docs/fly.md lists the faults)")
      ->capture_default_str();
  command.add_option("--config", a.config,
                     "YAML file of the vehicle and of all stages; names as in flights.json");
  command.add_option("--speed", a.speed, "greatest speed, m/s (default 2)")->check(CLI::Range(0.3, 20.0));
  command.add_option("--width", a.width, "of the image, px (default 640; exact: 320)")
      ->check(CLI::Range(64, 4096));
  command.add_flag("--unknown-is-free", a.unknown_is_free, "fly into what has not been seen");
  command.add_flag("--no-peering", a.no_peering, "never swing to the sides to see what lies straight ahead");
  command.add_flag("--no-refinement", a.no_refinement,
                   "the motion is that of GPS/INS, not refined by the images");
  command.add_option(
      "--out,-o", a.out,
      "folder of flights.json, report.html and a folder per flight; flights that it holds are kept");
  command.add_option("--threads", a.threads, "flights side by side; the result is the same for any number")
      ->check(CLI::Range(1, 256))
      ->capture_default_str();
  command.add_flag("--json", a.json, "print flights.json instead of the table");
  command.add_flag("--force", a.force, "fly again what the folder holds already");
}

}  // namespace

void add_fly(CLI::App& app, Context& context) {
  auto* command = app.add_subcommand(
      "fly",
      "Fly through a world in a closed loop: images and instruments to navigation, depth, map, plan, motion");
  command->footer(
      "Examples:\n"
      "  pade fly --random forest --seed 7 -o flights\n"
      "  pade fly --random rubble --seed 101-130 --threads 2 -o flights\n"
      "  pade fly --random forest --seed 7 --fault gnss-outage\n"
      "  pade fly world.sdf --start 0,0,1.6 --goal 40,3,1.6 --depth exact\n"
      "docs/fly.md: what is flown, and what came of it.");
  auto arguments = std::make_shared<FlyArguments>();
  add_options(*command, *arguments);
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

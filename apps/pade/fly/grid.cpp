#include "grid.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "pade/io/atomic_output.hpp"
#include "pade/io/text.hpp"
#include "pade/offline/depth_from.hpp"
#include "pade/paper/verdicts/flight_verdict.hpp"

#include "../progress.hpp"
#include "fleet.hpp"
#include "flight_files.hpp"
#include "grid_timing.hpp"

namespace pade::cli {
namespace {

namespace fs = std::filesystem;
using closed_loop::Fault;
using nlohmann::ordered_json;
using simulation::OpenWorldKind;

constexpr std::uint64_t kFirstSeed = 201;  // no flight of this or any later one was seen before the grid
constexpr double kFaultWay = 25;           // m
constexpr double kQuickWay = 20;           // m
constexpr int kWorlds = 3;
constexpr std::array kKinds = {OpenWorldKind::forest, OpenWorldKind::rubble, OpenWorldKind::building_site};
using Seeds = std::array<int, kWorlds>;  // how many in each world
constexpr Seeds kMany = {40, 30, 30};
constexpr Seeds kFew = {8, 6, 6};
constexpr Seeds kForests = {20, 0, 0};
constexpr Seeds kQuick = {2, 2, 2};

/// One row of the table per world that it has flights in.
struct Configuration {
  std::string name;
  Seeds seeds;
  double density = 400;
  std::optional<double> way;
};

std::vector<Configuration> all_configurations() {
  std::vector<Configuration> all = {{"chain", kMany, 400, {}},
                                    {"exact", kMany, 400, {}},
                                    {"straight", kMany, 400, {}},
                                    {"density-200", kForests, 200, {}},
                                    {"density-800", kForests, 800, {}}};
  for (const char* name : {"unknown-is-free", "no-peering", "no-refinement", "two-view", "pade", "ttc"})
    all.push_back({name, kFew, 400, {}});
  for (const auto& [fault, name] : EnumNames<Fault>::names) {
    if (fault != Fault::none) all.push_back({std::string(name), kFew, 400, kFaultWay});
  }
  return all;
}

void set_flier(const std::string& name, FleetOptions& options) {
  if (name == "exact") options.flier = Flier::exact;
  if (name == "straight") options.flier = Flier::straight;
  if (name == "unknown-is-free") options.chain.planner.unknown_is_free = true;
  if (name == "no-peering") options.chain.planner.peering = false;
  if (name == "no-refinement") options.chain.mapper.refinement.on = options.chain.mapper.alignment.on = false;
  if (const auto from = from_name<DepthFrom>(name)) choose_depth(*from, options.chain.mapper);
  if (const auto fault = from_name<Fault>(name)) options.chain.fault.kind = *fault;
  options.exact.planner = options.chain.planner;
}

/// The flights of one configuration in one kind of world.
struct Cell {
  const Configuration* configuration = nullptr;
  FleetOptions fleet;
};

std::vector<Cell> cells_of(const std::vector<Configuration>& configurations, const GridOptions& options) {
  std::vector<Cell> cells;
  for (const Configuration& configuration : configurations) {
    for (std::size_t i = 0; i < kKinds.size(); ++i) {
      Cell cell{&configuration, {}};
      FleetOptions& fleet = cell.fleet;
      fleet.place.random = kKinds[i];
      fleet.place.name = to_name(kKinds[i]);
      fleet.place.density = configuration.density;
      fleet.place.way = options.quick ? std::optional(kQuickWay) : configuration.way;
      const int flights = options.quick ? kQuick[i] : configuration.seeds[i];
      for (int k = 0; k < flights; ++k) fleet.seeds.push_back(kFirstSeed + static_cast<std::uint64_t>(k));
      fleet.out = options.out / configuration.name / fleet.place.name;
      fleet.threads = options.threads;
      fleet.force = options.force;
      set_flier(configuration.name, fleet);
      if (flights > 0) cells.push_back(std::move(cell));
    }
  }
  return cells;
}

/// Every shards-th of all flights, whichever cell it is of.
void take_share(const GridOptions& options, std::vector<Cell>& cells) {
  int number = 0;
  for (Cell& cell : cells) {
    std::erase_if(cell.fleet.seeds,
                  [&](std::uint64_t) { return number++ % options.shards != options.shard - 1; });
  }
}

std::string share_text(const ordered_json& share) {
  return fmt::format("{} ({:.0f}-{:.0f} %)", share["flights"].get<std::size_t>(),
                     std::floor(100 * share["low"].get<double>()),
                     std::ceil(100 * share["high"].get<double>()));
}

/// Flights that make one row of the table.
struct Row {
  std::string configuration;
  std::string world;
  std::optional<double> density;  ///< empty: of several
  std::vector<ordered_json> flown;
  std::vector<ordered_json> refused;
};

void add_flights(const Row& from, Row& to) {
  to.flown.insert(to.flown.end(), from.flown.begin(), from.flown.end());
  for (ordered_json refused : from.refused) {
    refused["world"] = from.world;
    refused["configuration"] = from.configuration;
    to.refused.push_back(std::move(refused));
  }
}

/// The rows of each kind of world, those of each configuration in all of them, and all faults together.
std::vector<Row> with_pools(const std::vector<Row>& rows) {
  std::vector<Row> all;
  Row faults{"all faults", "all", {}, {}, {}};
  std::size_t fault_rows = 0;
  for (std::size_t i = 0; i < rows.size();) {
    const std::string& name = rows[i].configuration;
    Row pool{name, "all", rows[i].density, {}, {}};
    const std::size_t first = i;
    for (; i < rows.size() && rows[i].configuration == name; ++i) {
      all.push_back(rows[i]);
      add_flights(rows[i], pool);
    }
    if (from_name<Fault>(name)) {
      ++fault_rows;
      for (std::size_t k = first; k < i; ++k) add_flights(rows[k], faults);
    }
    if (i - first > 1) all.push_back(std::move(pool));
  }
  if (fault_rows > 1) all.push_back(std::move(faults));
  return all;
}

ordered_json least(const std::vector<ordered_json>& flown, const char* measure) {
  ordered_json found;
  for (const ordered_json& f : flown) {
    if (!f.contains(measure) || !f[measure].is_number()) continue;
    if (found.is_null() || f[measure] < found) found = f[measure];
  }
  return found;
}

ordered_json row_of(const Row& row) {
  ordered_json out = {{"configuration", row.configuration},
                      {"world", row.world},
                      {"density_per_ha", row.density ? ordered_json(*row.density) : ordered_json()},
                      {"totals", totals_of(row.flown)},
                      {"refused", row.refused},
                      {"least_clearance_m", least(row.flown, "least_clearance_m")},
                      {"least_passer_by_clearance_m", least(row.flown, "passer_by_clearance_m")}};
  for (const char* measure : {"path_excess", "stops", "seconds_blind", "fault_seconds", "seconds_after_fault",
                              "traversability", "relative_gap"}) {
    const auto mean = mean_of(row.flown, measure);
    out[measure] = mean ? ordered_json(*mean) : ordered_json();
  }
  return out;
}

std::string number_text(const ordered_json& value, int digits) {
  return value.is_number() ? fmt::format("{:.{}f}", value.get<double>(), digits) : "-";
}

/// What the table does not count, with its reason.
std::string remarks_of(const ordered_json& rows) {
  std::string text;
  for (const ordered_json& row : rows) {
    const std::string name =
        fmt::format("{}, {}", row["configuration"].get<std::string>(), row["world"].get<std::string>());
    if (row["world"] == "all") continue;
    for (const ordered_json& refused : row["refused"])
      text += fmt::format("\nNot flown: {}, seed {}: {}.\n", name, refused["seed"].get<std::uint64_t>(),
                          refused["reason"].get<std::string>());
    if (const auto missed = row["totals"]["fault_not_met"].get<std::size_t>(); missed > 0)
      text += fmt::format("\n{}: {} of the flights ended before the fault began.\n", name, missed);
  }
  return text;
}

std::string table_of(const ordered_json& rows) {
  std::string text =
      "| configuration | world | flights | refused | arrived (95 %) | collided (95 %) | timed out, standing "
      "| timed "
      "out, moving | astray | never ready | arrived or standing (95 %) | goal velocity of arrived, m/s | "
      "least "
      "clearance, m | of a passer-by, m | path excess of arrived | stops | blind, s | under the fault, s | "
      "after "
      "it, s | traversability | relative gap | straight way free |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";
  for (const ordered_json& row : rows) {
    const ordered_json& t = row["totals"];
    const auto standing = t["timed out, standing"].get<std::size_t>();
    text += fmt::format(
        "| {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} "
        "| {} | {} "
        "|\n",
        row["configuration"].get<std::string>(), row["world"].get<std::string>(),
        t["flights"].get<std::size_t>(), row["refused"].size(), share_text(t["arrived"]),
        share_text(t["collided"]), standing, t["timed out"].get<std::size_t>() - standing,
        t["astray"].get<std::size_t>(), t["never ready"].get<std::size_t>(), share_text(t["safe"]),
        number_text(t["mean_goal_velocity_of_arrived_m_s"], 2), number_text(row["least_clearance_m"], 2),
        number_text(row["least_passer_by_clearance_m"], 2), number_text(row["path_excess"], 2),
        number_text(row["stops"], 1), number_text(row["seconds_blind"], 1),
        number_text(row["fault_seconds"], 1), number_text(row["seconds_after_fault"], 1),
        number_text(row["traversability"], 1), number_text(row["relative_gap"], 1),
        t["straight_way_is_free"]["flights"].get<std::size_t>());
  }
  return text + remarks_of(rows);
}

Status write_cell(const fs::path& folder, const Fleet& fleet) {
  const ordered_json all = summary_of(fleet);
  if (const Status s = io::write_file(folder / "flights.json", all.dump(2) + "\n", io::Overwrite::replace);
      !s)
    return s;
  return io::write_file(folder / "report.html", fleet_page(all), io::Overwrite::replace);
}

/// On the paper's outlook, where enough was flown to judge it.
std::string verdict_text(const std::string& json) {
  const auto flown = evaluation::flights_of_grid(json, "grid.json");
  if (!flown) return {};
  const evaluation::Verdict verdict = evaluation::judge_flights(*flown);
  if (verdict.outcome == evaluation::Outcome::not_tested) return {};
  return fmt::format("\n\"{}\" (the paper, {}): {}. {}\n", verdict.claim, verdict.where,
                     evaluation::outcome_name(verdict.outcome), verdict.sense);
}

Result<std::vector<Configuration>> chosen(const GridOptions& options) {
  const std::vector<Configuration> all = all_configurations();
  std::vector<std::string> names = options.configurations;
  if (names.empty())
    names = options.quick ? std::vector<std::string>{"chain"}
                          : std::vector<std::string>{"chain", "exact", "straight"};
  if (names == std::vector<std::string>{"all"}) names = grid_configurations();
  std::vector<Configuration> out;
  for (const std::string& name : names) {
    const auto found =
        std::find_if(all.begin(), all.end(), [&](const Configuration& c) { return c.name == name; });
    if (found == all.end())
      return Error{fmt::format("fly: found '{}', expected all or some of {}", name,
                               fmt::join(grid_configurations(), ", "))};
    out.push_back(*found);
  }
  return out;
}

Status fly_cells(std::vector<Cell>& cells, std::deque<Fleet>& fleets) {
  std::size_t flights = 0;
  for (const Cell& cell : cells) flights += cell.fleet.seeds.size();
  Progress line("Flying", flights);
  std::size_t before = 0;
  for (Cell& cell : cells) {
    const std::string name = fmt::format("{}, {}: ", cell.configuration->name, cell.fleet.place.name);
    const std::size_t here = cell.fleet.seeds.size();
    Fleet& fleet = fleets.emplace_back(std::move(cell.fleet));
    const Status s =
        fleet.fly([&](std::size_t done, const std::string& note) { line.show(before + done, name + note); });
    if (!s) return s;
    if (io::interrupted()) return Error{"interrupted; the flights that are finished are kept"};
    before += here;
  }
  return {};
}

}  // namespace

std::vector<std::string> grid_configurations() {
  std::vector<std::string> names;
  for (const Configuration& c : all_configurations()) names.push_back(c.name);
  return names;
}

Status fly_grid(const GridOptions& options) {
  const auto configurations = chosen(options);
  if (!configurations) return configurations.error();
  std::vector<Cell> cells = cells_of(*configurations, options);
  if (options.shards > 1) take_share(options, cells);
  std::vector<std::pair<const Configuration*, FleetOptions>> made;
  for (const Cell& cell : cells) {
    std::error_code failed;
    fs::create_directories(cell.fleet.out, failed);
    if (failed)
      return Error{fmt::format("{}: cannot be made: {}", cell.fleet.out.string(), failed.message())};
    made.emplace_back(cell.configuration, cell.fleet);
  }
  std::deque<Fleet> fleets;
  if (const Status s = fly_cells(cells, fleets); !s) return s;
  if (options.shards > 1) {
    fmt::print("{}: shard {} of {} is done; without --shard the same command makes the table when all are\n",
               options.out.string(), options.shard, options.shards);
    return {};
  }
  std::vector<Row> cells_flown;
  std::vector<TimedFlights> timed;
  for (std::size_t i = 0; i < fleets.size(); ++i) {
    const FleetOptions& fleet = made[i].second;
    if (const Status s = write_cell(fleet.out, fleets[i]); !s) return s;
    TimedFlights& flights = timed.emplace_back(TimedFlights{made[i].first->name, fleet.place.name, {}});
    for (const ordered_json& f : fleets[i].flown())
      flights.folders.push_back(fleet.out / std::to_string(f["seed"].get<std::uint64_t>()));
    cells_flown.push_back(
        {made[i].first->name, fleet.place.name, fleet.place.density, fleets[i].flown(), fleets[i].refused()});
  }
  ordered_json rows = ordered_json::array();
  for (const Row& row : with_pools(cells_flown)) rows.push_back(row_of(row));
  const std::string json = rows.dump(2) + "\n";
  if (const Status s = io::write_file(options.out / "grid.json", json, io::Overwrite::replace); !s) return s;
  const std::string table = table_of(rows) + verdict_text(json);
  if (const Status s = io::write_file(options.out / "grid.md", table, io::Overwrite::replace); !s) return s;
  const auto timing = timing_of(timed);
  if (!timing) return timing.error();
  if (const Status s =
          io::write_file(options.out / "timing.json", timing->dump(2) + "\n", io::Overwrite::replace);
      !s)
    return s;
  fmt::print("{}", options.json ? json : fmt::format("{}\n{}", table, timing_text(*timing)));
  return {};
}

}  // namespace pade::cli

// Flights of one kind, one a seed or one through a world of the user's own.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include "pade/closed_loop/chain_flight.hpp"
#include "pade/closed_loop/exact_flight.hpp"
#include "pade/core/result.hpp"
#include "pade/simulation/generator/open_world_scene.hpp"

namespace pade::cli {

/// Raised by every change after which a flight of the same options ends otherwise: a folder holds flights of
/// one revision.
inline constexpr int flight_revision = 9;

/// What flies.
enum class Flier {
  chain,     ///< the whole module: rendered images, simulated instruments, own navigation, depth and map
  exact,     ///< the planner alone, on exact depth and pose
  straight,  ///< nobody: from start to goal with closed eyes
};

/// A world from a seed, or from a file with a task in it.
struct FlightPlace {
  std::string name;                                 ///< of the random world, or the file's
  std::optional<simulation::OpenWorldKind> random;  ///< empty: `file`
  double density = 400;                             ///< per hectare
  std::optional<double> way;                        ///< to the goal of a random world, m; empty: 60
  std::filesystem::path file;
  Eigen::Vector3d start = Eigen::Vector3d::Zero(), goal = Eigen::Vector3d::Zero();  ///< of `file`, m
};

struct FleetOptions {
  FlightPlace place;
  std::vector<std::uint64_t> seeds;  ///< of random worlds; of the instruments in a file's world
  Flier flier = Flier::chain;
  closed_loop::ChainFlightOptions chain;
  closed_loop::ExactFlightOptions exact;
  std::filesystem::path out;  ///< empty: nothing is written
  int threads = 1;
  bool force = false;  ///< flies again what `out` holds
};

/// Flies them, as many at once as there are threads. With a folder each is written when it is done, and kept
/// by the next run. The same bytes for any number of threads but for the times in timing.json.
class Fleet {
 public:
  explicit Fleet(FleetOptions options);
  /// @param progress  called with a line about the flights that are in the air; from one thread at a time
  Status fly(const std::function<void(std::size_t done, const std::string& note)>& progress);

  /// One per seed that has a world to fly in: `seed`, `outcome`, and the measures of docs/fly.md.
  [[nodiscard]] const std::vector<nlohmann::ordered_json>& flown() const { return flown_; }
  /// Those that have none: `seed` and `reason`.
  [[nodiscard]] const std::vector<nlohmann::ordered_json>& refused() const { return refused_; }
  /// Who made them: program, world, options.
  [[nodiscard]] const nlohmann::ordered_json& made_of() const { return made_of_; }

 private:
  void take_flights();
  Status fly_one(std::size_t index);
  Status fly_with(std::size_t index, const closed_loop::FlightTask& task,
                  const nlohmann::ordered_json& identity);
  void refuse(std::size_t index, const std::string& reason);
  /// Empty, with the reason, where there is none that can be flown in.
  [[nodiscard]] Result<std::optional<simulation::OpenWorldScene>> world_of(std::uint64_t seed,
                                                                           std::string& reason);
  [[nodiscard]] std::filesystem::path folder_of(std::uint64_t seed) const;
  Status find_flown(std::size_t index, const nlohmann::ordered_json& identity);
  bool report(std::size_t index, double share);

  FleetOptions options_;
  std::vector<nlohmann::ordered_json> flown_, refused_;
  std::vector<double> share_;  // of each way
  nlohmann::ordered_json made_of_;
  std::atomic<std::size_t> next_ = 0;
  std::size_t done_ = 0;
  std::mutex mutex_;
  Status failure_;
  std::function<void(std::size_t, const std::string&)> progress_;
};

/// flights.json: who made them, their totals, the flights.
nlohmann::ordered_json summary_of(const Fleet& fleet);

/// Seed of the instruments and of the image noise of a flight: another one for each kind of world and fault,
/// so that the errors of no two flights of a table are the same; the same for whatever flies.
std::uint64_t instrument_seed(const FlightPlace& place, closed_loop::Fault fault, std::uint64_t seed);

/// Over the flights that have this measure; empty where none has.
std::optional<double> mean_of(const std::vector<nlohmann::ordered_json>& flown, const char* measure);

/// Counts of outcomes with exact 95 % intervals, and means.
nlohmann::ordered_json totals_of(const std::vector<nlohmann::ordered_json>& flown);

}  // namespace pade::cli

template <>
struct pade::EnumNames<pade::cli::Flier> {
  using F = pade::cli::Flier;
  static constexpr std::array names = {std::pair{F::chain, std::string_view("chain")},
                                       std::pair{F::exact, std::string_view("exact")},
                                       std::pair{F::straight, std::string_view("straight")}};
};

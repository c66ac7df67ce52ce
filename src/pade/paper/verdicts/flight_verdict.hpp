// The verdict on the paper's outlook, safe autonomous flight, from flights that were flown in a closed loop.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "pade/core/result.hpp"
#include "pade/paper/verdicts/verdicts.hpp"

namespace pade::evaluation {

/// How the flights of one configuration of `pade experiment fly` ended.
struct FlownFlights {
  std::string configuration;  ///< "chain": ours, "pade": the paper's depth, "straight": with closed eyes
  std::size_t flights = 0;
  std::size_t arrived = 0;
  std::size_t collided = 0;

  bool operator==(const FlownFlights&) const = default;
};

/// The configurations that grid.json of `pade experiment fly` has, each in all of its worlds.
/// @param file  for the errors: what is not such a file, has no flights of "chain" and "straight", which
/// every verdict takes, or counts that do not fit together
Result<std::vector<FlownFlights>> flights_of_grid(std::string_view json, std::string_view file);

/// "chain:100:99:0,straight:100:7:93", for a plan; and back. What is not of this form is an error.
std::string text_of(std::span<const FlownFlights> flights);
Result<std::vector<FlownFlights>> flights_from_text(std::string_view text);

/// The largest share of collisions that is called safe.
inline constexpr double safe_collisions = 0.05;

/// On "PADE may serve safe autonomous flight in unknown places". The 95 % intervals are Clopper and
/// Pearson's. A configuration is in favour where that of its collisions lies below `safe_collisions` and that
/// of its arrivals above that of flying straight on with closed eyes. Reproduces with the paper's own depth
/// ("pade"), in part with ours alone ("chain"), not tested where either of "chain" and "straight" is missing.
Verdict judge_flights(std::span<const FlownFlights> flights);

}  // namespace pade::evaluation

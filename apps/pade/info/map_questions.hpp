// What a planner can ask of a map, for `pade info MAP`: a ray, a box, a ball, a ball on its way, frontiers, a
// place.
#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "pade/core/result.hpp"
#include "pade/mapping/query/map_view.hpp"

namespace pade::cli {

/// As given on the command line; empty = not asked. Metres, in the coordinates of the map.
struct MapQuestions {
  std::vector<double> at;     ///< x y z
  std::vector<double> ray;    ///< x y z of its beginning, then its direction, of any length
  std::vector<double> box;    ///< x y z of two opposite corners
  std::vector<double> ball;   ///< x y z of its centre, radius
  std::vector<double> sweep;  ///< x y z of each point of the way
  bool frontiers = false;
  double reach = 20;                ///< of `ray`, and of the sectors of `at`
  double radius = 0.45;             ///< of the ball of `sweep`
  std::string unknown = "blocked";  ///< for `ray` and `sweep`
};

void add_options(CLI::App& command, MapQuestions& questions);

/// Whether one of these options was given: then a map is meant.
bool asks_of_map(const CLI::App& command);
/// The options that do something for a map with what is asked of it.
std::vector<std::string> options_of_map(const MapQuestions& questions);

/// Refuses numbers that make no sense, and what would take minutes, by the option's name.
Status check_questions(const MapQuestions& questions, const mapping::MapView& map);

/// The answers, each under the name of its question.
nlohmann::ordered_json answers_json(const MapQuestions& questions, const mapping::MapView& map);
/// The same in a few lines each.
std::string answers_text(const MapQuestions& questions, const mapping::MapView& map);

}  // namespace pade::cli

#include "info/map_questions.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <fmt/format.h>

#include "pade/core/option_check.hpp"
#include "pade/core/options.hpp"
#include "pade/mapping/query/surroundings.hpp"

#include "info/info_lines.hpp"
#include "plan/place_info.hpp"

namespace pade::cli {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;
using mapping::MapView;
using mapping::UnknownSpace;
using Answer = nlohmann::ordered_json;

constexpr double kMostVoxels = 1e9;       // that are looked at one by one: some seconds
constexpr double kMostReach = 10000;      // voxels; as many metres as the default can always be asked for
constexpr double kAddressed = 32768;      // voxels from the origin, in each direction
constexpr std::size_t kGroupsNamed = 10;  // the largest
constexpr int kMostNumbers = 3000;        // of a way

Vector3d point_of(const std::vector<double>& numbers, std::size_t point = 0) {
  return {numbers[3 * point], numbers[3 * point + 1], numbers[3 * point + 2]};
}

std::vector<Vector3d> points_of(const std::vector<double>& numbers) {
  std::vector<Vector3d> points;
  for (std::size_t i = 0; i < numbers.size() / 3; ++i) points.push_back(point_of(numbers, i));
  return points;
}

AlignedBox3d box_asked(const MapQuestions& questions) {
  AlignedBox3d box(point_of(questions.box));
  box.extend(point_of(questions.box, 1));
  return box;
}

/// Where frontiers are looked for.
AlignedBox3d frontiers_in(const MapQuestions& questions, const MapView& map) {
  return questions.box.empty() ? map.bounds() : box_asked(questions).intersection(map.bounds());
}

double length_of(std::span<const Vector3d> points) {
  double length = 0;
  for (std::size_t i = 1; i < points.size(); ++i) length += (points[i] - points[i - 1]).norm();
  return length;
}

std::string place_name(const Vector3d& place) {
  return fmt::format("({:.2f}, {:.2f}, {:.2f})", place.x(), place.y(), place.z());
}

struct Asked {
  const char* option;
  const std::vector<double>* numbers;
  std::size_t least;   ///< numbers
  bool is_way;         ///< more points may follow
  std::size_t points;  ///< that come first, the others are something else; of a way all are
  const char* expected;
};

std::array<Asked, 5> asked(const MapQuestions& questions) {
  return {{{"--at", &questions.at, 3, false, 1, "x y z"},
           {"--ray", &questions.ray, 6, false, 1, "x y z and a direction"},
           {"--box", &questions.box, 6, false, 2, "x y z of two opposite corners"},
           {"--ball", &questions.ball, 4, false, 1, "x y z and a radius"},
           {"--sweep", &questions.sweep, 6, true, 0, "x y z of two points or more"}}};
}

Status check_numbers(const Asked& question, double voxel) {
  const std::vector<double>& numbers = *question.numbers;
  const std::size_t count = numbers.size();
  if (count == 0) return {};
  if (question.is_way ? count < question.least || count % 3 != 0 : count != question.least) {
    return Error{fmt::format("{}: found {} numbers, expected {}", question.option, count, question.expected)};
  }
  const auto odd =
      std::find_if_not(numbers.begin(), numbers.end(), [](double n) { return std::isfinite(n); });
  if (odd != numbers.end())
    return Error{fmt::format("{}: found {}, expected finite numbers", question.option, *odd)};
  const double end = kAddressed * voxel;
  for (std::size_t i = 0; i < (question.is_way ? count / 3 : question.points); ++i) {
    const Vector3d point = point_of(numbers, i);
    if (point.cwiseAbs().maxCoeff() <= end) continue;
    return Error{
        fmt::format("{}: found ({:g}, {:g}, {:g}), expected what a map of voxels of {:g} m can hold: within "
                    "{:g} m of its origin along each axis",
                    question.option, point.x(), point.y(), point.z(), voxel, end)};
  }
  return {};
}

Status check_size(const char* option, const Vector3d& sides, double voxel, const char* advice) {
  const double voxels = (sides / voxel).array().ceil().prod();
  if (voxels <= kMostVoxels) return {};
  return Error{fmt::format("{}: found {:.3g} voxels to look at, expected at most {:g}{}", option, voxels,
                           kMostVoxels, advice)};
}

std::string ray_name(const MapQuestions& questions) {
  return fmt::format("from {} towards {}, up to {:g} m, unknown space {}",
                     place_name(point_of(questions.ray)), vector_text(point_of(questions.ray, 1)),
                     questions.reach, questions.unknown);
}

UnknownSpace unknown_in(const MapQuestions& questions) {
  return from_name<UnknownSpace>(questions.unknown).value_or(UnknownSpace::blocked);
}

std::optional<mapping::Hit> hit_of_ray(const MapQuestions& questions, const MapView& map) {
  const Vector3d direction = point_of(questions.ray, 1);
  return map.ray(point_of(questions.ray), direction / direction.cwiseAbs().maxCoeff(), questions.reach,
                 unknown_in(questions));
}

std::optional<mapping::Hit> hit_of_sweep(const MapQuestions& questions, const MapView& map) {
  return map.sweep(points_of(questions.sweep), questions.radius, unknown_in(questions));
}

Answer hit_json(const std::optional<mapping::Hit>& hit) {
  if (!hit) return nullptr;
  return {{"length_m", hit->length},
          {"place_m", json_of(hit->place)},
          {"voxel_m", json_of(hit->voxel)},
          {"state", state_name(hit->state)}};
}

Answer contents_json(const mapping::Contents& contents) {
  Answer json = {{"occupied_voxels", contents.occupied},
                 {"free_voxels", contents.free},
                 {"unknown_voxels", contents.unknown},
                 {"highest_probability", nullptr}};
  if (std::isfinite(contents.probability)) json["highest_probability"] = contents.probability;
  return json;
}

Answer ray_json(const MapQuestions& questions, const MapView& map) {
  return {{"from_m", json_of(point_of(questions.ray))},
          {"direction", json_of(point_of(questions.ray, 1))},
          {"reach_m", questions.reach},
          {"unknown", questions.unknown},
          {"hit", hit_json(hit_of_ray(questions, map))}};
}

Answer sweep_json(const MapQuestions& questions, const MapView& map) {
  const std::vector<Vector3d> points = points_of(questions.sweep);
  Answer path = Answer::array();
  for (const Vector3d& point : points) path.push_back(json_of(point));
  const auto hit = hit_of_sweep(questions, map);
  Answer json = {{"path_m", std::move(path)},
                 {"length_m", length_of(points)},
                 {"radius_m", questions.radius},
                 {"unknown", questions.unknown},
                 {"hit", hit_json(hit)}};
  if (hit) {
    json["hit"]["segment"] = hit->segment;
    json["hit"]["share"] = hit->share;
  }
  return json;
}

Answer box_json(const MapQuestions& questions, const MapView& map) {
  const AlignedBox3d box = box_asked(questions);
  Answer json = {{"from_m", json_of(box.min())}, {"to_m", json_of(box.max())}};
  json.update(contents_json(map.in_box(box)));
  return json;
}

Answer ball_json(const MapQuestions& questions, const MapView& map) {
  const Vector3d centre = point_of(questions.ball);
  Answer json = {{"centre_m", json_of(centre)}, {"radius_m", questions.ball[3]}};
  json.update(contents_json(map.in_ball(centre, questions.ball[3])));
  return json;
}

Answer frontiers_json(const MapQuestions& questions, const MapView& map) {
  const auto found = mapping::frontiers(map, frontiers_in(questions, map));
  const auto groups = mapping::frontier_groups(found, map.voxel());
  Answer largest = Answer::array();
  for (std::size_t i = 0; i < std::min(groups.size(), kGroupsNamed); ++i) {
    largest.push_back({{"voxels", groups[i].voxels},
                       {"centre_m", json_of(groups[i].centre)},
                       {"from_m", json_of(groups[i].bounds.min())},
                       {"to_m", json_of(groups[i].bounds.max())}});
  }
  return {{"voxels", found.size()}, {"groups", groups.size()}, {"largest", std::move(largest)}};
}

/// As other lines of `pade info`: by its name, or below one that has.
std::string set_line(std::string_view name, const std::string& text) {
  return fmt::format("  {:<12} {}\n", name, text);
}

std::string contents_text(const mapping::Contents& contents) {
  const std::string highest = std::isfinite(contents.probability)
                                  ? fmt::format("; the highest probability is {:.2f}", contents.probability)
                                  : "";
  return fmt::format("{} occupied, {} free, {} unknown voxels{}", contents.occupied, contents.free,
                     contents.unknown, highest);
}

std::string ray_text(const MapQuestions& questions, const MapView& map) {
  const auto hit = hit_of_ray(questions, map);
  return set_line("ray", ray_name(questions)) +
         set_line("", hit ? fmt::format("{} voxel at {} after {:.2f} m", state_name(hit->state),
                                        place_name(hit->voxel), hit->length)
                          : "nothing blocks it");
}

std::string sweep_text(const MapQuestions& questions, const MapView& map) {
  const std::vector<Vector3d> points = points_of(questions.sweep);
  const auto hit = hit_of_sweep(questions, map);
  return set_line("sweep", fmt::format("ball of {:g} m along {:.2f} m, unknown space {}", questions.radius,
                                       length_of(points), questions.unknown)) +
         set_line("", hit ? fmt::format("meets the {} voxel at {} after {:.2f} m, its centre at {}, on the "
                                        "way from point {} to the next",
                                        state_name(hit->state), place_name(hit->voxel), hit->length,
                                        place_name(hit->place), hit->segment + 1)
                          : "nothing blocks it");
}

std::string frontiers_text(const MapQuestions& questions, const MapView& map) {
  const auto found = mapping::frontiers(map, frontiers_in(questions, map));
  const auto groups = mapping::frontier_groups(found, map.voxel());
  std::string text =
      set_line("frontiers", fmt::format("{} free voxels beside unknown ones, in {} group{}", found.size(),
                                        groups.size(), groups.size() == 1 ? "" : "s"));
  for (std::size_t i = 0; i < std::min(groups.size(), kGroupsNamed); ++i) {
    text += set_line(
        "", fmt::format("{:>8} around {}, from {} to {}", groups[i].voxels, place_name(groups[i].centre),
                        place_name(groups[i].bounds.min()), place_name(groups[i].bounds.max())));
  }
  return text;
}

}  // namespace

void add_options(CLI::App& command, MapQuestions& questions) {
  const auto add = [&command](const char* name, std::vector<double>& numbers, int count, const char* text) {
    command.add_option(name, numbers, text)->expected(count)->delimiter(',');
  };
  add("--at", questions.at, 3, "x y z: what a map says of a place, and the nearest obstacles around it, m");
  add("--ray", questions.ray, 6, "x y z dx dy dz: the first voxel of a map that blocks the ray");
  add("--box", questions.box, 6,
      "x y z x y z: what of a map lies between two corners, m; --frontiers looks only there");
  add("--ball", questions.ball, 4, "x y z r: what of a map lies in a ball, m");
  command
      .add_option("--sweep", questions.sweep,
                  "x y z x y z ...: the first voxel of a map that a ball meets on its way, m")
      ->expected(6, kMostNumbers)
      ->delimiter(',');
  command.add_flag("--frontiers", questions.frontiers, "Free voxels of a map beside unknown ones, in groups");
  command.add_option("--reach", questions.reach, "of --ray and of the obstacles of --at, m")
      ->capture_default_str();
  command.add_option("--radius", questions.radius, "of the ball of --sweep, m")->capture_default_str();
  command
      .add_option("--unknown", questions.unknown, "what nobody has seen is blocked or free in --ray, --sweep")
      ->check(CLI::IsMember({"blocked", "free"}))
      ->capture_default_str();
}

bool asks_of_map(const CLI::App& command) {
  constexpr std::array kNames = {"--at",        "--ray",   "--box",    "--ball",   "--sweep",
                                 "--frontiers", "--reach", "--radius", "--unknown"};
  return std::any_of(kNames.begin(), kNames.end(),
                     [&command](const char* name) { return command.count(name) > 0; });
}

std::vector<std::string> options_of_map(const MapQuestions& questions) {
  std::vector<std::string> used{"--at", "--ray", "--box", "--ball", "--sweep", "--frontiers", "--json"};
  if (!questions.ray.empty() || !questions.at.empty()) used.emplace_back("--reach");
  if (!questions.ray.empty() || !questions.sweep.empty()) used.emplace_back("--unknown");
  if (!questions.sweep.empty()) used.emplace_back("--radius");
  return used;
}

Status check_questions(const MapQuestions& questions, const MapView& map) {
  const double voxel = map.voxel();
  for (const Asked& question : asked(questions))
    if (const Status fits = check_numbers(question, voxel); !fits) return fits;
  if (!questions.ray.empty() && point_of(questions.ray, 1).isZero(0))
    return Error{"--ray: found a direction of 0 0 0, expected one that leads somewhere"};
  const double ball = questions.ball.empty() ? voxel : questions.ball[3];
  const auto in_range = check_ranges(std::array{
      OptionRange{"--reach", questions.reach, above_zero, std::max(kMostReach * voxel, MapQuestions{}.reach)},
      OptionRange{"--radius", questions.radius, 0.01, 10},
      OptionRange{"--ball R", ball, above_zero, finite}});
  if (!in_range) return in_range;
  if (!questions.ball.empty()) {
    if (Status few = check_size("--ball", Vector3d::Constant(2 * ball), voxel, ""); !few) return few;
  }
  if (!questions.box.empty()) {
    if (Status few = check_size("--box", box_asked(questions).sizes(), voxel, ""); !few) return few;
  }
  const AlignedBox3d searched = frontiers_in(questions, map);
  if (!questions.frontiers || searched.isEmpty()) return {};
  return check_size("--frontiers", searched.sizes(), voxel, ": --box names a part of the map");
}

nlohmann::ordered_json answers_json(const MapQuestions& questions, const MapView& map) {
  Answer json = Answer::object();
  if (!questions.at.empty()) json["place"] = place_json(map, point_of(questions.at), questions.reach);
  if (!questions.ray.empty()) json["ray"] = ray_json(questions, map);
  if (!questions.box.empty()) json["box"] = box_json(questions, map);
  if (!questions.ball.empty()) json["ball"] = ball_json(questions, map);
  if (!questions.sweep.empty()) json["sweep"] = sweep_json(questions, map);
  if (questions.frontiers) json["frontiers"] = frontiers_json(questions, map);
  return json;
}

std::string answers_text(const MapQuestions& questions, const MapView& map) {
  std::string text;
  if (!questions.at.empty()) text += place_text(map, point_of(questions.at), questions.reach);
  if (!questions.ray.empty()) text += ray_text(questions, map);
  if (!questions.box.empty()) {
    const AlignedBox3d box = box_asked(questions);
    text += set_line("box", fmt::format("{} to {}", place_name(box.min()), place_name(box.max())));
    text += set_line("", contents_text(map.in_box(box)));
  }
  if (!questions.ball.empty()) {
    const Vector3d centre = point_of(questions.ball);
    text += set_line("ball", fmt::format("of {:g} m around {}", questions.ball[3], place_name(centre)));
    text += set_line("", contents_text(map.in_ball(centre, questions.ball[3])));
  }
  if (!questions.sweep.empty()) text += sweep_text(questions, map);
  if (questions.frontiers) text += frontiers_text(questions, map);
  return text;
}

}  // namespace pade::cli

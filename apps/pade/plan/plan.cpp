// `pade plan`: a way through a map, from a start to a goal.
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "commands.hpp"

#ifdef PADE_HAS_ROUTES

#include <nlohmann/json.hpp>

#include "pade/io/atomic_output.hpp"
#include "pade/io/formats/map_files.hpp"
#include "pade/io/formats/mission_file.hpp"
#include "pade/io/options_json.hpp"
#include "pade/io/sequence/trajectory.hpp"
#include "pade/io/text.hpp"
#include "pade/planning/global/route.hpp"
#include "pade/report/plot/route_picture.hpp"
#include "pade/report/report_text.hpp"
#include "pade/report/view_3d/view_3d.hpp"

#include "options/json_text.hpp"
#include "plan/route_files.hpp"

namespace pade::cli {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;
using planning::Route;

struct PlanArguments {
  std::string map;
  std::vector<double> start, goal;
  std::string unknown = "blocked";
  std::string track;
  std::string out;
  planning::RouteOptions options;
  bool force = false;
  bool json = false;
};

/// Where the vehicle has been, in pieces: nobody knows what lies in a gap between two poses.
struct FlownTrack {
  std::vector<std::vector<Vector3d>> pieces;
  std::vector<std::string> notes;
};

/// @param reach  two poses that are farther apart than twice this are not joined, m
Result<FlownTrack> track_of(const std::string& file, double reach) {
  FlownTrack track;
  if (file.empty()) return track;
  io::ReadReport report;
  const auto poses = io::read_trajectory(file, report);
  if (!poses) return poses.error();
  for (const io::StampedPose& row : poses->rows()) {
    const Vector3d& place = row.pose.translation;
    if (track.pieces.empty() || (track.pieces.back().back() - place).norm() > 2 * reach)
      track.pieces.emplace_back();
    track.pieces.back().push_back(place);
  }
  if (track.pieces.size() > 1) {
    track.notes.push_back(
        fmt::format("the track has {} gaps of more than {:.2f} m: what lies in them is not taken "
                    "for flown through",
                    track.pieces.size() - 1, 2 * reach));
  }
  if (!report.skipped.empty()) {
    track.notes.push_back(fmt::format("{} rows of the track were left out, the first: {}: {}",
                                      report.skipped.size(), report.skipped.front().file,
                                      report.skipped.front().reason));
  }
  return track;
}

/// Where on the earth the corners lie; empty if the map does not say.
Result<std::optional<std::string>> mission_of(const Route& route, const fs::path& map_file, double speed) {
  std::error_code code;
  const fs::path side_car = io::side_car_of(map_file);
  if (!fs::exists(side_car, code)) return std::optional<std::string>();
  const auto text = io::read_file(side_car);
  if (!text) return text.error();
  const auto origin = io::decode_side_car(*text, side_car.string());
  if (!origin) return origin.error();
  if (!*origin) return std::optional<std::string>();
  std::vector<Vector3d> corners = route.corners;
  for (Vector3d& corner : corners) corner += io::local_origin_of(map_file);
  return std::optional(io::encode_mission(corners, speed, **origin));
}

std::vector<Vector3d> positions_of(const Route& route) {
  std::vector<Vector3d> positions;
  for (const planning::MotionPoint& point : route.points) positions.push_back(point.position);
  return positions;
}

/// Everything about a route that was found.
struct Planned {
  Route route;
  std::optional<std::string> mission;
  std::string picture;
  std::string page;
};

/// The route in its map that one can turn, and from above.
std::string page_of(const Route& route, const mapping::MapView& map, const std::string& name, bool is_enu,
                    const std::string& picture) {
  evaluation::View3d view;
  view.leaves = [&map](const auto& visitor) { map.for_each_leaf(visitor); };
  view.voxel = map.voxel();
  view.plan = positions_of(route);
  view.is_enu = is_enu;
  return fmt::format(
      "{}{}\n<div class=\"map\">{}</div>\n<script>\n{}</script>\n</main></body></html>\n",
      evaluation::begin_page("A way through " + name, ".map svg { width: 100%; height: auto; }"),
      evaluation::view_3d(view), picture, evaluation::view_3d_script());
}

Result<Planned> find_route(const PlanArguments& arguments) {
  if (const Status sensible = planning::check(arguments.options); !sensible) return sensible.error();
  const fs::path file = io::map_file_of(arguments.map);
  const auto made_with = io::options_beside(file);
  if (!made_with) return made_with.error();
  const auto map = io::read_map(file, *made_with);
  if (!map) return map.error();
  const double reach = arguments.options.radius + 2 * map->options().voxel;
  const auto track = track_of(arguments.track, reach);
  if (!track) return track.error();
  auto view = mapping::MapView::of(*map);
  for (const std::vector<Vector3d>& piece : track->pieces) {
    if (io::interrupted()) return io::interrupted_error();
    view = view->flown(piece, reach);
  }
  const auto point = [](const std::vector<double>& v) { return Vector3d(v[0], v[1], v[2]); };
  auto route = planning::plan_route(*view, point(arguments.start), point(arguments.goal), arguments.options,
                                    [] { return io::interrupted(); });
  if (!route && io::interrupted()) return io::interrupted_error();
  if (!route) return Error{fmt::format("{}: {}", file.string(), route.error().message)};
  route->notes.insert(route->notes.end(), track->notes.begin(), track->notes.end());
  auto mission = mission_of(*route, file, arguments.options.motion.speed);
  if (!mission) return mission.error();
  Planned planned{std::move(route).value(), std::move(mission).value(), {}, {}};
  if (arguments.out.empty()) return planned;
  planned.picture = evaluation::route_picture(*view, positions_of(planned.route), planned.route.corners,
                                              arguments.options.radius);
  planned.page = page_of(planned.route, *view, file.string(), planned.mission.has_value(), planned.picture);
  return planned;
}

nlohmann::ordered_json json_of(const PlanArguments& arguments, const Planned& planned) {
  nlohmann::ordered_json json = {{"map", arguments.map}, {"options", io::json_of(arguments.options)}};
  json.update(route_json(planned.route));
  return json;
}

Status write(const PlanArguments& arguments, const Planned& planned) {
  auto folder = io::OutputFolder::create(
      arguments.out, arguments.force ? io::Overwrite::replace : io::Overwrite::refuse, "route.json");
  if (!folder) return folder.error();
  const auto put = [&](const char* name, const std::string& content) { return folder->write(name, content); };
  if (Status s = put("route.json", json_text(json_of(arguments, planned)) + "\n"); !s) return s;
  if (Status s = put("route.txt", route_tum(planned.route)); !s) return s;
  if (Status s = put("route.csv", route_csv(planned.route)); !s) return s;
  if (Status s = put("route.svg", planned.picture); !s) return s;
  if (Status s = put("route.html", planned.page); !s) return s;
  if (planned.mission) {
    if (Status s = put("route.plan", *planned.mission); !s) return s;
  }
  return folder->commit();
}

void print(const PlanArguments& arguments, const Planned& planned) {
  const Route& route = planned.route;
  const double straight = (route.corners.back() - route.corners.front()).norm();
  fmt::print("{}: a way of {:.2f} m ({:.2f} m straight) in {:.1f} s, {} corners, clear by {:.2f} m\n",
             arguments.map, route.length, straight, route.points.back().time, route.corners.size(),
             arguments.options.radius);
  for (const std::string& note : route.notes) fmt::print("  note         {}\n", note);
  if (arguments.out.empty()) return;
  fmt::print("  written      {}/ route.txt (TUM), route.csv, route.svg, route.html, route.json{}\n",
             arguments.out, planned.mission ? ", route.plan (QGroundControl)" : "");
  if (!planned.mission)
    fmt::print("  note         no route.plan: the map does not say where on the earth it lies\n");
}

void run(PlanArguments& arguments, Context& context) {
  io::watch_for_interrupts();
  arguments.options.unknown = *from_name<mapping::UnknownSpace>(arguments.unknown);
  const auto planned = find_route(arguments);
  Status status = planned ? Status() : Status(planned.error());
  if (status && !arguments.out.empty()) status = write(arguments, *planned);
  if (!status) {
    fmt::print(stderr, "pade plan: {}\n", status.error().message);
    context.exit_code = io::interrupted() ? 130 : 1;
    return;
  }
  if (arguments.json) {
    fmt::print("{}\n", json_text(json_of(arguments, *planned)));
  } else {
    print(arguments, *planned);
  }
}

}  // namespace

void add_plan(CLI::App& app, Context& context) {
  auto arguments = std::make_shared<PlanArguments>();
  CLI::App* command = app.add_subcommand("plan", "Plan a way through a map that keeps clear of obstacles.");
  command->footer(
      "Points are in the coordinates of the map, z up.\n"
      "Try it:  pade plan run --start 0 0 1.5 --goal 20 3 1.5 --track run/trajectory.txt --out route");
  command->add_option("MAP", arguments->map, "map (.bt, .ot) or folder of a run")->required();
  command->add_option("--start", arguments->start, "x y z, m")->expected(3)->delimiter(',')->required();
  command->add_option("--goal", arguments->goal, "x y z, m")->expected(3)->delimiter(',')->required();
  command->add_option("-o,--out", arguments->out, "folder to write");
  command->add_option("--radius", arguments->options.radius, "of the ball that stays clear, m")
      ->capture_default_str();
  command->add_option("--unknown", arguments->unknown, "what nobody has seen is blocked or free")
      ->check(CLI::IsMember({"blocked", "free"}))
      ->capture_default_str();
  command->add_option("--track", arguments->track,
                      "poses (TUM) where the vehicle has been: unknown space there is free");
  command->add_option("--speed", arguments->options.motion.speed, "greatest speed, m/s")
      ->capture_default_str();
  command
      ->add_option("--acceleration", arguments->options.motion.acceleration, "greatest acceleration, m/s^2")
      ->capture_default_str();
  command->add_option("--iterations", arguments->options.iterations, "of RRT-Connect, then there is no way")
      ->capture_default_str();
  command
      ->add_option("--improvements", arguments->options.improvements,
                   "iterations of Informed RRT* for a shorter way; 0 = none")
      ->capture_default_str();
  command->add_option("--seed", arguments->options.seed, "of the random numbers")->capture_default_str();
  command->add_flag("--force", arguments->force, "replace a route that is there already");
  command->add_flag("--json", arguments->json, "print the result as JSON");
  command->callback([arguments, &context] { run(*arguments, context); });
}

}  // namespace pade::cli

#else

namespace pade::cli {

void add_plan(CLI::App& app, Context& context) {
  CLI::App* command = app.add_subcommand(
      "plan", "Plan a way through a map that keeps clear of obstacles (not in this build).");
  command->allow_extras();
  command->callback([&context] {
    fmt::print(stderr,
               "pade plan: needs OMPL, which this build has not: missing was {}; install it, then "
               "configure and build again\n",
               PADE_ROUTES_MISSING);
    context.exit_code = 1;
  });
}

}  // namespace pade::cli

#endif

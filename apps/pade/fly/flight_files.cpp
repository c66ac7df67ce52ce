#include "flight_files.hpp"

#include <algorithm>
#include <array>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include "pade/closed_loop/world_measures.hpp"
#include "pade/io/atomic_output.hpp"
#include "pade/io/formats/map_files.hpp"
#include "pade/io/text.hpp"
#include "pade/report/plot/plot.hpp"
#include "pade/report/plot/route_picture.hpp"
#include "pade/report/report_pictures.hpp"
#include "pade/report/report_text.hpp"
#include "pade/report/view_3d/view_3d.hpp"

namespace pade::cli {
namespace {

namespace fs = std::filesystem;
using namespace closed_loop;  // NOLINT: the file is about nothing else
using Eigen::Vector3d;
using nlohmann::ordered_json;

constexpr std::array kPlanNames = {"flying", "committed", "recovering", "arrived"};

std::string track_csv(const FlightRecord& record) {
  constexpr std::size_t kEvery = 5;  // 20 Hz
  std::string text = "# frame=ENU\nt_s,x,y,z,vx,vy,vz,yaw_rad,clearance_m\n";
  for (std::size_t i = 0; i < record.samples.size(); i += kEvery) {
    const FlightSample& s = record.samples[i];
    const Vector3d& p = s.state.position;
    const Vector3d& v = s.state.velocity;
    text += fmt::format("{:.2f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f}\n", s.state.time,
                        p.x(), p.y(), p.z(), v.x(), v.y(), v.z(), s.state.yaw, s.clearance);
  }
  return text;
}

std::string plans_csv(const FlightRecord& record) {
  std::string text = "t_s,plan,valid,speed_limit_m_s,free_reach_m\n";
  for (const FlightPlan& p : record.plans)
    text += fmt::format("{:.2f},{},{},{:.3f},{:.3f}\n", p.time, kPlanNames[static_cast<std::size_t>(p.kind)],
                        p.valid, p.speed_limit, p.free_reach);
  return text;
}

std::string frames_csv(const ChainRecord& record) {
  constexpr std::array kOutcomes = {"waiting", "mapped", "skipped"};
  std::string text = "t_s,outcome,views,motion_refined,blind,no_satellites,no_velocity,drift_m,tracking_m\n";
  for (const ChainFrame& f : record.frames)
    text += fmt::format("{:.2f},{},{},{},{},{},{},{:.4f},{:.4f}\n", f.time,
                        kOutcomes[static_cast<std::size_t>(f.outcome)], f.views, f.refined ? 1 : 0,
                        f.blind ? 1 : 0, f.alone ? 1 : 0, f.unheld ? 1 : 0, f.drift, f.tracking);
  return text;
}

std::vector<double> frame_seconds(const ChainRecord& record) {
  std::vector<double> seconds;
  for (const ChainFrame& f : record.frames) seconds.push_back(f.seconds);
  std::sort(seconds.begin(), seconds.end());
  return seconds;
}

std::string timing_json(const ChainRecord& record) {
  const std::vector<double> seconds = frame_seconds(record);
  const auto quantile = [&](double q) {
    return seconds.empty() ? 0
                           : seconds[static_cast<std::size_t>(q * static_cast<double>(seconds.size() - 1))];
  };
  double sum = 0;
  for (const double s : seconds) sum += s;
  const double mean = seconds.empty() ? 0 : sum / static_cast<double>(seconds.size());
  const ordered_json timing = {{"what", "processor seconds of a frame: navigation, depth, map and plan"},
                               {"frames", seconds.size()},
                               {"mean_s", mean},
                               {"median_s", quantile(0.5)},
                               {"p95_s", quantile(0.95)}};
  return timing.dump(2) + "\n";
}

/// Whether the ball of the vehicle, flown straight from start to goal, touches nothing.
bool straight_way_is_free(const FlightTask& task, double radius) {
  const Vector3d way = task.goal - task.start;
  const int steps = static_cast<int>(way.norm() / 0.02);
  for (int i = 0; i <= steps; ++i) {
    if (task.surface.touches(task.start + way * (static_cast<double>(i) / steps), radius)) return false;
  }
  return true;
}

/// Every tenth of a second from a time on, s.
std::vector<Vector3d> track_of(const FlightRecord& flight, double from, const Pose& T_view_world) {
  constexpr std::size_t kEvery = 10;
  std::vector<Vector3d> points;
  for (std::size_t i = 0; i < flight.samples.size(); i += kEvery) {
    const planning::MotionState& state = flight.samples[i].state;
    if (state.time >= from) points.push_back(T_view_world * state.position);
  }
  return points;
}

std::string plot_of(const FlightRecord& flight, const std::string& title, const std::string& unit,
                    auto value) {
  constexpr std::size_t kEvery = 20;
  evaluation::LinePlot plot;
  plot.frame.title = title;
  plot.frame.x_label = "time since take-off [s]";
  plot.frame.y_label = unit;
  plot.frame.height = 240;
  evaluation::LineSeries series{title, {}, {}};
  series.style.marks = false;
  for (std::size_t i = 0; i < flight.samples.size(); i += kEvery) {
    series.x.push_back(flight.samples[i].state.time);
    series.y.push_back(value(flight.samples[i]));
  }
  plot.series.push_back(std::move(series));
  const auto svg = evaluation::line_plot(plot);
  return svg ? *svg
             : fmt::format("<p class=\"warning\">{}</p>", evaluation::escape_html(svg.error().message));
}

std::string tile(const std::string& value, std::string_view name) {
  return fmt::format("<div class=\"tile\"><b>{}</b><span>{}</span></div>\n", evaluation::escape_html(value),
                     name);
}

std::string page(const std::string& title, const std::string& body) {
  return fmt::format("{}{}</main></body></html>\n",
                     evaluation::begin_page(title, ".map svg { width: 100%; height: auto; }"), body);
}

/// The map and the way that one can turn, in the world of the map.
std::string view_of_flight(const mapping::MapView& map, const std::vector<Vector3d>& points,
                           const std::array<Vector3d, 2>& corners) {
  evaluation::View3d view;
  view.leaves = [&map](const auto& visitor) { map.for_each_leaf(visitor); };
  view.voxel = map.voxel();
  view.way = points;
  view.plan = {corners.begin(), corners.end()};
  view.plan_name = "straight to the goal";
  view.is_enu = true;
  return evaluation::view_3d(view);
}

std::string flight_page(const ordered_json& whole, const FlightTask& task, const ChainRecord& record,
                        const FlightStrip& strip) {
  const ordered_json& f = whole["flight"];
  const FlightRecord& flight = record.flight;
  std::string body = "<div class=\"tiles\">\n";
  body += tile(f["outcome"].get<std::string>(), "outcome");
  body += tile(fmt::format("{:.1f} s", flight.duration), "in the air");
  body += tile(fmt::format("{:.2f} m/s", flight.goal_velocity), "toward the goal");
  body += tile(fmt::format("{:.2f} m", flight.least_clearance), "least clearance of the centre");
  body += tile(fmt::format("{:.2f} m", flight.goal_distance), "from the goal at the end");
  body += tile(fmt::format("{:.1f} s", record.seconds_blind), "blind");
  body += "</div>\n";
  for (const std::string& event : record.events)
    body += fmt::format("<p class=\"warning\">{}</p>\n", evaluation::escape_html(event));
  const Pose T_view_world = record.T_world_map.inverse();
  const std::vector<Vector3d> points = track_of(flight, record.climbed, T_view_world);
  const std::array corners = {T_view_world * task.start, T_view_world * task.goal};
  constexpr double kFasterBy = 4;
  if (record.view && !points.empty()) {
    body +=
        "<h2>The map and the way that was flown</h2><p class=\"soft\">From above, in the world of the map, "
        "which "
        "begins at take-off: black occupied, white free, grey unknown, at the heights that were flown. The "
        "dashed line leads straight to the goal. Four times as fast as the flight.</p>\n<div class=\"map\">";
    body +=
        evaluation::route_picture(*record.view, points, corners,
                                  whole["made_of"]["options"]["planner"]["vehicle"]["radius"].get<double>(),
                                  (flight.duration - record.climbed) / kFasterBy);
    body += "</div>\n" + view_of_flight(*record.view, points, corners);
  }
  body += "<h2>Over time</h2>\n<div class=\"views\">";
  body += plot_of(flight, "true clearance, at most 2 m", "[m]",
                  [](const FlightSample& s) { return s.clearance; });
  body += plot_of(flight, "speed", "[m/s]", [](const FlightSample& s) { return s.state.velocity.norm(); });
  body += "</div>\n<h2>What the camera saw</h2>\n" + strip.html();
  if (record.view && !points.empty())
    body += fmt::format("<script>\n{}</script>\n", evaluation::view_3d_script());
  return page(fmt::format("Flight {} through {}: {}", f["seed"].get<std::uint64_t>(),
                          whole["made_of"]["world"].get<std::string>(), f["outcome"].get<std::string>()),
              body);
}

using Files = std::vector<std::pair<std::string, std::string>>;

Status write_all(const fs::path& folder, const Files& files) {
  std::error_code failed;
  fs::create_directories(folder, failed);
  if (failed) return Error{fmt::format("{}: cannot be made: {}", folder.string(), failed.message())};
  for (const auto& [name, text] : files) {
    if (const Status s = io::write_file(folder / name, text, io::Overwrite::replace); !s) return s;
  }
  return {};
}

}  // namespace

ordered_json measures_of(const FlightTask& task, const FlightRecord& r, double radius) {
  const double way = (task.goal - task.start).norm();
  const double rest = r.samples.empty() ? way : (task.goal - r.samples.back().state.position).norm();
  const bool arrived = r.outcome == Outcome::arrived;
  const closed_loop::WorldMeasures world = closed_loop::measures_of_world(task, radius);
  return {{"outcome", to_name(r.outcome)},
          {"duration_s", r.duration},
          {"length_m", r.length},
          {"path_excess", arrived ? ordered_json((r.length + rest) / way - 1) : ordered_json()},
          {"goal_velocity_m_s", r.goal_velocity},
          {"goal_distance_m", r.goal_distance},
          {"goal_height_m", r.goal_height},
          {"least_clearance_m", r.least_clearance},
          {"stops", r.stops},
          {"stands_at_the_end", r.stands},
          {"traversability", world.traversability},
          {"relative_gap", world.relative_gap ? ordered_json(*world.relative_gap) : ordered_json()},
          {"straight_way_is_free", straight_way_is_free(task, radius)}};
}

ordered_json measures_of(const FlightTask& task, const ChainRecord& r, double radius,
                         const FaultOptions& fault) {
  ordered_json measures = measures_of(task, r.flight, radius);
  double drift = 0;
  double tracking = 0;
  std::size_t mapped = 0;
  std::size_t skipped = 0;
  for (const ChainFrame& f : r.frames) {
    drift = std::max(drift, f.drift);
    tracking = std::max(tracking, f.tracking);
    mapped += f.outcome == MapperUpdate::Outcome::mapped ? 1 : 0;
    skipped += f.outcome == MapperUpdate::Outcome::skipped ? 1 : 0;
  }
  measures["climb_s"] = r.climbed;
  if (fault.kind != Fault::none) {
    const FaultOptions::Seconds seconds = fault.seconds_of(r.flight.duration);
    measures["fault_seconds"] = seconds.under;
    measures["seconds_after_fault"] = seconds.after;
  }
  measures["frames"] = r.frames.size();
  measures["frames_mapped"] = mapped;
  measures["frames_skipped"] = skipped;
  measures["seconds_blind"] = r.seconds_blind;
  measures["seconds_without_satellites"] = r.seconds_alone;
  measures["seconds_without_velocity"] = r.seconds_unheld;
  if (r.passer_by_clearance) measures["passer_by_clearance_m"] = *r.passer_by_clearance;
  measures["stamp_correction_s"] = r.stamp_correction;
  measures["largest_drift_m"] = drift;
  measures["largest_tracking_error_m"] = tracking;
  return measures;
}

void FlightStrip::look(const ChainMoment& moment) {
  constexpr std::size_t kMost = 12;
  constexpr int kWidth = 400;       // px
  constexpr double kFarthest = 20;  // m
  if (moment.update == nullptr || moment.frame.time < next_ ||
      moment.update->outcome != MapperUpdate::Outcome::mapped)
    return;
  shots_.push_back({moment.frame.time, evaluation::jpeg_uri(moment.image, kWidth),
                    evaluation::jpeg_uri(evaluation::colourise(moment.update->depth.depth, 0, kFarthest,
                                                               evaluation::Palette::turbo_near_warm),
                                         kWidth)});
  next_ += every_;
  if (shots_.size() < kMost) return;
  std::vector<Shot> kept;  // every other one, from now on half as often
  for (std::size_t i = 0; i < shots_.size(); i += 2) kept.push_back(std::move(shots_[i]));
  shots_ = std::move(kept);
  every_ *= 2;
  next_ = shots_.back().time + every_;
}

std::string FlightStrip::html() const {
  std::string text =
      "<p class=\"soft\">Image and depth (red near, blue 20 m, grey unknown).</p>\n<div "
      "class=\"pictures\">\n";
  for (const Shot& shot : shots_)
    text += fmt::format(
        "<figure><figcaption>{:.1f} s</figcaption><img alt=\"image\" src=\"{}\"><img alt=\"depth\" "
        "src=\"{}\"></figure>\n",
        shot.time, shot.image, shot.depth);
  return text + "</div>\n";
}

Status write_flight(const fs::path& folder, const ordered_json& whole, const FlightRecord& flight) {
  return write_all(folder, {{"track.csv", track_csv(flight)},
                            {"plans.csv", plans_csv(flight)},
                            {"flight.json", whole.dump(2) + "\n"}});
}

Status write_flight(const fs::path& folder, const ordered_json& whole, const FlightTask& task,
                    const ChainRecord& record, const FlightStrip& strip) {
  std::string events;
  for (const std::string& event : record.events) events += event + "\n";
  if (const Status s = write_all(folder, {{"track.csv", track_csv(record.flight)},
                                          {"plans.csv", plans_csv(record.flight)},
                                          {"frames.csv", frames_csv(record)},
                                          {"events.txt", events},
                                          {"timing.json", timing_json(record)},
                                          {"flight.html", flight_page(whole, task, record, strip)}});
      !s)
    return s;
  if (record.mapper) {
    if (const Status s = io::write_map(record.mapper->map(), folder / "map.bt", io::Overwrite::replace); !s)
      return s;
  }
  return write_all(folder, {{"flight.json", whole.dump(2) + "\n"}});
}

std::string fleet_page(const ordered_json& all) {
  const ordered_json& totals = all["totals"];
  const auto share = [&](const char* name) {
    const ordered_json& t = totals[name];
    return fmt::format("{} of {}, 95 %: {:.1f} to {:.1f} %", t["flights"].get<std::size_t>(),
                       totals["flights"].get<std::size_t>(), 100 * t["low"].get<double>(),
                       100 * t["high"].get<double>());
  };
  std::string body =
      "<div class=\"tiles\">\n" + tile(share("arrived"), "arrived") + tile(share("collided"), "collided") +
      tile(share("straight_way_is_free"), "straight way free: what flying blind would get") +
      tile(totals["mean_goal_velocity_of_arrived_m_s"].is_null()
               ? std::string("-")
               : fmt::format("{:.2f} m/s", totals["mean_goal_velocity_of_arrived_m_s"].get<double>()),
           "mean goal velocity of those that arrived") +
      "</div>\n<div class=\"scroll\"><table><tr><th>seed</th><th>outcome</th><th>s</th><th>m</th>"
      "<th>m/s</th><th>clearance m</th><th>stops</th><th>straight way</th></tr>\n";
  for (const ordered_json& f : all["flights"]) {
    const std::uint64_t seed = f["seed"].get<std::uint64_t>();
    const bool has_page = all["flier"] == "chain";
    body += fmt::format(
        "<tr><td>{}</td><td>{}</td><td>{:.1f}</td><td>{:.1f}</td><td>{:.2f}</td><td>{:.2f}</td><td>{}</"
        "td><td>{}</td></tr>\n",
        has_page ? fmt::format("<a href=\"{}/flight.html\">{}</a>", seed, seed) : std::to_string(seed),
        f["outcome"].get<std::string>(), f["duration_s"].get<double>(), f["length_m"].get<double>(),
        f["goal_velocity_m_s"].get<double>(), f["least_clearance_m"].get<double>(), f["stops"].get<int>(),
        f["straight_way_is_free"].get<bool>() ? "free" : "blocked");
  }
  body += "</table></div>\n";
  for (const ordered_json& r : all["refused"])
    body += fmt::format("<p class=\"warning\">seed {}: no flight: {}</p>\n", r["seed"].get<std::uint64_t>(),
                        evaluation::escape_html(r["reason"].get<std::string>()));
  body += "<h2>Options</h2><pre>" + evaluation::escape_html(all["options"].dump(2)) + "</pre>\n";
  return page(fmt::format("Flights through {}", all["world"].get<std::string>()), body);
}

}  // namespace pade::cli

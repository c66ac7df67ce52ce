#include "pade/report/report.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <numeric>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pade/io/formats/flow_picture.hpp"
#include "pade/report/report_map.hpp"
#include "pade/report/report_pictures.hpp"
#include "pade/report/report_sections.hpp"
#include "pade/report/report_style.hpp"
#include "pade/report/report_text.hpp"
#include "pade/report/tables/accuracy_tables.hpp"
#include "pade/report/view_3d/view_3d.hpp"

namespace pade::evaluation {
namespace {

constexpr int kPictureWidth = 640;      // pixels in the page's pictures
constexpr double kPageWidth = 1098;     // of drawings across the page, without their numbers
constexpr double kHalfPage = 500;       // of two beside each other
constexpr double kLargestError = 0.25;  // relative, the ends of the error palette

std::string tile(std::string_view value, std::string_view meaning) {
  return fmt::format("<div class=\"tile\"><b>{}</b><span>{}</span></div>\n", value, meaning);
}

/// As text of HTML, with a capital letter.
std::string sentence(std::string text) {
  if (!text.empty()) text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
  return escape_html(text);
}

std::string sequence_name(const io::RunInfo& info) {
  const std::string name = info.sequence.filename().string();
  return name.empty() ? info.sequence.parent_path().filename().string() : name;
}

std::string reach_text(double reach) {
  return fmt::format("{:.1f} m{}", reach, reach > corridor_length - 0.1 ? " or more" : "");
}

std::string header(const Report& report, const CorridorViews& corridor) {
  const io::RunInfo& info = report.info;
  std::string html =
      fmt::format("<h1>{}</h1>\n<p class=\"soft\">Obstacle map from one camera and a GPS/INS · pade {} · ",
                  escape_html(sequence_name(info)), escape_html(info.version));
  html +=
      fmt::format("camera {} × {} px, f = {:.1f} px", info.camera.width, info.camera.height, info.camera.fx);
  if (!info.poses.empty()) html += fmt::format(" · poses from {}", escape_html(info.poses));
  html += "</p>\n<div class=\"tiles\">\n";
  html += tile(fmt::format("{} / {}", info.health.frames_used, info.health.frames), "frames used");
  if (report.accuracy && report.accuracy->all.pixels > 0) {
    html += tile(percent_text(report.accuracy->all.relative_median), "median relative depth error");
    html += tile(percent_text(report.accuracy->all.coverage), "of the pixels with truth have depth");
  }
  if (info.map) {
    html += tile(grouped_text(info.map->occupied_voxels),
                 fmt::format("occupied voxels of {:g} m", info.map->voxel));
  }
  if (!std::isnan(corridor.reach)) {
    html += tile(reach_text(corridor.reach),
                 fmt::format("known free ahead of the last pose, for a sphere of {:g} m", corridor_radius));
  }
  if (report.timing.frames_per_second > 0)
    html += tile(number_text(report.timing.frames_per_second, 1), "frames per second");
  const auto total = std::find_if(report.timing.stages.begin(), report.timing.stages.end(),
                                  [](const io::StageTiming& stage) { return stage.stage == "total"; });
  if (total != report.timing.stages.end())
    html += tile(fmt::format("{:.0f} ms", total->p99), "latency, 99 % of frames");
  return html + "</div>\n";
}

std::string hints_section(const std::vector<Hint>& hints) {
  std::string html;
  for (const Hint& hint : hints) {
    html += fmt::format("<div class=\"{}\"><b>{}.</b> Try: {}.</div>\n", to_name(hint.severity),
                        sentence(hint.message), escape_html(hint.advice));
  }
  return html;
}

// The scales that all frames share, so that pictures can be compared.
struct Scales {
  double depth = 1, sigma = 1, flow = 1;
};

cv::Mat sigma_of(const DepthImage& depth) {
  cv::Mat sigma;
  if (!depth.variance.empty()) cv::sqrt(depth.variance, sigma);
  return sigma;
}

Scales scales_of(const Report& report) {
  Scales scales{0, 0, 0};
  for (const ReportFrame& frame : report.frames) {
    const auto widen = [](double& scale, double value) {
      scale = std::max(scale, std::isnan(value) ? 0 : value);
    };
    widen(scales.depth, finite_quantile(frame.depth.depth, 0.97));
    widen(scales.sigma, finite_quantile(sigma_of(frame.depth), 0.9));
    if (!frame.flow.empty()) widen(scales.flow, io::flow_full_scale(frame.flow));
  }
  scales.depth = round_up_125(scales.depth);
  if (report.info.range_limit > 0) scales.depth = std::min(scales.depth, report.info.range_limit);
  return {scales.depth, round_up_125(scales.sigma), scales.flow > 0 ? scales.flow : 1};
}

std::string legends(const Scales& scales, bool with_flow, bool with_truth) {
  std::string html = "<div class=\"legends\">\n";
  html += fmt::format("<div><b>Depth, and bound that nothing is nearer than</b>{}</div>\n",
                      colour_bar(0, scales.depth, Palette::turbo_near_warm, "m"));
  html += fmt::format("<div><b>Standard deviation σ of depth</b>{}</div>\n",
                      colour_bar(0, scales.sigma, Palette::cividis, "m"));
  if (with_truth) {
    html += fmt::format(
        "<div><b>Error (Z − Z<sub>true</sub>) / Z<sub>true</sub>: too near – too far</b>{}</div>\n",
        colour_bar(-100 * kLargestError, 100 * kLargestError, Palette::blue_orange, "%"));
  }
  if (with_flow) {
    html += fmt::format(
        "<div><b>Optical flow</b><div class=\"wheel\"><img src=\"{}\" width=\"64\" height=\"64\" "
        "alt=\"\"><span>direction as hue;<br>"
        "the rim is {:g} px per pair of frames</span></div></div>\n",
        png_uri(flow_wheel(128), 128, true), scales.flow);
  }
  html += fmt::format("<div><b>State of a pixel</b>{}</div>\n", state_items(nullptr));
  html += fmt::format(
      "<div><b>In all pictures</b><span class=\"states\"><span class=\"item\"><span class=\"swatch\" "
      "style=\"background:{}\"></span>"
      "no value</span></span></div>\n",
      no_value_colour);
  return html + "</div>\n";
}

std::string figure(std::string_view caption, const std::string& uri) {
  return fmt::format("<figure><figcaption>{0}</figcaption><img src=\"{1}\" alt=\"{0}\"></figure>\n", caption,
                     uri);
}

std::string frame_block(const ReportFrame& frame, const Scales& scales) {
  const DepthImage depth = at_full_size(frame.depth, frame.image.size());
  const auto coloured = [](const cv::Mat& values, double from, double to, Palette palette) {
    return png_uri(colourise(values, from, to, palette), kPictureWidth, false);
  };
  std::string html = fmt::format("<div class=\"frame-block\"><h3>{}</h3>\n<div class=\"pictures\">\n",
                                 escape_html(frame.name));
  html += figure("image", jpeg_uri(frame.image, kPictureWidth));
  if (!frame.flow.empty()) {
    cv::Mat flow = io::flow_colors(frame.flow, scales.flow);
    html += figure("optical flow", png_uri(flow, kPictureWidth, false));
  }
  html += figure("depth", coloured(depth.depth, 0, scales.depth, Palette::turbo_near_warm));
  const cv::Mat sigma = sigma_of(depth);
  if (!sigma.empty()) html += figure("σ of depth", coloured(sigma, 0, scales.sigma, Palette::cividis));
  html += figure("state", png_uri(colourise_states(depth.state), kPictureWidth, false));
  if (!depth.bound.empty()) {
    html +=
        figure("nothing is nearer than", coloured(depth.bound, 0, scales.depth, Palette::turbo_near_warm));
  }
  if (!frame.truth.empty()) {
    html += figure("relative error", coloured(relative_error(depth, frame.truth), -kLargestError,
                                              kLargestError, Palette::blue_orange));
  }
  return html + "</div></div>\n";
}

std::string frames_section(const Report& report) {
  if (report.frames.empty()) return {};
  const Scales scales = scales_of(report);
  const auto any = [&](auto has) { return std::any_of(report.frames.begin(), report.frames.end(), has); };
  std::string html = "<h2>Frames</h2>\n";
  html += legends(scales, any([](const ReportFrame& frame) { return !frame.flow.empty(); }),
                  any([](const ReportFrame& frame) { return !frame.truth.empty(); }));
  for (const ReportFrame& frame : report.frames) html += frame_block(frame, scales);
  return html;
}

std::string accuracy_row(const RangeAccuracy& range, bool with_sigma, bool is_all) {
  std::string html =
      fmt::format("<tr{}><td>{}</td><td>{}</td><td>{}</td>", is_all ? " class=\"all\"" : "",
                  range_name(range), grouped_text(range.truth_pixels), percent_text(range.coverage));
  const std::string spread =
      range.pixels == 0 ? "–"
                        : fmt::format("{} ± {}", number_text(range.mean, 3), number_text(range.deviation, 3));
  html += fmt::format("<td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td>", spread,
                      number_text(range.median, 3), percent_text(range.relative_mean),
                      percent_text(range.relative_median), percent_text(range.outliers));
  if (with_sigma) {
    html += fmt::format("<td>{}</td><td>{}</td><td>{}</td>", percent_text(range.within_1_sigma),
                        percent_text(range.within_2_sigma), number_text(range.rms_of_sigma, 2));
  }
  return html + "</tr>\n";
}

std::string accuracy_section(const Report& report) {
  std::string html = "<h2>Accuracy</h2>\n";
  if (!report.accuracy) {
    return html + fmt::format("<p class=\"soft\">The sequence has no true depth to compare with{}.</p>\n",
                              report.info.health.skipped.empty()
                                  ? ""
                                  : ", or none that can be used: what was skipped is listed with its reason");
  }
  const DepthAccuracy& accuracy = *report.accuracy;
  const bool with_sigma = accuracy.all.sigma_pixels > 0;
  html +=
      "<div class=\"scroll\"><table><tr><th>true depth</th><th>pixels<br>with "
      "truth</th><th>coverage</th><th>absolute depth error<br>"
      "mean ± std [m]</th><th>median<br>[m]</th><th>relative error<br>mean</th><th><br>median</th><th>over "
      "25 %<br>off</th>";
  if (with_sigma) html += "<th>within<br>1 σ</th><th>within<br>2 σ</th><th>rms of<br>error / σ</th>";
  html += "</tr>\n";
  for (const RangeAccuracy& range : accuracy.ranges) html += accuracy_row(range, with_sigma, false);
  html += accuracy_row(accuracy.all, with_sigma, true) + "</table></div>\n";
  html += fmt::format(
      "<p class=\"soft\">{} depth images. Errors are over the pixels that have both truth and an estimate",
      accuracy.frames);
  if (accuracy.max_depth > 0)
    html += fmt::format("; an estimate beyond {:g} m counts as none", accuracy.max_depth);
  html += ". Means are ruled by the few pixels at depth edges: read them with the median and the coverage.";
  if (with_sigma) html += " For errors that follow σ the last three columns read 68 %, 95 % and 1.";
  return html + "</p>\n";
}

std::string figure_of(const std::string& caption, const std::string& drawing) {
  return fmt::format("<figure><figcaption>{}</figcaption>{}</figure>\n", caption, drawing);
}

std::string stretch_text(double stretch) {
  return stretch > 1.05 ? fmt::format(" (heights stretched {:.1f} times)", stretch) : "";
}

std::string occupancy_items() {
  std::string html = "<p class=\"states\">";
  for (std::size_t i = occupancy_colours.size(); i-- > 0;) {
    html +=
        fmt::format("<span class=\"item\"><span class=\"swatch\" style=\"background:{}\"></span>{}</span>",
                    occupancy_colours[i], occupancy_names[i]);
  }
  return html + "</p>\n";
}

std::optional<MapScene> scene_of(const Report& report) {
  if (report.map == nullptr) return std::nullopt;
  const Eigen::Vector3d up =
      report.info.world_up ? report.info.world_up->direction : Eigen::Vector3d::UnitZ();
  return MapScene{*report.map, report.trajectory, up, report.look, {kPageWidth, kHalfPage, true}};
}

std::string map_notes(const Report& report, const MapViews& views) {
  std::string html = "<p class=\"soft\">Camera path in orange, from the circle to the diamond.";
  if (views.cut_off > 0)
    html += fmt::format(" {} scattered voxels lie outside the pictures.", grouped_text(views.cut_off));
  const auto options = nlohmann::ordered_json::parse(report.info.options, nullptr, false);
  const auto sigma = nlohmann::ordered_json::json_pointer("/mapper/map/hit_max_relative_sigma");
  if (!options.is_discarded() && options.contains(sigma) && options.at(sigma).is_number()) {
    html += fmt::format(
        " An obstacle whose depth has σ above {:g} % of it is not placed: what lies there stays unknown.",
        100 * options.at(sigma).get<double>());
  }
  return html + "</p>\n";
}

/// The map that one can turn.
std::string turning_view(const Report& report) {
  View3d view;
  if (report.map != nullptr) {
    view.leaves = [&map = *report.map](const auto& visitor) { map.for_each_leaf(visitor); };
    view.voxel = report.map->options().voxel;
  }
  view.way = report.trajectory;
  if (report.info.world_up) view.up = report.info.world_up->direction;
  view.is_enu = report.info.origin && view.up.isApprox(Eigen::Vector3d::UnitZ());
  return view_3d(view);
}

std::string map_section(const Report& report) {
  std::string html = "<h2>Map</h2>\n" + turning_view(report);
  const auto scene = scene_of(report);
  const bool obstacles = report.info.map && report.info.map->occupied_voxels > 0;
  if (!obstacles) html += "<p class=\"soft\">Nothing is occupied.</p>\n";
  const MapViews views = scene ? draw_map(*scene) : MapViews();
  if (views.top.empty()) return html;
  html += fmt::format("<div class=\"{}\">\n", views.wide ? "wide" : "views");
  if (obstacles) html += figure_of("all obstacles from above, in the colours of their heights", views.top);
  html += figure_of("free, occupied and unknown from above, at the height of the flight", views.level);
  html += "</div>\n<div class=\"wide\">\n";
  if (obstacles)
    html += figure_of("all obstacles from the side" + stretch_text(views.side_stretch), views.side);
  html += figure_of("free, occupied and unknown on the upright surface through the path and straight ahead" +
                        stretch_text(views.section_stretch),
                    views.section);
  html += fmt::format(
      "</div>\n<div class=\"legends\">\n<div><b>Free, occupied and unknown</b>{}</div>\n<div><b>Height of "
      "obstacles</b>{}</div>\n</div>\n",
      occupancy_items(), views.height_bar);
  html += map_notes(report, views);
  if (const auto& origin = report.info.origin) {
    html += fmt::format(
        "<p>The origin lies at latitude {:.7f}°, longitude {:.7f}°, {:.2f} m above the ellipsoid "
        "(WGS-84).</p>\n",
        origin->latitude_deg, origin->longitude_deg, origin->height);
  }
  return html;
}

std::string stop_text(mapping::Occupancy stopped_by) {
  switch (stopped_by) {
    case mapping::Occupancy::occupied:
      return "; then it touches an obstacle";
    case mapping::Occupancy::unknown:
      return "; then it touches unknown space";
    default:
      return {};
  }
}

std::string corridor_section(const CorridorViews& corridor) {
  if (corridor.level.empty()) return {};
  std::string html = "<h2>The way ahead of the last pose</h2>\n";
  html += fmt::format(
      "<p>A sphere of {:g} m radius that flies straight on meets nothing but known free space for "
      "<b>{}</b>{}.</p>\n",
      corridor_radius, reach_text(corridor.reach), stop_text(corridor.stopped_by));
  html += "<div class=\"views\">\n";
  html += figure_of("from above", corridor.level);
  html += figure_of("from the side", corridor.upright);
  html += "</div>\n" + occupancy_items();
  return html +
         "<p class=\"soft\">Sections through the last pose along the direction of flight; in orange what the "
         "sphere sweeps.</p>\n";
}

}  // namespace

std::string to_html(const Report& report) {
  std::string html = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" "
      "content=\"width=device-width, initial-scale=1\">\n<title>{} – "
      "PADE</title>\n<style>{}</style>\n</head>\n<body>\n",
      escape_html(sequence_name(report.info)), report_style);
  const auto scene = scene_of(report);
  const CorridorViews corridor = scene ? draw_corridor(*scene) : CorridorViews();
  html += header(report, corridor);
  html += hints_section(report.info.hints);
  html += accuracy_section(report);
  html += map_section(report);
  html += corridor_section(corridor);
  html += frames_section(report);
  html += timing_section(report.timing);
  html += health_section(report.info);
  html += options_section(report.info);
  if (html.find("class=\"map3d\"") != std::string::npos)
    html += fmt::format("<script>\n{}</script>\n", view_3d_script());
  return html + "</body>\n</html>\n";
}

std::vector<std::size_t> evenly_spread(std::size_t count, std::size_t wanted) {
  const std::size_t chosen = std::min(count, wanted);
  std::vector<std::size_t> indices(chosen);
  for (std::size_t i = 0; i < chosen; ++i) indices[i] = (2 * i + 1) * count / (2 * chosen);
  return indices;
}

}  // namespace pade::evaluation

#include "pade/paper/experiment/experiment_flight.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>

#include "pade/io/atomic_output.hpp"
#include "pade/io/formats/flow_picture.hpp"
#include "pade/report/report.hpp"
#include "pade/report/report_map.hpp"
#include "pade/report/report_pictures.hpp"

namespace pade::experiment {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMoments = 4;
constexpr int kStripWidth = 1440;  // pixels: image, flow and depth side by side

/// What is seen and known at one moment.
struct Moment {
  Time time;
  double flown = 0;  // m
  cv::Mat image, flow, depth;
  evaluation::MapViews map;
};

/// The frames that are shown: spread over the flight, its last frame among them.
std::vector<std::size_t> chosen(std::size_t pairs) {
  std::vector<std::size_t> indices;
  for (std::size_t i = 1; i <= std::min(kMoments, pairs); ++i) indices.push_back(i * pairs / kMoments - 1);
  return indices;
}

Moment moment_of(const MapperUpdate& update, const cv::Mat& image, double flown, const ObstacleMapper& mapper,
                 const std::vector<Eigen::Vector3d>& path, const io::Sequence& sequence) {
  Moment moment;
  moment.time = update.depth.time;
  moment.flown = flown;
  moment.image = image.clone();
  moment.flow = update.flow.vectors.clone();
  moment.depth = at_full_size(update.depth, image.size()).depth.clone();
  const Eigen::Vector3d up = sequence.world_up() ? sequence.world_up()->direction : Eigen::Vector3d::UnitZ();
  moment.map = evaluation::draw_map({mapper.map(), path, up});
  return moment;
}

cv::Mat in_colour(const cv::Mat& image) {
  cv::Mat colour = image;
  if (image.channels() == 1) cv::cvtColor(image, colour, cv::COLOR_GRAY2BGR);
  return colour;
}

std::string to_json(const std::vector<Moment>& moments, double range) {
  double depth_scale = 0;
  for (const Moment& moment : moments)
    depth_scale = std::max(depth_scale, evaluation::finite_quantile(moment.depth, 0.97));
  depth_scale = std::min(range, evaluation::round_up_125(depth_scale));
  Json list = Json::array();
  for (const Moment& moment : moments) {
    const cv::Mat depth =
        evaluation::colourise(moment.depth, 0, depth_scale, evaluation::Palette::turbo_near_warm);
    const double flow_scale =
        io::flow_full_scale(moment.flow);  // of its own: near the wall flow is ten times larger
    cv::Mat strip;
    cv::hconcat(
        std::vector<cv::Mat>{in_colour(moment.image), io::flow_colors(moment.flow, flow_scale), depth},
        strip);
    list.push_back({{"time", to_string(moment.time)},
                    {"flown_m", moment.flown},
                    {"flow_scale_px", flow_scale},
                    {"strip", evaluation::jpeg_uri(strip, kStripWidth)},
                    {"map_top", moment.map.top},
                    {"map_side", moment.map.side}});
  }
  const Json json = {{"depth_scale_m", depth_scale},
                     {"height_bar", moments.empty() ? "" : moments.back().map.height_bar},
                     {"moments", std::move(list)}};
  return json.dump();
}

}  // namespace

std::optional<Job> flight_job(const PlanOptions& options, const std::vector<std::string>& sequences) {
  const auto tables = words(options.tables);
  if (sequences.empty() || std::find(tables.begin(), tables.end(), "figure4") == tables.end())
    return std::nullopt;
  const auto approach = std::find(sequences.begin(), sequences.end(), "approach");
  const ObstacleMapperOptions mapper = one_pair();
  Job job;
  job.table = "figure4";
  job.sequence = approach == sequences.end() ? sequences.front() : *approach;
  job.flow = flows_of(options, "figure4").front();
  job.derotation = mapper.derotation;
  job.order = mapper.order;
  job.step = options.step;
  job.range = options.range;
  job.cells = {{"pade-exact", mapper.depth, Misreading::none, {}, {}}};
  job.cells.front().depth.range = options.range;
  return job;
}

Result<std::string> run_flight(const Job& job, const io::Sequence& sequence,
                               const std::function<bool()>& go_on) {
  ObstacleMapperOptions options = one_pair();
  options.flow = job.flow;
  options.derotation = job.derotation;
  options.order = job.order;
  options.step = job.step;
  options.depth = job.cells.front().depth;
  auto mapper = ObstacleMapper::create(sequence.camera(), options, sequence.mask());
  if (!mapper) return mapper.error();
  const auto step = static_cast<std::size_t>(job.step);
  const auto shown = chosen(sequence.size() - std::min(sequence.size(), step));
  std::vector<Moment> moments;
  std::vector<Eigen::Vector3d> path;
  double flown = 0;
  for (std::size_t i = 0; i < sequence.size(); ++i) {
    if (go_on && !go_on()) return io::interrupted_and_kept_error();
    const auto frame = sequence.frame(i);
    if (!frame) continue;
    if (!path.empty()) flown += (frame->T_world_camera.translation - path.back()).norm();
    path.push_back(frame->T_world_camera.translation);
    const MapperUpdate& update = mapper->add(frame->image, frame->time, frame->T_world_camera);
    if (update.outcome != MapperUpdate::Outcome::mapped) continue;
    if (std::find(shown.begin(), shown.end(), i - step) == shown.end()) continue;
    moments.push_back(moment_of(update, frame->image, flown, *mapper, path, sequence));
  }
  return to_json(moments, job.range);
}

Status check_flight(std::string_view text, std::string_view file) {
  try {  // nlohmann reports by exceptions; they end here
    const Json json = Json::parse(text);
    static_cast<void>(json.at("depth_scale_m").get<double>());
    for (const Json& moment : json.at("moments")) {
      for (const char* number : {"flown_m", "flow_scale_px"})
        static_cast<void>(moment.at(number).get<double>());
      for (const char* name : {"time", "strip", "map_top", "map_side"})
        static_cast<void>(moment.at(name).get<std::string>());
    }
    return {};
  } catch (const Json::exception& error) {
    return Error{fmt::format("{}: found {}, expected the moments of a flight", file, error.what())};
  }
}

}  // namespace pade::experiment

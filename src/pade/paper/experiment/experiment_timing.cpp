#include "pade/paper/experiment/experiment_timing.hpp"

#include <algorithm>
#include <ctime>
#include <deque>
#include <limits>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>

#include "pade/core/compute/median.hpp"
#include "pade/depth/derotation.hpp"
#include "pade/io/atomic_output.hpp"
#include "pade/mapping/occupancy_map.hpp"

namespace pade::experiment {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kPairs = 5;  // of frames; the first warms caches up and does not count
constexpr int kRepetitions = 3;    // of the short steps

/// Processor time of this thread, which other programs on the machine disturb least.
double thread_milliseconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

/// Milliseconds that `work` takes.
template <class Work>
double time_of(const Work& work) {
  const double start = thread_milliseconds();
  work();
  return thread_milliseconds() - start;
}

/// The steps of one job on its pairs, each with its times.
class Clock {
 public:
  Clock(const Job& job, const io::Sequence& sequence, std::unique_ptr<flow::FlowEstimator> flow,
        mapping::OccupancyMap map)
      : job_(job),
        sequence_(sequence),
        flow_(std::move(flow)),
        map_(std::move(map)),
        depth_(job.cells.size()) {
    for (const DepthCell& cell : job.cells) estimators_.emplace_back(cell.depth);
  }

  void add(const Frame& reference, const Frame& other, bool counts) {
    const RelativeMotion motion = relative_motion(reference.T_world_camera, other.T_world_camera,
                                                  seconds_between(reference.time, other.time));
    const auto note = [counts](std::vector<double>& times, double milliseconds) {
      if (counts) times.push_back(milliseconds);
    };
    cv::Mat seen = other.image;
    if (job_.derotation == depth::Derotation::image) {
      note(derotate_,
           time_of([&] { seen = depth::derotate_image(other.image, sequence_.camera(), motion); }));
    }
    FlowField flow;
    note(flow_times_, time_of([&] { flow = flow_->estimate(reference.image, seen); }));
    DepthImage depth;
    for (int repetition = 0; repetition < kRepetitions; ++repetition) {
      for (std::size_t c = 0; c < estimators_.size(); ++c) {
        note(depth_[c], time_of([&] {
               estimators_[c].estimate(
                   {sequence_.camera(), motion, flow, job_.derotation, reference.image, seen, {}}, depth);
             }));
      }
    }
    if (maps())
      note(map_times_, time_of([&] { map_.integrate(depth, sequence_.camera(), reference.T_world_camera); }));
  }

  [[nodiscard]] JobTimes times() const {
    JobTimes times;
    if (!derotate_.empty()) times.derotate = median(std::vector<double>(derotate_));
    times.flow = median(std::vector<double>(flow_times_));
    for (std::size_t c = 0; c < depth_.size(); ++c)
      times.depth[job_.cells[c].name] = median(std::vector<double>(depth_[c]));
    if (maps()) times.map = median(std::vector<double>(map_times_));
    return times;
  }

 private:
  /// What the map costs hardly depends on the flow: once per sequence is enough.
  [[nodiscard]] bool maps() const {
    return job_.flow == as_printed().flow && job_.cells.back().name == pade_exact;
  }

  const Job& job_;
  const io::Sequence& sequence_;
  std::unique_ptr<flow::FlowEstimator> flow_;
  mapping::OccupancyMap map_;
  std::vector<depth::DepthEstimator> estimators_;
  std::vector<double> derotate_, flow_times_, map_times_;
  std::vector<std::vector<double>> depth_;  // by cell
};

Job timing_job(const PlanOptions& options, const std::string& sequence, const std::string& flow,
               const std::vector<std::string_view>& methods) {
  Job job;
  job.table = "table2";
  job.sequence = sequence;
  job.flow = flow;
  job.step = options.step;
  job.range = options.range;
  for (const std::string_view method : methods) {
    const MethodOptions settings = method_options(method, options.range);
    job.derotation = settings.derotation;
    job.order = settings.order;
    job.cells.push_back({std::string(method), settings.depth, Misreading::none, {}, {}});
  }
  return job;
}

}  // namespace

std::vector<Job> timing_plan(const PlanOptions& options, const std::vector<std::string>& sequences) {
  std::vector<Job> jobs;
  if (sequences.empty()) return jobs;
  const auto tables = words(options.tables);
  const auto wanted = [&](std::string_view table) {
    return std::find(tables.begin(), tables.end(), table) != tables.end();
  };
  if (wanted("table2")) {
    for (const std::string& sequence : sequences) {
      for (const std::string& flow : flows_of(options, "table2")) {
        jobs.push_back(timing_job(options, sequence, flow, {ttc, pade_literal}));
        jobs.push_back(timing_job(options, sequence, flow, {pade_exact}));
      }
    }
  }
  if (wanted("windows")) {
    const auto forward = std::find(sequences.begin(), sequences.end(), "forward");
    PlanOptions only = options;
    only.tables = "windows";
    for (Job& job : plan(only, {forward == sequences.end() ? sequences.front() : *forward}))
      jobs.push_back(std::move(job));
  }
  return jobs;
}

Result<JobTimes> measure_times(const Job& job, const io::Sequence& sequence,
                               const std::function<bool()>& go_on) {
  auto flow = flow::make_flow_estimator(job.flow);
  if (!flow) return flow.error();
  auto map = mapping::OccupancyMap::create(mapping::MapOptions{});
  if (!map) return map.error();
  Clock clock(job, sequence, std::move(flow).value(), std::move(map).value());
  std::deque<Frame> recent;
  std::size_t pairs = 0;
  for (std::size_t i = 0; i < sequence.size() && pairs <= kPairs; ++i) {
    if (go_on && !go_on()) return io::interrupted_and_kept_error();
    auto frame = sequence.frame(i);
    if (!frame) continue;
    if (frame->image.channels() == 3) cv::cvtColor(frame->image, frame->image, cv::COLOR_BGR2GRAY);
    recent.push_back(std::move(frame).value());
    if (recent.size() <= static_cast<std::size_t>(job.step)) continue;
    const bool newest = job.order == Order::newest;
    clock.add(newest ? recent.back() : recent.front(), newest ? recent.front() : recent.back(), pairs > 0);
    ++pairs;
    recent.pop_front();
  }
  return clock.times();
}

std::string to_json(const JobTimes& times) {
  Json json = {{"derotate_ms", times.derotate}, {"flow_ms", times.flow}, {"depth_ms", times.depth}};
  if (times.map) json["map_ms"] = *times.map;
  return json.dump();
}

Result<JobTimes> job_times_from_json(std::string_view text, std::string_view file) {
  try {  // nlohmann reports by exceptions; they end here
    const Json json = Json::parse(text);
    JobTimes times;
    times.derotate = json.at("derotate_ms").get<double>();
    times.flow = json.at("flow_ms").get<double>();
    json.at("depth_ms").get_to(times.depth);
    if (json.contains("map_ms")) times.map = json.at("map_ms").get<double>();
    return times;
  } catch (const Json::exception& error) {
    return Error{fmt::format("{}: found {}, expected the times of a job", file, error.what())};
  }
}

}  // namespace pade::experiment

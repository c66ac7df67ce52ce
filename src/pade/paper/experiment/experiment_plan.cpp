#include "pade/paper/experiment/experiment_plan.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "pade/paper/experiment/experiment_chain.hpp"

namespace pade::experiment {
namespace {

constexpr int kNoiseGrid = 4;  // pixels of figure 3: one of each of the paper's 4 x 4 windows

bool wanted(const PlanOptions& options, std::string_view table) {
  const auto tables = words(options.tables);
  return std::find(tables.begin(), tables.end(), table) != tables.end();
}

DepthCell cell(std::string_view name, std::string_view rival, double range) {
  const depth::DepthOptions depth = method_options(name, range).depth;
  return {
      std::string(name), depth, Misreading::none,
      depth.method == depth::Method::ttc ? evaluation::Measured::forward_speed : evaluation::Measured::motion,
      std::string(rival)};
}

/// A job whose flow suits `method`.
Job job_for(std::string_view table, std::string_view sequence, std::string_view flow, std::string_view method,
            const PlanOptions& options) {
  const MethodOptions settings = method_options(method, options.range);
  Job job;
  job.table = table;
  job.sequence = sequence;
  job.flow = flow;
  job.derotation = settings.derotation;
  job.order = settings.order;
  job.step = options.step;
  job.range = options.range;
  job.seed = static_cast<std::uint64_t>(options.seed);
  return job;
}

void add_table1(const PlanOptions& options, const std::string& sequence, std::vector<Job>& jobs) {
  for (const std::string& flow : flows_of(options, "table1")) {
    for (const auto& [method, rival] : {std::pair{pade_literal, ttc}, std::pair{pade_exact, ttc_exact}}) {
      Job job = job_for("table1", sequence, flow, method, options);
      job.cells = {cell(rival, method, options.range), cell(method, rival, options.range)};
      if (method == pade_exact) job.flow_error_of = pade_exact;
      jobs.push_back(std::move(job));
    }
  }
}

/// All from one flow field, so that noise reaches nothing but the equations.
Job noise_job(const PlanOptions& options, const std::string& sequence, const std::string& flow,
              const evaluation::MotionNoise& noise) {
  Job job = job_for("figure3", sequence, flow, pade_literal, options);
  job.noise = noise;
  job.draws = noise.level == 0 ? 1 : options.draws;
  job.grid = kNoiseGrid;
  job.cells = {cell(ttc, pade_literal, options.range), cell(pade_literal, ttc, options.range),
               cell(pade_exact, "", options.range)};
  return job;
}

void add_figure3(const PlanOptions& options, const std::string& sequence, std::vector<Job>& jobs) {
  for (const std::string& flow : flows_of(options, "figure3")) {
    for (const evaluation::MotionNoise& noise : all_noises()) {
      Job job = noise_job(options, sequence, flow, noise);
      job.bound_sigma = options.bound_sigma;
      job.cells.push_back(cell(ttc, "", options.range));
      job.cells.back().name = ttc_velocity;
      job.cells.back().measured = evaluation::Measured::speed_alone;
      jobs.push_back(std::move(job));
    }
  }
  for (const std::string& flow : other_noisy_flows(options)) {
    for (const double level : {0.0, noise_levels.back()})
      jobs.push_back(noise_job(options, sequence, flow, {evaluation::NoiseModel::multiplicative, level}));
  }
}

void add_windows(const PlanOptions& options, const std::string& sequence, std::vector<Job>& jobs) {
  for (const std::string& flow : flows_of(options, "windows")) {
    for (const std::string_view method : {pade_literal, pade_exact}) {
      Job job = job_for("windows", sequence, flow, method, options);
      for (const int n : window_sizes) {
        for (const std::string_view name : {method, method == pade_literal ? ttc : ttc_exact}) {
          DepthCell sized = cell(name, "", options.range);
          sized.name = fmt::format("{}-n{}", name, n);
          sized.depth.window = n;
          job.cells.push_back(std::move(sized));
        }
      }
      jobs.push_back(std::move(job));
    }
  }
}

/// The paper's flow with one thing changed at a time.
void add_errata(const PlanOptions& options, const std::string& sequence, std::vector<Job>& jobs) {
  for (const std::string& flow : flows_of(options, "errata")) {
    Job job = job_for("errata", sequence, flow, pade_literal, options);
    for (const Misreading misreading :
         {Misreading::none, Misreading::signs_of_eq1, Misreading::sign_of_rotation,
          Misreading::world_translation, Misreading::euler_difference, Misreading::avionics_names}) {
      DepthCell changed = cell(pade_literal, "", options.range);
      changed.misreading = misreading;
      changed.name = misreading == Misreading::none ? "pade-literal" : to_name(misreading);
      job.cells.push_back(std::move(changed));
    }
    DepthCell reading = cell(pade_literal, "", options.range);
    reading.name = "least-squares";
    reading.depth.reading = depth::Reading::least_squares;
    job.cells.push_back(reading);
    DepthCell window = reading;
    window.name = "every-pixel";
    window.depth.window = 1;
    job.cells.push_back(window);
    DepthCell finite = window;
    finite.name = "finite-motion-without-tz";
    finite.depth.model = depth::Model::exact;
    finite.misreading = Misreading::without_tz;
    job.cells.push_back(finite);
    finite.name = "finite-motion";
    finite.misreading = Misreading::none;
    job.cells.push_back(finite);
    jobs.push_back(std::move(job));

    Job turned = job_for("errata", sequence, flow, pade_exact, options);
    DepthCell homography = cell(pade_exact, "", options.range);
    homography.name = "homography";
    turned.cells.push_back(homography);
    homography.name = "gates";
    homography.depth.gates = depth::Gates::on;
    turned.cells.push_back(homography);
    jobs.push_back(std::move(turned));
  }
}

void add_beyond(const PlanOptions& options, const std::string& sequence, std::vector<Job>& jobs) {
  for (const evaluation::MotionNoise& noise : chain_noises()) {
    for (const ChainMethod& method : chain_methods()) {
      if (noise.level == 0 && method.only_with_noise) continue;
      Job job;
      job.table = "beyond";
      job.sequence = sequence;
      job.chain = method.name;
      job.flow = chain_options(method.name, options.range).flow;
      job.range = options.range;
      job.noise = noise;
      job.seed = static_cast<std::uint64_t>(options.seed);
      for (const std::string& name : {std::string(method.name), scaled_cell(method.name)}) {
        DepthCell cell;
        cell.name = name;
        cell.depth = chain_options(method.name, options.range).depth;
        job.cells.push_back(std::move(cell));
      }
      jobs.push_back(std::move(job));
    }
  }
}

}  // namespace

std::vector<std::string> words(std::string_view list) {
  std::vector<std::string> parts;
  while (!list.empty()) {
    const auto comma = std::min(list.find(','), list.size());
    if (comma > 0) parts.emplace_back(list.substr(0, comma));
    list.remove_prefix(std::min(comma + 1, list.size()));
  }
  return parts;
}

std::vector<std::string> flows_of(const PlanOptions& options, std::string_view table) {
  if (!options.flows.empty()) return words(options.flows);
  if (table == "table1" || table == "table2") {
    return {"clg-accurate", "clg-fast", "farneback",       "lucas-kanade",
            "dis-medium",   "dis-fast", "opencv-farneback"};
  }
  if (table == "figure3") return {"lucas-kanade"};
  return {"dis-medium"};
}

std::vector<evaluation::MotionNoise> all_noises() {
  std::vector<evaluation::MotionNoise> noises = {{}};
  for (const auto model : {evaluation::NoiseModel::multiplicative, evaluation::NoiseModel::additive}) {
    for (const double level : noise_levels) {
      if (level > 0) noises.push_back({model, level});
    }
  }
  return noises;
}

std::vector<std::string> other_noisy_flows(const PlanOptions& options) {
  if (!options.flows.empty()) return {};
  return {"clg-accurate", "clg-fast", "farneback", "dis-medium", "dis-fast"};
}

const std::vector<ErratumRow>& errata_rows() {
  static const std::vector<ErratumRow> rows = {
      {"pade-literal", "literal PADE: signs, frames and rotation put right, the rest as printed"},
      {"signs-of-eq1", "erratum 1: signs of Eq. 1 as printed"},
      {"sign-of-rotation", "erratum 1: only the sign of Z put right"},
      {"world-translation", "erratum 2: translation left in the world frame"},
      {"euler-difference", "erratum 3: difference of Euler angles for a rotation"},
      {"avionics-names", "erratum 4: roll, pitch, yaw as r_x, r_y, r_z"},
      {"least-squares", "erratum 5: least squares in place of the Samelson inverse"},
      {"every-pixel", "and every pixel (n = 1)"},
      {"finite-motion-without-tz", "and derotation by the rotation matrix, not B omega"},
      {"finite-motion", "erratum 6: and t_z added"},
      {"homography", "and the image derotated before matching, newest frame: exact PADE"},
      {"gates", "and doubtful pixels left out: what pade map does"},
  };
  return rows;
}

MethodOptions method_options(std::string_view method, double range) {
  MethodOptions out;
  const bool exact = method == pade_exact || method == ttc_exact;
  const ObstacleMapperOptions mapper = exact ? one_pair() : as_printed();
  out.depth = mapper.depth;
  out.derotation = mapper.derotation;
  out.order = mapper.order;
  out.depth.gates = depth::Gates::off;
  out.depth.range = range;
  if (method == ttc || method == ttc_exact) {
    out.depth.method = depth::Method::ttc;
    out.depth.reading = depth::Reading::least_squares;  // T = |p - e|^2 / ((p - e) . d)
  }
  return out;
}

std::vector<Job> plan(const PlanOptions& options, const std::vector<std::string>& sequences) {
  std::vector<Job> jobs;
  for (const std::string& sequence : sequences) {
    if (wanted(options, "table1")) add_table1(options, sequence, jobs);
    if (wanted(options, "figure3")) add_figure3(options, sequence, jobs);
    if (wanted(options, "windows")) add_windows(options, sequence, jobs);
    if (wanted(options, "errata")) add_errata(options, sequence, jobs);
    if (wanted(options, "beyond")) add_beyond(options, sequence, jobs);
  }
  return jobs;
}

}  // namespace pade::experiment

#include "pade/paper/tables/experiment_tables.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "pade/paper/verdicts/paper_values.hpp"
#include "pade/report/report_text.hpp"
#include "pade/report/tables/accuracy_tables.hpp"

namespace pade::experiment {
namespace {

using evaluation::DepthAccuracy;
using evaluation::Interval;
using evaluation::MotionNoise;
using evaluation::NoiseModel;
using evaluation::number_text;
using evaluation::percent_text;
using evaluation::RangeAccuracy;
using evaluation::ResultTable;

constexpr std::size_t kPaperRanges = 4;  // the paper shows these, not what lies beyond
constexpr const char* kMeanMedianCoverage =
    "Absolute depth error in m: mean ± standard deviation over pixels (median; coverage), pooled over the "
    "pixels "
    "of a sequence and averaged over sequences. All pixels with truth, gates off; a depth beyond the range "
    "limit is "
    "none.";

std::string cell_text(const RangeAccuracy& range) {
  if (range.pixels == 0) return "–";
  return fmt::format("{} ± {} ({}; {})", number_text(range.mean, 2), number_text(range.deviation, 2),
                     number_text(range.median, 3), percent_text(range.coverage));
}

std::vector<std::string> range_columns(std::vector<std::string> first) {
  for (const char* range : {"0-4 m", "4-8 m", "8-12 m", "12-16 m"}) first.emplace_back(range);
  return first;
}

void add_ranges(const DepthAccuracy& accuracy, std::vector<std::string>& row) {
  for (std::size_t i = 0; i < kPaperRanges; ++i) row.push_back(cell_text(accuracy.ranges.at(i)));
}

std::string interval_text(const Interval& interval) {
  if (std::isnan(interval.estimate)) return "–";
  if (std::isnan(interval.low)) return fmt::format("{:+.3f}", interval.estimate);
  return fmt::format("{:+.3f} ({:+.3f} to {:+.3f})", interval.estimate, interval.low, interval.high);
}

ResultTable make(const Results& results, std::string name, std::string title, std::string note) {
  ResultTable table;
  table.command = command_of(results.options, name);
  table.name = std::move(name);
  table.title = std::move(title);
  table.note = std::move(note);
  return table;
}

/// Mean over draws, per paper range.
evaluation::PaperRanges mean_of(const std::vector<evaluation::RangeMeans>& draws) {
  evaluation::PaperRanges means = evaluation::no_figures;
  for (std::size_t i = 0; i < kPaperRanges; ++i) {
    double sum = 0;
    int count = 0;
    for (const evaluation::RangeMeans& draw : draws) {
      const double mean = draw.mean(i);
      if (std::isnan(mean)) continue;
      sum += mean;
      ++count;
    }
    if (count > 0) means.at(i) = sum / count;
  }
  return means;
}

/// What the paper prints for a flow and method like this one.
std::string paper_row(std::string_view flow, std::string_view cell) {
  const auto paper = evaluation::paper_flow(flow);
  if (!paper || cell == ttc_exact) return "–";
  const auto errors =
      evaluation::paper_errors(cell == ttc ? evaluation::paper_ttc : evaluation::paper_pade, *paper);
  if (!errors) return "–";
  std::string text;
  for (const evaluation::PaperError& range : errors->ranges) {
    text += fmt::format("{}{:.2f} ± {:.2f}", text.empty() ? "" : " / ", range.mean, range.deviation);
  }
  return text;
}

evaluation::MethodErrors errors_of(const CellResult* cell) {
  if (cell == nullptr) return {};
  return {mean_of(cell->draws), mean_of(cell->together)};
}

/// The cells of both methods side by side, as the verdicts want them.
void add_error_rows(const Results& results, std::string_view table, std::string_view flow,
                    std::string_view ttc_cell, std::string_view pade_cell, const MotionNoise& noise,
                    evaluation::NoiseOn noise_on, std::vector<evaluation::ErrorRow>& rows) {
  const auto pade_cells = results.cells(table, flow, pade_cell, noise);
  for (const SequenceCell& of_ttc : results.cells(table, flow, ttc_cell, noise)) {
    const auto same = std::find_if(pade_cells.begin(), pade_cells.end(), [&](const SequenceCell& cell) {
      return cell.sequence == of_ttc.sequence;
    });
    evaluation::ErrorRow row;
    row.sequence = of_ttc.sequence;
    row.flow = flow;
    row.noise = noise.level;
    row.noise_on = noise_on;
    row.ttc = errors_of(of_ttc.cell);
    row.pade = same == pade_cells.end() ? evaluation::MethodErrors{} : errors_of(same->cell);
    rows.push_back(std::move(row));
  }
}

}  // namespace

std::string shown_name(std::string_view cell) {
  if (cell == ttc) return "TTC";
  if (cell == pade_literal) return "PADE literal";
  if (cell == pade_exact) return "PADE exact";
  if (cell == ttc_exact) return "TTC exact";
  if (cell == ttc_velocity) return "TTC, noise on speed only";
  return std::string(cell);
}

std::string command_of(const PlanOptions& options, std::string_view table) {
  std::string command = fmt::format("pade experiment {} --out OUT", table);
  if (!options.source.empty()) command += " " + options.source;
  if (!options.flows.empty()) command += " --flow " + options.flows;
  const PlanOptions usual;
  if (options.step != usual.step) command += fmt::format(" --step {}", options.step);
  if (options.range != usual.range) command += fmt::format(" --range {:g}", options.range);
  if (options.draws != usual.draws) command += fmt::format(" --draws {}", options.draws);
  if (options.seed != usual.seed) command += fmt::format(" --seed {}", options.seed);
  if (!options.flights.empty()) command += " --flights FLIGHTS/grid.json";
  return command;
}

ResultTable table1(const Results& results) {
  ResultTable table = make(results, "table1", "Table 1: absolute depth error by range", kMeanMedianCoverage);
  table.columns = range_columns({"flow", "depth"});
  table.columns.emplace_back("paper");
  for (const std::string& flow : flows_of(results.options, "table1")) {
    for (const std::string_view cell : {ttc, pade_literal, pade_exact, ttc_exact}) {
      std::vector<std::string> row = {flow, shown_name(cell)};
      add_ranges(mean_over(results.cells("table1", flow, cell)), row);
      row.push_back(paper_row(flow, cell));
      table.rows.push_back(std::move(row));
    }
  }
  return table;
}

ResultTable answers_by_sequence(const Results& results) {
  const auto flows = flows_of(results.options, "table1");
  const bool usual = std::find(flows.begin(), flows.end(), "lucas-kanade") != flows.end();
  const std::string flow = usual ? "lucas-kanade" : flows.front();
  ResultTable table =
      make(results, "table1", "Table 1 by sequence",
           fmt::format("Flow: {}. Mean error over all pixels with an answer, and the share of pixels "
                       "with truth that have one. Without motion along the optical axis TTC has no "
                       "focus of expansion, and says \"no depth\".",
                       flow));
  table.name = "table1-sequences";
  table.columns = {"sequence"};
  const std::array methods = {ttc, pade_literal, pade_exact};
  for (const std::string_view method : methods) {
    table.columns.push_back(shown_name(method) + ", ADE m");
    table.columns.emplace_back("coverage");
  }
  for (const std::string& sequence : results.sequences) {
    std::vector<std::string> row = {sequence};
    for (const std::string_view method : methods) {
      for (const SequenceCell& cell : results.cells("table1", flow, method)) {
        if (cell.sequence != sequence) continue;
        row.push_back(number_text(cell.cell->accuracy.all.mean, 2));
        row.push_back(percent_text(cell.cell->accuracy.all.coverage));
      }
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

ResultTable flow_errors_table(const Results& results) {
  ResultTable table = make(results, "table1", "Flow error behind exact PADE",
                           "Per range: mean error of the flow along the epipolar line of mean true parallax "
                           "[px]; the depth error that an "
                           "error of this size causes in an estimate that reaches the Cramér-Rao bound; in "
                           "brackets the error measured [m]. "
                           "On pixels with an answer, means over sequences. Exact PADE from exact flow is "
                           "right to 1e-4: what stands in "
                           "brackets is the flow's.");
  table.name = "table1-flow";
  table.columns = range_columns({"flow"});
  for (const std::string& flow : flows_of(results.options, "table1")) {
    const evaluation::DepthAccuracy measured = mean_over(results.cells("table1", flow, pade_exact));
    std::vector<std::string> row = {flow};
    for (std::size_t range = 0; range < kPaperRanges; ++range) {
      double error = 0, parallax = 0, depth = 0;
      int count = 0;
      for (const DoneJob& done : results.jobs) {
        const auto& found = done.result.flow_error;
        if (done.job.table != "table1" || done.job.flow != flow || !found ||
            found->error.pixels.at(range) == 0)
          continue;
        error += found->error.mean(range);
        parallax += found->parallax.mean(range);
        depth += found->error.mean(range) * found->metres_per_px.mean(range);
        ++count;
      }
      row.push_back(count == 0
                        ? "–"
                        : fmt::format("{:.3f} of {:.2f} px: {:.2f} m ({} m)", error / count, parallax / count,
                                      depth / count, number_text(measured.ranges.at(range).mean, 2)));
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

NoisePoint noise_point(const Results& results, std::string_view flow, std::string_view cell,
                       const MotionNoise& noise) {
  NoisePoint point;
  const auto cells = results.cells("figure3", flow, cell, noise);
  for (std::size_t range = 0; range < evaluation::range_count; ++range) {
    std::vector<double> draws;
    for (std::size_t draw = 0; !cells.empty() && draw < cells.front().cell->draws.size(); ++draw) {
      double sum = 0;
      int count = 0;
      for (const SequenceCell& one : cells) {
        const double mean = one.cell->draws.at(draw).mean(range);
        if (std::isnan(mean)) continue;
        sum += mean;
        ++count;
      }
      if (count > 0) draws.push_back(sum / count);
    }
    point.ranges.at(range) = evaluation::bootstrap_mean(draws);
  }
  return point;
}

NoisePoint bound_point(const Results& results, std::string_view flow, const MotionNoise& noise) {
  NoisePoint point;
  for (std::size_t range = 0; range < evaluation::range_count; ++range) {
    double sum = 0;
    int count = 0;
    for (const DoneJob& done : results.jobs) {
      const Job& job = done.job;
      const bool same_noise =
          job.noise.level == noise.level && (noise.level == 0 || job.noise.model == noise.model);
      if (job.table != "figure3" || job.flow != flow || !same_noise || !done.result.bound) continue;
      const double mean = done.result.bound->mean(range);
      if (std::isnan(mean)) continue;
      sum += mean;
      ++count;
    }
    if (count > 0) point.ranges.at(range).estimate = sum / count;
  }
  return point;
}

ResultTable figure3_table(const Results& results) {
  const PlanOptions& options = results.options;
  ResultTable table = make(
      results, "figure3", "Figure 3: absolute depth error against noise of the position measurement",
      fmt::format(
          "Mean error in m; the bracket holds the mean over {} draws of the noise with 95 % confidence. "
          "Noise "
          "of level p: multiplicative = each component times 1 + uniform in ±p (PADE: t and ω; TTC: v_z and "
          "ω); additive = normal, 0.2 m p per axis and 1° p per axis. Flow is derotated after matching, so "
          "that noise reaches the equations only. Every {}th pixel and row. Bound: the least mean error that "
          "two frames allow an unbiased estimate, flow noise {:g} px and the same noise of the pose, drawn "
          "and counted like the others: behind the camera and beyond the range limit is none, which keeps "
          "errors under much noise small in the far ranges. The bound holds for all pixels that PADE "
          "answers; "
          "TTC leaves out the flights without forward motion, and is spared the noise across the axis.",
          options.draws, 4, options.bound_sigma));
  table.columns = range_columns({"flow", "noise", "p", "depth"});
  const auto add = [&](const std::string& flow, const MotionNoise& noise, const std::string& name,
                       const NoisePoint& point) {
    std::vector<std::string> row = {flow, std::string(noise.level == 0 ? "none" : to_name(noise.model)),
                                    fmt::format("{:.0f} %", 100 * noise.level), name};
    for (std::size_t i = 0; i < kPaperRanges; ++i) {
      const Interval& range = point.ranges.at(i);
      row.push_back(std::isnan(range.low) || noise.level == 0
                        ? number_text(range.estimate, 3)
                        : fmt::format("{:.3f} ({:.3f}-{:.3f})", range.estimate, range.low, range.high));
    }
    table.rows.push_back(std::move(row));
  };
  for (const std::string& flow : flows_of(options, "figure3")) {
    for (const MotionNoise& noise : all_noises()) {
      for (const std::string_view cell : {ttc, ttc_velocity, pade_literal, pade_exact}) {
        if (noise.level > 0 || cell != ttc_velocity)
          add(flow, noise, shown_name(cell), noise_point(results, flow, cell, noise));
      }
      add(flow, noise, "bound", bound_point(results, flow, noise));
    }
  }
  for (const std::string& flow : other_noisy_flows(options)) {
    for (const double level : {0.0, noise_levels.back()}) {
      for (const std::string_view cell : {ttc, pade_literal, pade_exact}) {
        const MotionNoise noise{NoiseModel::multiplicative, level};
        add(flow, noise, shown_name(cell), noise_point(results, flow, cell, noise));
      }
    }
  }
  return table;
}

ResultTable windows_table(const Results& results) {
  ResultTable table =
      make(results, "windows", "Accuracy against the size n of the averaging window", kMeanMedianCoverage);
  table.columns = range_columns({"flow", "depth", "n"});
  for (const std::string& flow : flows_of(results.options, "windows")) {
    for (const std::string_view cell : {ttc, pade_literal, pade_exact, ttc_exact}) {
      for (const int n : window_sizes) {
        std::vector<std::string> row = {flow, shown_name(cell), std::to_string(n)};
        add_ranges(mean_over(results.cells("windows", flow, fmt::format("{}-n{}", cell, n))), row);
        table.rows.push_back(std::move(row));
      }
    }
  }
  return table;
}

ResultTable errata_table(const Results& results) {
  ResultTable table = make(results, "errata", "What the errata are worth",
                           std::string(kMeanMedianCoverage) +
                               " The first block changes one thing at a time in literal PADE; from least "
                               "squares on each row keeps what "
                               "the rows before it changed.");
  table.columns = range_columns({"flow", "switched"});
  for (const std::string& flow : flows_of(results.options, "errata")) {
    for (const ErratumRow& erratum : errata_rows()) {
      std::vector<std::string> row = {flow, std::string(erratum.meaning)};
      add_ranges(mean_over(results.cells("errata", flow, erratum.name)), row);
      table.rows.push_back(std::move(row));
    }
  }
  return table;
}

namespace {

/// Clean motion, on all pixels.
void add_table1_rows(const Results& results, const std::string& flow, std::string_view pade,
                     std::vector<evaluation::ErrorRow>& rows) {
  const std::string_view rival = pade == pade_exact ? ttc_exact : ttc;
  add_error_rows(results, "table1", flow, rival, pade, {}, evaluation::NoiseOn::motion, rows);
}

/// Literal PADE without noise and with all of its levels, on a grid of pixels.
void add_figure3_rows(const Results& results, std::vector<evaluation::ErrorRow>& rows) {
  std::vector<std::string> flows = flows_of(results.options, "figure3");
  for (const std::string& flow : other_noisy_flows(results.options)) flows.push_back(flow);
  for (const std::string& flow : flows) {
    for (const double level : noise_levels) {
      const MotionNoise noise{NoiseModel::multiplicative, level};
      add_error_rows(results, "figure3", flow, ttc, pade_literal, noise, evaluation::NoiseOn::motion, rows);
      if (level > 0) {
        add_error_rows(results, "figure3", flow, ttc_velocity, pade_literal, noise,
                       evaluation::NoiseOn::velocity, rows);
      }
    }
  }
}

}  // namespace

std::vector<evaluation::ErrorRow> clean_rows(const Results& results, std::string_view pade) {
  std::vector<evaluation::ErrorRow> rows;
  for (const std::string& flow : flows_of(results.options, "table1"))
    add_table1_rows(results, flow, pade, rows);
  return rows;
}

std::vector<evaluation::ErrorRow> error_rows(const Results& results, std::string_view pade) {
  std::vector<evaluation::ErrorRow> rows;
  const bool noise = results.has("figure3") && pade == pade_literal;
  if (results.has("table1")) {
    for (const std::string& flow : flows_of(results.options, "table1")) {
      if (!noise || results.cells("figure3", flow, pade, {}).empty())
        add_table1_rows(results, flow, pade, rows);
    }
  }
  if (noise) add_figure3_rows(results, rows);
  return rows;
}

ResultTable comparison_table(const Results& results, std::string_view pade, std::string_view source) {
  const bool clean = source == "table1";
  std::vector<evaluation::ErrorRow> rows;
  if (clean) {
    rows = clean_rows(results, pade);
  } else {
    add_figure3_rows(results, rows);
  }
  ResultTable table = make(
      results, std::string(source),
      fmt::format("{} against TTC{}: TTC's error less PADE's", shown_name(pade), clean ? "" : " under noise"),
      fmt::format(
          "Difference of the mean errors in m, mean over sequences with its 95 % bootstrap interval over "
          "sequences: positive where PADE is ahead. Sequences where TTC has no answer are left out.{}",
          clean ? "" : " Noise is multiplicative; every 4th pixel and row."));
  table.name =
      fmt::format("comparison-{}{}", pade == pade_literal ? "literal" : "exact", clean ? "" : "-noise");
  table.columns = range_columns({"flow", "p", "pixels"});
  for (const evaluation::Comparison& comparison : evaluation::compare_methods(rows)) {
    for (const bool common : {true, false}) {
      std::vector<std::string> row = {comparison.flow, fmt::format("{:.0f} %", 100 * comparison.noise),
                                      common ? "both answer" : "all"};
      for (const Interval& interval : common ? comparison.common : comparison.all)
        row.push_back(interval_text(interval));
      table.rows.push_back(std::move(row));
    }
  }
  return table;
}

evaluation::DataTable all_cells(const Results& results) {
  evaluation::DataTable data;
  data.name = "cells";
  data.columns = {"table",      "sequence",     "flow",         "derotate",
                  "order",      "depth",        "noise",        "level",
                  "range",      "truth_pixels", "pixels",       "coverage",
                  "ade_mean_m", "ade_std_m",    "ade_median_m", "share_over_25_percent"};
  for (const DoneJob& done : results.jobs) {
    const Job& job = done.job;
    for (const CellResult& cell : done.result.cells) {
      std::vector<const RangeAccuracy*> ranges;
      for (const RangeAccuracy& range : cell.accuracy.ranges) ranges.push_back(&range);
      ranges.push_back(&cell.accuracy.all);
      for (const RangeAccuracy* range : ranges) {
        data.rows.push_back({job.table, job.sequence, job.flow, std::string(to_name(job.derotation)),
                             std::string(to_name(job.order)), cell.name,
                             std::string(job.noise.level > 0 ? to_name(job.noise.model) : "none"),
                             job.noise.level, evaluation::range_name(*range), range->truth_pixels,
                             range->pixels, range->coverage, range->mean, range->deviation, range->median,
                             range->outliers});
      }
    }
  }
  return data;
}

}  // namespace pade::experiment

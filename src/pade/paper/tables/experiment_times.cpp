#include "pade/paper/tables/experiment_times.hpp"

#include <algorithm>
#include <fstream>
#include <optional>
#include <thread>

#include <fmt/format.h>

#include "pade/core/compute/simd.hpp"
#include "pade/paper/tables/experiment_tables.hpp"
#include "pade/paper/verdicts/paper_values.hpp"
#include "pade/report/report_text.hpp"

namespace pade::experiment {
namespace {

using evaluation::number_text;

/// Means over sequences, milliseconds.
struct Times {
  double flow = 0;  // derotation of the image included
  double depth = 0;
};

std::optional<Times> mean_times(const Results& results, std::string_view flow, std::string_view cell) {
  Times sum;
  int count = 0;
  for (const DoneTiming& done : results.timing) {
    if (done.job.table != "table2" || done.job.flow != flow) continue;
    const auto depth = done.times.depth.find(std::string(cell));
    if (depth == done.times.depth.end()) continue;
    sum.flow += done.times.flow + done.times.derotate;
    sum.depth += depth->second;
    ++count;
  }
  if (count == 0) return std::nullopt;
  return Times{sum.flow / count, sum.depth / count};
}

double mean_map_time(const Results& results) {
  double sum = 0;
  int count = 0;
  for (const DoneTiming& done : results.timing) {
    if (!done.times.map) continue;
    sum += *done.times.map;
    ++count;
  }
  return count > 0 ? sum / count : evaluation::no_figure;
}

std::optional<evaluation::PaperTime> paper_time_of(std::string_view flow, std::string_view cell) {
  const auto paper = evaluation::paper_flow(flow);
  if (!paper) return std::nullopt;
  return evaluation::paper_time(cell == ttc ? evaluation::paper_ttc : evaluation::paper_pade, *paper);
}

}  // namespace

evaluation::ResultTable table2(const Results& results) {
  evaluation::ResultTable table;
  table.name = "table2";
  table.title = "Table 2: time per frame, one core";
  table.command = command_of(results.options, "table2");
  table.note = fmt::format(
      "Milliseconds of processor time, medians over a few pairs of frames of each sequence, mean over "
      "sequences; flow includes "
      "derotating the image where that is done. As in the paper the total is flow and depth; the map's "
      "update comes "
      "on top: {} ms (voxels of 0.1 m, range 20 m). Ratio: the paper's total over ours, on different "
      "machines. {}.",
      number_text(mean_map_time(results), 0), machine());
  table.columns = {"flow",        "depth", "flow ms", "depth ms",   "total ms", "per second",
                   "paper: flow", "depth", "total",   "per second", "ratio"};
  for (const std::string& flow : flows_of(results.options, "table2")) {
    for (const std::string_view cell : {ttc, pade_literal, pade_exact}) {
      const auto times = mean_times(results, flow, cell);
      if (!times) continue;
      const double total = times->flow + times->depth;
      std::vector<std::string> row = {flow,
                                      shown_name(cell),
                                      number_text(times->flow, 1),
                                      number_text(times->depth, 2),
                                      number_text(total, 1),
                                      number_text(1000 / total, 0)};
      if (const auto paper = paper_time_of(flow, cell)) {
        for (const double value : {paper->flow_ms, paper->depth_ms, paper->total_ms})
          row.push_back(number_text(value, 0));
        row.push_back(number_text(paper->frames_per_second, 2));
        row.push_back(number_text(paper->total_ms / total, 0));
      } else {
        row.insert(row.end(), 5, "–");
      }
      table.rows.push_back(std::move(row));
    }
  }
  return table;
}

evaluation::ResultTable windows_times(const Results& results) {
  evaluation::ResultTable table;
  table.name = "windows-times";
  table.title = "Time of the depth step against the size n of the averaging window";
  table.command = command_of(results.options, "windows");
  table.note = "Milliseconds of processor time per frame, flow not included. " + machine() + ".";
  table.columns = {"flow", "depth"};
  for (const int n : window_sizes) table.columns.push_back(fmt::format("n = {}", n));
  for (const std::string& flow : flows_of(results.options, "windows")) {
    for (const std::string_view cell : {ttc, pade_literal, pade_exact, ttc_exact}) {
      std::vector<std::string> row = {flow, shown_name(cell)};
      for (const int n : window_sizes) {
        double value = evaluation::no_figure;
        for (const DoneTiming& done : results.timing) {
          const auto found = done.times.depth.find(fmt::format("{}-n{}", cell, n));
          if (done.job.table == "windows" && done.job.flow == flow && found != done.times.depth.end())
            value = found->second;
        }
        row.push_back(number_text(value, 2));
      }
      table.rows.push_back(std::move(row));
    }
  }
  return table;
}

std::vector<evaluation::TimeRow> time_rows(const Results& results) {
  std::vector<evaluation::TimeRow> rows;
  for (const DoneTiming& done : results.timing) {
    const auto& depth = done.times.depth;
    if (done.job.table != "table2" || !depth.contains(std::string(pade_literal))) continue;
    rows.push_back({done.job.sequence, done.job.flow, done.times.flow, depth.at(std::string(ttc)),
                    depth.at(std::string(pade_literal))});
  }
  return rows;
}

std::string machine() {
  std::ifstream info("/proc/cpuinfo");
  std::string processor = "unknown processor";
  for (std::string line; std::getline(info, line);) {
    if (!line.starts_with("model name")) continue;
    processor = line.substr(std::min(line.find(':') + 2, line.size()));
    break;
  }
  return fmt::format("{}, {} cores, {}", processor, std::thread::hardware_concurrency(),
                     simd::name(simd::best()));
}

}  // namespace pade::experiment

#include "pade/report/tables/accuracy_tables.hpp"

#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace pade::evaluation {
namespace {

using Json = nlohmann::ordered_json;

// The columns of CSV and JSON; the table shows the same in fewer characters.
constexpr std::array<std::pair<const char*, double RangeAccuracy::*>, 10> kFigures = {{
    {"coverage", &RangeAccuracy::coverage},
    {"ade_mean_m", &RangeAccuracy::mean},
    {"ade_std_m", &RangeAccuracy::deviation},
    {"ade_median_m", &RangeAccuracy::median},
    {"absrel_mean", &RangeAccuracy::relative_mean},
    {"absrel_median", &RangeAccuracy::relative_median},
    {"share_over_25_percent", &RangeAccuracy::outliers},
    {"share_within_1_sigma", &RangeAccuracy::within_1_sigma},
    {"share_within_2_sigma", &RangeAccuracy::within_2_sigma},
    {"rms_error_over_sigma", &RangeAccuracy::rms_of_sigma},
}};
constexpr std::array<std::pair<const char*, std::uint64_t RangeAccuracy::*>, 3> kCounts = {{
    {"truth_pixels", &RangeAccuracy::truth_pixels},
    {"pixels", &RangeAccuracy::pixels},
    {"sigma_pixels", &RangeAccuracy::sigma_pixels},
}};

// The order of the rows everywhere.
template <class Accuracy>
auto rows_of(Accuracy& accuracy) {
  using Row = std::conditional_t<std::is_const_v<Accuracy>, const RangeAccuracy, RangeAccuracy>;
  std::array<Row*, range_count + 1> rows{};
  for (std::size_t i = 0; i < range_count; ++i) rows[i] = &accuracy.ranges[i];
  rows.back() = &accuracy.all;
  return rows;
}

// NaN and infinity have no JSON; they become null.
Json finite_or_null(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

std::string percent(double share) { return std::isnan(share) ? "-" : fmt::format("{:.1f} %", 100 * share); }
std::string metres(double value) { return std::isnan(value) ? "-" : fmt::format("{:.3f}", value); }

constexpr const char* kTableRow = "{:<12} {:>9} {:>9} {:>17} {:>8} {:>8} {:>8} {:>8}";
constexpr const char* kSigmaColumns = " {:>8} {:>8} {:>8}";

std::string table_row(const RangeAccuracy& range, bool with_sigma) {
  const std::string spread =
      std::isnan(range.mean) ? "-" : fmt::format("{:.3f} ± {:.3f}", range.mean, range.deviation);
  std::string row =
      fmt::format(fmt::runtime(kTableRow), range_name(range), range.truth_pixels, percent(range.coverage),
                  spread, metres(range.median), percent(range.relative_mean), percent(range.relative_median),
                  percent(range.outliers));
  if (with_sigma) {
    row +=
        fmt::format(fmt::runtime(kSigmaColumns), percent(range.within_1_sigma), percent(range.within_2_sigma),
                    std::isnan(range.rms_of_sigma) ? "-" : fmt::format("{:.2f}", range.rms_of_sigma));
  }
  return row + "\n";
}

}  // namespace

std::string range_name(const RangeAccuracy& range) {
  if (!std::isinf(range.to)) return fmt::format("{:g}-{:g} m", range.from, range.to);
  return range.from > 0 ? fmt::format("beyond {:g} m", range.from) : "all";
}

std::string to_table(const DepthAccuracy& accuracy) {
  const bool with_sigma = accuracy.all.sigma_pixels > 0;
  std::string table = fmt::format(fmt::runtime(kTableRow), "true depth", "pixels", "coverage",
                                  "ADE mean ± std", "median", "AbsRel", "median", "> 25 %");
  if (with_sigma) table += fmt::format(fmt::runtime(kSigmaColumns), "within σ", "2 σ", "rms e/σ");
  table += "\n";
  for (const RangeAccuracy* row : rows_of(accuracy)) table += table_row(*row, with_sigma);
  table += fmt::format("{} depth images with truth; errors in metres over the pixels with an estimate",
                       accuracy.frames);
  if (accuracy.max_depth > 0) table += fmt::format("; beyond {:g} m counts as no depth", accuracy.max_depth);
  if (std::isnan(accuracy.max_depth)) table += "; the runs have different limits of depth";
  return table + "\n";
}

std::string to_csv(const DepthAccuracy& accuracy) {
  std::string csv = "range,from_m,to_m";
  for (const auto& [name, field] : kCounts) csv += fmt::format(",{}", name);
  for (const auto& [name, field] : kFigures) csv += fmt::format(",{}", name);
  csv += "\n";
  for (const RangeAccuracy* row : rows_of(accuracy)) {
    csv += fmt::format("{},{},{}", range_name(*row), row->from,
                       std::isinf(row->to) ? "" : fmt::format("{}", row->to));
    for (const auto& [name, field] : kCounts) csv += fmt::format(",{}", row->*field);
    for (const auto& [name, field] : kFigures) {
      csv += std::isfinite(row->*field) ? fmt::format(",{}", row->*field) : ",";
    }
    csv += "\n";
  }
  return csv;
}

Json json_of(const DepthAccuracy& accuracy) {
  Json ranges = Json::array();
  for (const RangeAccuracy* row : rows_of(accuracy)) {
    Json range = {{"range", range_name(*row)}, {"from_m", row->from}, {"to_m", finite_or_null(row->to)}};
    for (const auto& [name, field] : kCounts) range[name] = row->*field;
    for (const auto& [name, field] : kFigures) range[name] = finite_or_null(row->*field);
    ranges.push_back(std::move(range));
  }
  return {{"frames", accuracy.frames},
          {"max_depth_m", finite_or_null(accuracy.max_depth)},
          {"ranges", std::move(ranges)}};
}

std::string to_json(const DepthAccuracy& accuracy) { return json_of(accuracy).dump(2) + "\n"; }

Result<DepthAccuracy> accuracy_from_json(std::string_view text, std::string_view file) {
  DepthAccuracy accuracy;
  const auto refuse = [file](const std::string& what) { return Error{fmt::format("{}: {}", file, what)}; };
  try {  // nlohmann reports by exceptions; they end here
    const Json json = Json::parse(text);
    accuracy.frames = json.at("frames").get<int>();
    accuracy.max_depth = json.at("max_depth_m").get<double>();
    const Json& ranges = json.at("ranges");
    if (!ranges.is_array() || ranges.size() != range_count + 1) {
      return refuse(fmt::format("ranges: found {} of them, expected {}", ranges.size(), range_count + 1));
    }
    std::size_t index = 0;
    for (RangeAccuracy* row : rows_of(accuracy)) {
      const Json& range = ranges[index++];
      const auto figure = [&range](const char* name, double otherwise) {
        return range.at(name).is_null() ? otherwise : range.at(name).get<double>();
      };
      row->from = range.at("from_m").get<double>();
      row->to = figure("to_m", std::numeric_limits<double>::infinity());
      for (const auto& [name, field] : kCounts) row->*field = range.at(name).get<std::uint64_t>();
      for (const auto& [name, field] : kFigures)
        row->*field = figure(name, std::numeric_limits<double>::quiet_NaN());
    }
  } catch (const Json::exception& error) {
    return refuse(fmt::format("found {}, expected the accuracy of a run", error.what()));
  }
  return accuracy;
}

}  // namespace pade::evaluation

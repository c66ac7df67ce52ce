#include "pade/paper/tables/experiment_finish.hpp"

#include <functional>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pade/core/version.hpp"
#include "pade/io/options_json.hpp"
#include "pade/paper/experiment/experiment_results.hpp"
#include "pade/paper/tables/beyond_tables.hpp"
#include "pade/paper/tables/experiment_plots.hpp"
#include "pade/paper/tables/experiment_report.hpp"
#include "pade/paper/tables/experiment_tables.hpp"
#include "pade/paper/tables/experiment_times.hpp"
#include "pade/paper/verdicts/flight_verdict.hpp"
#include "pade/report/report_pictures.hpp"

namespace pade::experiment {
namespace {

using Json = nlohmann::ordered_json;
using evaluation::ResultTable;
using evaluation::Verdict;

/// The flows of ours that stand for the paper's.
evaluation::VerdictOptions verdict_options() {
  evaluation::VerdictOptions options;
  options.clg = "clg-accurate";
  options.noise = noise_levels.back();
  return options;
}

ResultTable verdict_table(const Results& results, std::string name, std::string title,
                          const std::vector<Verdict>& verdicts) {
  ResultTable table;
  table.name = std::move(name);
  table.title = std::move(title);
  table.command = command_of(results.options, "all");
  table.note =
      "A claim reproduces where the 95 % bootstrap interval over sequences excludes zero in its favour, or "
      "lies within "
      "the stated margin, for all ranges, flows and sets of pixels that it speaks of; in part: for some of "
      "them.";
  table.columns = {"claim", "in the paper", "outcome", "what we measured", "figure", "95 % interval"};
  for (const Verdict& verdict : verdicts) {
    const evaluation::Interval& i = verdict.interval;
    table.rows.push_back(
        {verdict.claim, verdict.where, std::string(evaluation::outcome_name(verdict.outcome)), verdict.sense,
         i.count > 0 ? fmt::format("{}: {:.3g}", verdict.measure, i.estimate) : std::string("–"),
         i.low <= i.high ? fmt::format("{:.3g} to {:.3g}", i.low, i.high) : std::string("–")});
  }
  return table;
}

/// The claims whose outcome depends on the errata: both methods as printed, and both put right.
ResultTable changed_outcomes_table(const Results& results) {
  ResultTable table;
  table.name = "errata-outcomes";
  table.title = "Claims whose outcome changes when the errata are switched on";
  table.command = command_of(results.options, "table1");
  table.columns = {"claim", "literal PADE against TTC", "exact PADE against exact TTC"};
  const auto printed = evaluation::judge_accuracy(clean_rows(results, pade_literal), verdict_options());
  const auto right = evaluation::judge_accuracy(clean_rows(results, pade_exact), verdict_options());
  for (const evaluation::OutcomeChange& change : evaluation::changed_outcomes(printed, right)) {
    if (change.before == evaluation::Outcome::not_tested || change.after == evaluation::Outcome::not_tested)
      continue;
    table.rows.push_back({change.claim, std::string(evaluation::outcome_name(change.before)),
                          std::string(evaluation::outcome_name(change.after))});
  }
  table.note = table.rows.empty()
                   ? "None of the claims about clean motion changes its outcome."
                   : "Claims about clean motion. What the errata are worth in metres is in the table "
                     "\"What the errata are worth\" (pade experiment errata).";
  return table;
}

/// What of a section also becomes a file of its own: name, caption, and an <svg> element or a data: URI.
struct Figure {
  std::string name;
  std::string caption;
  std::string svg;
  std::string uri;
  std::string below = {};  // of the page alone: what belongs under the picture, as HTML
};

/// A table with what belongs to it.
struct Section {
  ResultTable table;
  std::vector<Figure> figures = {};
  std::vector<Verdict> verdicts = {};  // the table says the same
};

using MakePlots = std::function<Result<Plots>(const Results&)>;

/// Adds the plots of all makers to the table; where gnuplot cannot be had there is none, and the note says
/// so.
Section section(const Results& results, ResultTable table, const std::vector<MakePlots>& makers = {}) {
  Section made{std::move(table)};
  for (const MakePlots& make : makers) {
    auto plots = make(results);
    if (!plots) {
      made.table.note += " No plot: " + plots.error().message + ".";
      break;
    }
    for (std::string& svg : *plots) {
      made.figures.push_back(
          {fmt::format("{}-{}.svg", made.table.name, made.figures.size() + 1), "", std::move(svg), ""});
    }
  }
  return made;
}

/// Figure 4: a strip of pictures and the map at each moment.
Section flight_section(const Results& results) {
  const Json json = Json::parse(results.flight);
  Section made;
  ResultTable& table = made.table;
  table.name = "figure4";
  table.title = "Figure 4: a flight toward a building";
  table.command = command_of(results.options, table.name);
  table.note = fmt::format(
      "At each moment from left to right: camera image, optical flow to the frame before (direction as hue), "
      "depth (red "
      "near, blue {:g} m and farther, grey none); in report.html below it the occupancy map so far, from "
      "above and from "
      "the side.",
      json.at("depth_scale_m").get<double>());
  table.columns = {"moment", "time s", "flown m", "full colour of flow px"};
  for (const Json& moment : json.at("moments")) {
    const auto number = made.figures.size() + 1;
    const auto flown = moment.at("flown_m").get<double>();
    table.rows.push_back({std::to_string(number), moment.at("time").get<std::string>(),
                          fmt::format("{:.1f}", flown),
                          fmt::format("{:g}", moment.at("flow_scale_px").get<double>())});
    made.figures.push_back(
        {fmt::format("figure4-{}.jpg", number), fmt::format("After {:.1f} m", flown), "",
         moment.at("strip").get<std::string>(),
         fmt::format("<div style=\"display:grid;grid-template-columns:1fr 1fr;gap:6px\">{}{}</div>",
                     moment.at("map_top").get<std::string>(), moment.at("map_side").get<std::string>())});
  }
  return made;
}

std::vector<Section> sections_of(const Results& results, const std::vector<Verdict>& verdicts) {
  std::vector<Section> sections;
  if (!verdicts.empty()) {
    sections.push_back(
        {verdict_table(results, "verdicts", "What of the paper reproduces", verdicts), {}, verdicts});
  }
  if (results.has("table1")) {
    sections.push_back(section(results, table1(results), {table1_plots}));
    sections.push_back(section(results, answers_by_sequence(results)));
    sections.push_back(section(results, flow_errors_table(results)));
  }
  if (results.has("figure3"))
    sections.push_back(section(results, figure3_table(results), {figure3_by_range, figure3_by_level}));
  if (results.has("table1")) {
    sections.push_back(section(results, comparison_table(results, pade_literal, "table1")));
    sections.push_back(section(results, comparison_table(results, pade_exact, "table1")));
  }
  if (results.has("figure3"))
    sections.push_back(section(results, comparison_table(results, pade_literal, "figure3")));
  if (!results.flight.empty()) sections.push_back(flight_section(results));
  if (results.has("windows")) sections.push_back(section(results, windows_table(results), {windows_plots}));
  if (results.has("errata")) sections.push_back(section(results, errata_table(results)));
  if (results.has("beyond")) sections.push_back(section(results, beyond_table(results), {beyond_plots}));
  if (results.has("table1")) sections.push_back({changed_outcomes_table(results)});
  return sections;
}

std::vector<Section> time_sections_of(const Results& results, const std::vector<Verdict>& verdicts) {
  std::vector<Section> sections;
  if (results.has("table2")) {
    sections.push_back({table2(results)});
    sections.push_back(
        {verdict_table(results, "verdicts-speed", "What of the paper reproduces: speed", verdicts),
         {},
         verdicts});
  }
  if (results.has("windows")) sections.push_back({windows_times(results)});
  return sections;
}

evaluation::ReportSection for_page(const Section& one) {
  evaluation::ReportSection page;
  page.id = one.table.name;
  page.title = one.table.title;
  page.command = one.table.command;
  page.verdicts = one.verdicts;
  if (one.verdicts.empty()) {
    page.tables = {one.table};
    page.tables.front().title.clear();
    page.tables.front().command.clear();
  } else {
    page.text = one.table.note;
  }
  for (const Figure& figure : one.figures) {
    std::string shown = figure.svg;
    if (!figure.uri.empty()) shown = fmt::format("<img src=\"{}\" alt=\"{}\">", figure.uri, figure.caption);
    page.pictures.push_back({figure.caption, shown + figure.below});
  }
  return page;
}

std::string page_of(const Experiment& experiment, const std::vector<Section>& sections,
                    const std::vector<Section>& time_sections) {
  evaluation::ExperimentReport report;
  report.title = "Experiments";
  report.text =
      "Every table and figure of Nolan et al., Obstacle mapping module for quadrotors on outdoor Search and "
      "Rescue "
      "operations, measured anew, with a verdict on each claim. The command above each part makes it alone. "
      "Times "
      "stand at the end: they alone differ from run to run.";
  std::string names;
  for (const NamedSequence& sequence : experiment.sequences)
    names += (names.empty() ? "" : ", ") + sequence.name;
  report.facts = {{"program", fmt::format("pade {}", version)},
                  {"command", command_of(experiment.options, "all")},
                  {"sequences", names}};
  const Json options = io::json_of(experiment.options);
  for (const auto& [name, value] : options.items())
    report.options.emplace_back(name, value.is_string() ? value.get<std::string>() : value.dump());
  for (const NamedSequence& sequence : experiment.sequences)
    report.options.emplace_back("content of " + sequence.name, sequence.fingerprint);
  for (const Section& one : sections) report.sections.push_back(for_page(one));
  for (const Section& one : time_sections) report.sections.push_back(for_page(one));
  return to_html(report);
}

/// Markdown of the sections, with the figures as files beside it.
std::string markdown_of(const std::vector<Section>& sections) {
  std::string text;
  for (const Section& one : sections) {
    text += fmt::format("## {}\n\n    {}\n\n{}\n{}\n\n", one.table.title, one.table.command,
                        to_markdown(one.table), one.table.note);
    for (const Figure& figure : one.figures) {
      const std::string caption =
          figure.caption.empty() ? one.table.title : fmt::format("{}: {}", one.table.title, figure.caption);
      text += fmt::format("![{}](figures/{})\n", caption, figure.name);
    }
    if (!one.figures.empty()) text += "\n";
  }
  return text;
}

Json table_json(const ResultTable& table) {
  return {{"title", table.title},
          {"command", table.command},
          {"note", table.note},
          {"columns", table.columns},
          {"rows", table.rows}};
}

Json tables_json(const std::vector<Section>& sections) {
  Json tables;
  for (const Section& one : sections) tables[one.table.name] = table_json(one.table);
  return tables;
}

std::string experiment_json(const Experiment& experiment, const Results& results,
                            const std::vector<Section>& sections, const std::vector<Verdict>& verdicts) {
  Json json = json_of(experiment);
  json["verdicts"] = evaluation::json_of(verdicts);
  json["tables"] = tables_json(sections);
  json["cells"] = evaluation::json_of(all_cells(results));
  return json.dump(1) + "\n";
}

/// Everything with a clock in it; "jobs" is what a later call reads back.
Result<std::string> timing_json(const Experiment& experiment, const Store& store,
                                const std::vector<Section>& sections, const std::vector<Verdict>& verdicts) {
  Json jobs = Json::object();
  for (const Task& task : tasks_of(experiment)) {
    if (!task.timing) continue;
    const auto text = store.read(task.name, true);
    if (!text) return text.error();
    jobs[task.name] = Json::parse(*text);
  }
  const Json json = {{"machine", machine()},
                     {"verdicts", evaluation::json_of(verdicts)},
                     {"tables", tables_json(sections)},
                     {"jobs", std::move(jobs)}};
  return json.dump(1) + "\n";
}

std::string text_of(const std::vector<Section>& sections) {
  std::string text;
  for (const Section& one : sections) text += to_text(one.table) + "\n";
  return text;
}

}  // namespace

Result<std::string> finish(const Experiment& experiment, const Store& store) {
  const auto results = read_results(experiment, store);
  if (!results) return results.error();
  const auto flights = evaluation::flights_from_text(experiment.options.flights);
  if (!flights) return flights.error();
  std::vector<Verdict> accuracy;
  std::vector<Verdict> speed;
  if (results->has("table1") || results->has("figure3"))
    accuracy = evaluation::judge_accuracy(error_rows(*results, pade_literal), verdict_options());
  if (!accuracy.empty()) accuracy.push_back(evaluation::judge_flights(*flights));
  if (results->has("table2")) speed = evaluation::judge_speed(time_rows(*results), verdict_options());
  const auto sections = sections_of(*results, accuracy);
  const auto time_sections = time_sections_of(*results, speed);
  const auto timing = timing_json(experiment, store, time_sections, speed);
  if (!timing) return timing.error();

  std::vector<std::pair<std::string, std::string>> files = {
      {"cells.csv", to_csv(all_cells(*results))},
      {"report.html", page_of(experiment, sections, time_sections)},
      {"results.md", markdown_of(sections) + markdown_of(time_sections)}};
  for (const Section& one : sections) {
    for (const Figure& figure : one.figures) {
      files.emplace_back("figures/" + figure.name,
                         figure.uri.empty() ? figure.svg + "\n" : evaluation::bytes_of_uri(figure.uri));
    }
  }
  for (const auto& [name, content] : files) {
    if (Status written = store.write_file(name, content); !written) return written.error();
  }
  if (Status tidied = store.tidy_up(*timing); !tidied) return tidied.error();
  if (Status written =
          store.write_file(finished_file, experiment_json(experiment, *results, sections, accuracy));
      !written)
    return written.error();
  return text_of(sections) + text_of(time_sections);
}

}  // namespace pade::experiment

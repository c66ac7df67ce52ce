#include "pade/paper/tables/experiment_report.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <set>
#include <string_view>

#include <fmt/format.h>

#include "pade/report/plot/inline_svg.hpp"
#include "pade/report/report_pictures.hpp"
#include "pade/report/report_style.hpp"
#include "pade/report/report_text.hpp"

namespace pade::evaluation {
namespace {

constexpr int kPictureWidth = 960;  // pixels in the page's images

constexpr std::string_view experiment_style = R"css(
nav { background: var(--plate); border-radius: 6px; padding: 10px 16px; margin: 16px 0; }
nav ol { margin: 0; padding-left: 22px; columns: 2; }
nav a { color: var(--blue); }
h2 { scroll-margin-top: 10px; }
h3 { break-after: avoid; }
p { max-width: 100ch; }
.command { background: var(--plate); border-radius: 4px; padding: 5px 10px; margin: 6px 0; font: 12.5px/1.4 ui-monospace, Menlo,
  Consolas, monospace; white-space: pre-wrap; overflow-wrap: anywhere; }
.command::before { content: "$ "; color: var(--soft); }
.facts { display: grid; grid-template-columns: max-content 1fr; gap: 2px 16px; margin: 10px 0; }
.facts dt { color: var(--soft); }
.facts dd { margin: 0; overflow-wrap: anywhere; }
td.words, th.words { text-align: left; white-space: normal; min-width: 9em; }
td.words:nth-child(2) { min-width: 16em; }
.plots { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 460px), 1fr)); gap: 18px; margin: 12px 0; }
.plots figure { break-inside: avoid; }
.plots figure:has(> div) { grid-column: 1 / -1; }
svg.plot { width: 100%; max-width: 680px; height: auto; display: block; }
svg.plot text { font: inherit; fill: inherit; }
svg.plot g { font-family: system-ui, -apple-system, "Segoe UI", Roboto, Arial, sans-serif; }
.verdict { display: grid; grid-template-columns: 124px 1fr; gap: 2px 16px; padding: 8px 0; border-bottom: 1px solid var(--line);
  break-inside: avoid; }
.verdict b { display: block; }
.outcome { font-weight: 600; white-space: nowrap; }
.outcome.reproduces { color: #005a8c; } .outcome.in-part { color: #8a5a00; } .outcome.does-not { color: #a33c00; }
.outcome.not-tested { color: var(--soft); }
.range { font-variant-numeric: tabular-nums; }
@media (max-width: 760px) { nav ol { columns: 1; } .verdict { grid-template-columns: 1fr; } .facts { grid-template-columns: 1fr; }
  .facts dd { margin-bottom: 6px; } th, td { padding: 4px 8px; } }
@media print { nav { display: none; } td.words, th.words { min-width: 0; } table { font-size: 9px; } th { font-size: 9px; }
  th, td { padding: 2px 5px; } .scroll { overflow: visible; } .plots { grid-template-columns: 1fr 1fr; } }
)css";

std::string paragraphs(const std::string& text) {
  std::string html;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find("\n\n", at), text.size());
    const std::string paragraph = escape_html(std::string_view(text).substr(at, end - at));
    if (paragraph.find_first_not_of(" \n") != std::string::npos)
      html += fmt::format("<p>{}</p>\n", paragraph);
    at = end + 2;
  }
  return html;
}

std::string command_block(const std::string& command) {
  return command.empty() ? "" : fmt::format("<div class=\"command\">{}</div>\n", escape_html(command));
}

std::string table_html(const ReportTable& table) {
  std::string html;
  if (!table.title.empty()) html += fmt::format("<h3>{}</h3>\n", escape_html(table.title));
  html += command_block(table.command);
  html += "<div class=\"scroll\"><table>\n";
  const auto add_row = [&](const std::vector<std::string>& cells, std::string_view element) {
    html += "<tr>";
    for (std::size_t c = 0; c < cells.size(); ++c) {
      html += fmt::format("<{}{}>{}</{}>", element, is_words(table, c) ? " class=\"words\"" : "",
                          escape_html(cells[c]), element);
    }
    html += "</tr>\n";
  };
  html += "<thead>";
  add_row(table.columns, "th");
  html += "</thead><tbody>\n";
  for (const auto& row : table.rows) add_row(row, "td");
  html += "</tbody></table></div>\n";
  if (!table.note.empty()) html += fmt::format("<p class=\"soft\">{}</p>\n", escape_html(table.note));
  return html;
}

std::string pictures_html(const std::vector<ReportPicture>& pictures) {
  if (pictures.empty()) return {};
  std::string html = "<div class=\"plots\">\n";
  for (const ReportPicture& picture : pictures) {
    const std::string caption = escape_html(picture.caption);
    std::string shown = picture.svg;
    if (!picture.image.empty()) {
      const std::string uri = picture.photograph ? jpeg_uri(picture.image, kPictureWidth)
                                                 : png_uri(picture.image, kPictureWidth, false);
      shown = fmt::format("<img src=\"{}\" alt=\"{}\">", uri, caption);
    }
    html += fmt::format("<figure>{}<figcaption>{}</figcaption></figure>\n", shown, caption);
  }
  return html + "</div>\n";
}

// A mark beside the word, so that the outcome is not told by colour alone.
constexpr std::array<std::string_view, 4> kOutcomeMarks = {"✓", "◐", "✗", "–"};
constexpr std::array<std::string_view, 4> kOutcomeClasses = {"reproduces", "in-part", "does-not",
                                                             "not-tested"};

std::string verdict_html(const Verdict& verdict) {
  const auto outcome = static_cast<std::size_t>(verdict.outcome);
  std::string html =
      fmt::format("<div class=\"verdict\"><div><span class=\"outcome {}\">{} {}</span></div>\n<div><b>{}</b>",
                  kOutcomeClasses[outcome], kOutcomeMarks[outcome], outcome_name(verdict.outcome),
                  escape_html(verdict.claim));
  html += fmt::format("<span class=\"soft\">Paper: {}.", escape_html(verdict.where));
  const Interval& interval = verdict.interval;
  if (interval.count > 0 && std::isfinite(interval.low)) {
    html += fmt::format(
        " Main figure <span class=\"range\">{:+.3g}, 95 % interval {:+.3g} to {:+.3g}</span> over {} "
        "sequences.",
        interval.estimate, interval.low, interval.high, interval.count);
  }
  return html + fmt::format("</span><br>{}</div></div>\n", escape_html(verdict.sense));
}

std::string verdicts_html(const std::vector<Verdict>& verdicts) {
  if (verdicts.empty()) return {};
  std::array<int, 4> counts{};
  for (const Verdict& verdict : verdicts) ++counts[static_cast<std::size_t>(verdict.outcome)];
  std::string html = "<div class=\"tiles\">\n";
  for (const Outcome outcome :
       {Outcome::reproduces, Outcome::in_part, Outcome::does_not, Outcome::not_tested}) {
    const auto index = static_cast<std::size_t>(outcome);
    html += fmt::format("<div class=\"tile\"><b>{}</b><span>{} {}</span></div>\n", counts[index],
                        kOutcomeMarks[index], outcome_name(outcome));
  }
  html += "</div>\n";
  for (const Verdict& verdict : verdicts) html += verdict_html(verdict);
  return html;
}

std::string facts_html(const std::vector<std::pair<std::string, std::string>>& facts) {
  if (facts.empty()) return {};
  std::string html = "<dl class=\"facts\">\n";
  for (const auto& [name, value] : facts)
    html += fmt::format("<dt>{}</dt><dd>{}</dd>\n", escape_html(name), escape_html(value));
  return html + "</dl>\n";
}

// Ids of the sections, none twice.
std::vector<std::string> section_ids(const std::vector<ReportSection>& sections) {
  std::set<std::string> taken = {"options"};
  std::vector<std::string> ids;
  for (const ReportSection& section : sections) {
    const std::string wanted = id_of(section.id, section.title);
    std::string id = wanted;
    for (int again = 2; !taken.insert(id).second; ++again) id = fmt::format("{}-{}", wanted, again);
    ids.push_back(id);
  }
  return ids;
}

std::string contents_html(const ExperimentReport& report, const std::vector<std::string>& ids) {
  std::string html = "<nav aria-label=\"Contents\"><ol>\n";
  for (std::size_t i = 0; i < ids.size(); ++i)
    html += fmt::format("<li><a href=\"#{}\">{}</a></li>\n", ids[i], escape_html(report.sections[i].title));
  if (!report.options.empty()) html += "<li><a href=\"#options\">Options</a></li>\n";
  return html + "</ol></nav>\n";
}

std::string section_html(const ReportSection& section, const std::string& id) {
  std::string html = fmt::format("<section>\n<h2 id=\"{}\">{}</h2>\n", id, escape_html(section.title));
  html += command_block(section.command);
  html += paragraphs(section.text);
  for (const ReportTable& table : section.tables) html += table_html(table);
  html += pictures_html(section.pictures);
  html += verdicts_html(section.verdicts);
  return html + "</section>\n";
}

}  // namespace

std::string to_html(const ExperimentReport& report) {
  const std::vector<std::string> ids = section_ids(report.sections);
  std::string html = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" "
      "content=\"width=device-width, initial-scale=1\">\n<title>{0} – "
      "PADE</title>\n<style>{1}{2}</style>\n</head>\n<body>\n<h1>{0}</h1>\n",
      escape_html(report.title), report_style, experiment_style);
  html += paragraphs(report.text);
  html += facts_html(report.facts);
  html += contents_html(report, ids);
  for (std::size_t i = 0; i < ids.size(); ++i) html += section_html(report.sections[i], ids[i]);
  if (!report.options.empty()) {
    html += "<section>\n<h2 id=\"options\">Options</h2>\n";
    html += facts_html(report.options) + "</section>\n";
  }
  return html + "</body>\n</html>\n";
}

}  // namespace pade::evaluation

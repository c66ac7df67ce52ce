// The report of the experiments is one page that needs nothing else and says what it was given.
#include "pade/paper/tables/experiment_report.hpp"

#include <regex>
#include <set>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pade/paper/verdicts/paper_values.hpp"
#include "pade/report/plot/plot.hpp"

namespace pade::evaluation {
namespace {
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

ReportPicture some_plot() {
  LinePlot plot;
  plot.frame = {"ADE against noise", "noise [%]", "ADE [m]"};
  plot.series = {{"TTC", {0, 10, 20}, {1, 1.2, 1.6}, {0.9, 1.1, 1.4}, {1.1, 1.4, 1.9}, {}},
                 {"PADE", {0, 10, 20}, {0.9, 0.95, 1.05}, {}, {}, {}}};
  const auto svg = line_plot(plot);
  return {"Mean over sequences", svg.ok() ? *svg : "<svg class=\"plot\" viewBox=\"0 0 1 1\"></svg>"};
}

ExperimentReport some_report() {
  ExperimentReport report;
  report.title = "Experiments <on> the paper's claims";
  report.text = "First paragraph & more.\n\nSecond paragraph.";
  report.facts = {{"program", "pade 1.2.3"}, {"seed", "7"}};
  report.options = {{"depth.window", "4"}};
  ReportTable table;
  table.title = "Beside the paper";
  table.note = "The paper's Table 1.";
  table.columns = {"method", "0-4 m", "4-8 m", "8-12 m", "12-16 m"};
  for (const PaperErrors& row : paper_table1) {
    std::vector<std::string> cells = {std::string(row.method) + " " + std::string(name_of(row.flow))};
    for (const PaperError& error : row.ranges) cells.push_back(std::to_string(error.mean).substr(0, 4));
    table.rows.push_back(cells);
  }
  Verdict holds{"PADE is ahead <near>", "abstract", Outcome::reproduces, "Plainly.", "lead [m]",
                {0.2, 0.1, 0.3, 10}};
  Verdict open{"It flies", "5", Outcome::not_tested, "Not flown.", "", {}};
  report.sections = {
      {"table1", "Table 1: error", "pade experiment table1 --sequences \"a b\"", "", {table}, {}, {}},
      {"figure3", "Figure 3: noise", "pade experiment figure3", "", {}, {some_plot()}, {}},
      {"table1",
       "Verdicts",
       "",
       "",
       {},
       {{"an image", "", cv::Mat(4, 4, CV_8UC3, cv::Scalar(9, 99, 199)), true}},
       {holds, open}}};
  return report;
}

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t found = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
  return found;
}

TEST(ExperimentReport, LoadsNothingFromOutsideAndLinksOnlyIntoItself) {
  const std::string html = to_html(some_report());
  std::set<std::string> ids;
  const std::regex id(R"re(\sid=['"]([^'"]*))re"), link(R"re((src|href)=['"]([^'"]{0,60}))re");
  for (std::sregex_iterator it(html.begin(), html.end(), id), end; it != end; ++it)
    EXPECT_TRUE(ids.insert((*it)[1].str()).second) << (*it)[1] << " twice";
  int links = 0;
  for (std::sregex_iterator it(html.begin(), html.end(), link), end; it != end; ++it, ++links) {
    const std::string target = (*it)[2].str();
    if (target.starts_with("#"))
      EXPECT_EQ(ids.count(target.substr(1)), 1U) << target;
    else
      EXPECT_THAT(target, testing::StartsWith("data:image/"));
  }
  EXPECT_GE(links, 4 + 1);
  EXPECT_THAT(html, AllOf(Not(HasSubstr("<script")), Not(HasSubstr("@import")), Not(HasSubstr("url(http"))));
}

TEST(ExperimentReport, ClosesEveryElementItOpens) {
  const std::string html = to_html(some_report());
  for (const std::string element :
       {"html",       "body", "div",  "table", "thead",   "tbody", "tr", "td", "th", "svg", "g",  "figure",
        "figcaption", "p",    "span", "h2",    "section", "nav",   "ol", "li", "dl", "dt",  "dd", "b"}) {
    EXPECT_EQ(count(html, "<" + element + ">") + count(html, "<" + element + " "),
              count(html, "</" + element + ">"))
        << element;
  }
}

TEST(ExperimentReport, SaysWhatItWasGiven) {
  EXPECT_THAT(to_html(some_report()),
              AllOf(HasSubstr("pade experiment figure3"), HasSubstr("pade 1.2.3"), HasSubstr("depth.window"),
                    HasSubstr("PADE Lucas-Kanade"), HasSubstr("3.47"), HasSubstr("<p>Second paragraph.</p>"),
                    HasSubstr("✓ reproduces"), HasSubstr("– not tested"),
                    HasSubstr("+0.2, 95 % interval +0.1 to +0.3"), HasSubstr("over 10 sequences")));
}

TEST(ExperimentReport, ShowsNamesAsTextNotAsMarkup) {
  EXPECT_THAT(to_html(some_report()), AllOf(HasSubstr("&lt;near&gt;"), Not(HasSubstr("<near>")),
                                            HasSubstr("paragraph &amp; more"), HasSubstr("&quot;a b&quot;")));
}

TEST(ExperimentReport, SetsWordsLeftAndFiguresRight) {
  const std::string html = to_html(some_report());
  EXPECT_EQ(count(html, "<td class=\"words\">"), paper_table1.size());
  EXPECT_EQ(count(html, "<td>"), 4 * paper_table1.size());
}

TEST(ExperimentReport, IsTheSameTwice) { EXPECT_EQ(to_html(some_report()), to_html(some_report())); }

TEST(ExperimentReport, MayBeEmpty) {
  const std::string html = to_html(ExperimentReport());
  EXPECT_THAT(html, AllOf(HasSubstr("</html>"), Not(HasSubstr("nan"))));
}

}  // namespace
}  // namespace pade::evaluation

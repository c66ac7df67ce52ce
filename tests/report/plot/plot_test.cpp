// Plots show their data, stand beside each other in a page, and say what is wrong where they cannot be drawn.
#include "pade/report/plot/plot.hpp"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <regex>
#include <set>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pade/report/plot/gnuplot.hpp"
#include "pade/report/plot/inline_svg.hpp"

namespace pade::evaluation {
namespace {
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

LinePlot some_lines() {
  LinePlot plot;
  plot.frame = {"Error against noise", "noise [%]", "ADE [m]"};
  plot.series = {{"TTC", {0, 5, 10, 20}, {1, 1.5, 2, 3}, {0.9, 1.4, 1.8, 2.7}, {1.1, 1.6, 2.2, 3.3}, {}},
                 {"PADE", {0, 5, 10, 20}, {1, kNaN, 1.2, 1.4}, {}, {}, {}}};
  return plot;
}

BarPlot some_bars() {
  BarPlot plot;
  plot.frame = {"Error by range", "true depth [m]", "ADE [m]"};
  plot.groups = {"0-4 m", "4-8 m"};
  plot.series = {{"TTC", {0.4, 1.8}, {0.3, 1.5}, {0.5, 2.1}, {}}, {"PADE", {0.4, kNaN}, {}, {}, {}}};
  return plot;
}

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t found = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
  return found;
}

std::vector<std::string> all_matches(const std::string& text, const char* pattern) {
  const std::regex regex(pattern);
  std::vector<std::string> found;
  for (std::sregex_iterator it(text.begin(), text.end(), regex), end; it != end; ++it)
    found.push_back((*it)[1].str());
  return found;
}

// PATH as one folder for as long as this lives.
class OnlyPath {
 public:
  explicit OnlyPath(const std::string& folder) { setenv("PATH", folder.c_str(), 1); }
  ~OnlyPath() { setenv("PATH", before_.c_str(), 1); }
  OnlyPath(const OnlyPath&) = delete;
  OnlyPath& operator=(const OnlyPath&) = delete;

 private:
  std::string before_ = std::getenv("PATH");
};

class Plot : public testing::Test {
 protected:
  void SetUp() override {
    if (!has_gnuplot()) GTEST_SKIP() << "gnuplot is not installed (Debian package gnuplot-nox)";
  }
};

std::string drawn(const Result<std::string>& svg) {
  EXPECT_TRUE(svg.ok()) << (svg.ok() ? "" : svg.error().message);
  return svg.ok() ? *svg : "";
}

TEST_F(Plot, IsOneElementThatNamesItsAxesAndSeries) {
  for (const std::string& svg : {drawn(line_plot(some_lines())), drawn(bar_plot(some_bars()))}) {
    EXPECT_THAT(svg, testing::StartsWith("<svg class=\"plot\""));
    EXPECT_EQ(svg.find_last_not_of('\n'), svg.rfind("</svg>") + 5);
    EXPECT_THAT(svg, AllOf(HasSubstr("viewBox"), Not(HasSubstr("<?xml")), Not(HasSubstr("GNUPLOT"))));
    for (const char* text : {"ADE [m]", "TTC", "PADE"}) EXPECT_THAT(svg, HasSubstr(text));
    EXPECT_EQ(count(svg, "<title>"), 1U);
    for (const std::string element : {"svg", "g", "text", "defs"}) {
      EXPECT_EQ(count(svg, "<" + element + ">") + count(svg, "<" + element + " "),
                count(svg, "</" + element + ">"))
          << element;
    }
  }
}

TEST_F(Plot, MarksLieWhereTheDataSays) {
  LinePlot plot = some_lines();
  plot.series = {plot.series[0]};
  const std::string svg = drawn(line_plot(plot));
  const std::regex mark(R"re(<use xlink:href='[^']*gpPt\d+' transform='translate\(([\d.]+),([\d.]+)\))re");
  std::vector<std::pair<double, double>> marks;
  for (std::sregex_iterator it(svg.begin(), svg.end(), mark), end; it != end; ++it)
    marks.emplace_back(std::stod((*it)[1]), std::stod((*it)[2]));
  ASSERT_EQ(marks.size(), 4U + 1U) << "the data and the key";
  const auto& x = plot.series[0].x;
  const auto& y = plot.series[0].y;
  const double per_x = (marks[3].first - marks[0].first) / (x[3] - x[0]);
  const double per_y = (marks[3].second - marks[0].second) / (y[3] - y[0]);
  EXPECT_GT(per_x, 0);
  EXPECT_LT(per_y, 0);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(marks[i].first, marks[0].first + per_x * (x[i] - x[0]), 0.02);
    EXPECT_NEAR(marks[i].second, marks[0].second + per_y * (y[i] - y[0]), 0.02);
  }
}

TEST_F(Plot, NaNLeavesAGap) {
  LinePlot with = some_lines(), without = some_lines();
  without.series[1].y[1] = 1.1;
  const char* use = "<use xlink:href='";
  EXPECT_EQ(count(drawn(line_plot(with)), use) + 1, count(drawn(line_plot(without)), use));
}

TEST_F(Plot, SeriesDifferInColourDashAndMark) {
  const std::string svg = drawn(line_plot(some_lines()));
  EXPECT_THAT(svg, AllOf(HasSubstr("rgb(  0, 114, 178)"), HasSubstr("rgb(213,  94,   0)"),
                         HasSubstr("stroke-dasharray"), HasSubstr("fill-opacity"), HasSubstr("gpPt6'"),
                         HasSubstr("gpPt4'")));
}

TEST_F(Plot, IdsOfTwoPlotsInAPageAreUnique) {
  const std::string page = drawn(line_plot(some_lines())) + drawn(bar_plot(some_bars()));
  const std::vector<std::string> ids = all_matches(page, R"re(\sid=['"]([^'"]*))re");
  const std::set<std::string> unique(ids.begin(), ids.end());
  EXPECT_GT(ids.size(), 20U);
  EXPECT_EQ(unique.size(), ids.size());
  std::vector<std::string> references = all_matches(page, R"re(href=['"]([^'"]*))re");
  for (std::string& link : all_matches(page, R"re(url\(([^)]*))re")) references.push_back(std::move(link));
  EXPECT_GT(references.size(), 8U);
  for (const std::string& link : references) {
    ASSERT_FALSE(link.empty());
    EXPECT_EQ(link.front(), '#') << link << " is outside the page";
    EXPECT_EQ(unique.count(link.substr(1)), 1U) << link;
  }
}

TEST_F(Plot, IsTheSameTwiceInAnyLocaleAndWithAnyStartUpFile) {
  const std::string once = drawn(line_plot(some_lines()));
  setenv("LC_ALL", "de_DE.UTF-8", 1);
  setenv("GNUTERM", "png", 1);
  const std::string again = drawn(line_plot(some_lines()));
  unsetenv("LC_ALL");
  unsetenv("GNUTERM");
  EXPECT_EQ(once, again);
}

TEST_F(Plot, NamesAreTextAndNothingElse) {
  const std::filesystem::path bait = std::filesystem::path(testing::TempDir()) / "pade_plot_bait";
  std::filesystem::remove(bait);
  LinePlot plot = some_lines();
  plot.frame.y_label = "a \"id=b\" href=#c";
  plot.frame.title = "it's <b>bold</b> & 'quoted' \" {/Symbol a}_i id='x'";
  plot.frame.x_label = "`touch " + bait.string() + "`\n!touch " + bait.string();
  plot.series[0].name = "'; system('touch " + bait.string() + "') #";
  plot.series[1].name = "$(touch " + bait.string() + ")\nEND_OF_DATA\nexit";
  const std::string svg = drawn(line_plot(plot));
  EXPECT_FALSE(std::filesystem::exists(bait));
  EXPECT_THAT(svg, AllOf(HasSubstr("&lt;b&gt;bold"), HasSubstr("{/Symbol a}_i"), HasSubstr("href=#c<"),
                         HasSubstr(" id=’x’<"), HasSubstr("’; system("), Not(HasSubstr("<b>"))));
}

TEST_F(Plot, AxesMayBeLogarithmicAndTicksNamed) {
  LinePlot plot = some_lines();
  plot.frame.log_y = plot.log_x = true;
  plot.series[0].x[0] = plot.series[1].x[0] = 1;
  plot.x_ticks = {{1, "one"}, {20, "twenty"}};
  EXPECT_THAT(drawn(line_plot(plot)), AllOf(HasSubstr("one<"), HasSubstr("twenty<")));
  plot.series[0].low[0] = 0;
  const auto refused = line_plot(plot);
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, AllOf(HasSubstr("y = 0"), HasSubstr("positive")));
}

TEST_F(Plot, ValuesBelowZeroAreShown) {
  BarPlot plot = some_bars();
  plot.series[0] = {"TTC - PADE", {-0.2, 0.3}, {-0.3, 0.1}, {-0.1, 0.5}, {}};
  EXPECT_THAT(drawn(bar_plot(plot)), HasSubstr("-0.2<"));
}

TEST_F(Plot, ZerosAreShown) {
  BarPlot plot = some_bars();
  plot.series = {{"nothing", {0, 0}, {}, {}, {}}};
  EXPECT_THAT(drawn(bar_plot(plot)), HasSubstr("nothing"));
}

TEST(PlotInput, ThatDoesNotFitIsRefused) {
  LinePlot lines = some_lines();
  lines.series[0].y.pop_back();
  auto refused = line_plot(lines);
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message,
              AllOf(HasSubstr("TTC"), HasSubstr("found 3 values of y"), HasSubstr("expected 4")));
  lines = some_lines();
  lines.series[0].high.clear();
  EXPECT_THAT(line_plot(lines).error().message, HasSubstr("found 0 values of high"));
  lines.series = {{"empty", {1}, {kNaN}, {}, {}, {}}};
  EXPECT_THAT(line_plot(lines).error().message, HasSubstr("found no finite y"));
  BarPlot bars = some_bars();
  bars.groups.emplace_back("8-12 m");
  EXPECT_THAT(bar_plot(bars).error().message, AllOf(HasSubstr("found 2"), HasSubstr("expected 3")));
}

TEST(Gnuplot, ThatIsMissingIsNamedWithItsPackage) {
  const OnlyPath path(testing::TempDir() + "/no_such_folder");
  EXPECT_FALSE(has_gnuplot());
  const auto refused = line_plot(some_lines());
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, AllOf(HasSubstr("Error against noise"), HasSubstr("gnuplot-nox")));
}

TEST(Gnuplot, ThatFailsGivesItsReason) {
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "pade_failing_gnuplot";
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "gnuplot") << "#!/bin/sh\necho >&2\necho '  line 3: no such terminal' >&2\nexit 7\n";
  std::filesystem::permissions(folder / "gnuplot", std::filesystem::perms::owner_all);
  {
    const OnlyPath path(folder.string());
    const auto refused = line_plot(some_lines());
    ASSERT_FALSE(refused.ok());
    EXPECT_THAT(refused.error().message, HasSubstr("exit status 7: line 3: no such terminal"));
  }
  std::filesystem::remove_all(folder);
}

TEST(InlineSvg, IdsAreFitForAnAttribute) {
  EXPECT_EQ(id_of("figure3", "x"), "figure3");
  EXPECT_EQ(id_of("a b\"><", "x"), "a-b---");
  EXPECT_EQ(id_of("3", "x"), "plot-3");
  EXPECT_EQ(id_of("", "x"), id_of("", "x"));
  EXPECT_NE(id_of("", "x"), id_of("", "y"));
}

TEST(InlineSvg, SurvivesWhatIsNoSvg) {
  for (const char* text : {"", "<svg", "<svg id='a'", "nothing", "<svg><title>"}) {
    const std::string svg = inline_svg(text, "i", "t");
    EXPECT_LE(svg.size(), std::string(text).size() + 100) << text;
  }
}

}  // namespace
}  // namespace pade::evaluation

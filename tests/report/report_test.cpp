// The report is one page that needs nothing else, and says what the run says.
#include "pade/report/report.hpp"

#include <cmath>
#include <regex>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "pade/io/image/image_codec.hpp"
#include "pade/report/report_map.hpp"
#include "pade/report/report_pictures.hpp"
#include "pade/report/report_text.hpp"

#include "evaluation/map/known_map.hpp"
#include "evaluation/synthetic_depth.hpp"

namespace pade::evaluation {
namespace {
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

/// A free lane of 8 m along x, 3 m wide and high, with a wall at its end.
const mapping::OccupancyMap& some_map() {
  static const mapping::OccupancyMap map = test::free_lane(8);
  return map;
}

Report some_report() {
  const cv::Size size(64, 48);
  Report report;
  report.info.version = "1.2.3";
  report.info.sequence = "/flights/<b>garden & house</b>";
  report.info.options = R"({"depth":{"window":2},"flow":"dis"})";
  report.info.camera.width = size.width;
  report.info.camera.height = size.height;
  report.info.range_limit = 20;
  report.info.health = {3, 2, 1, 0, 0, {{"rgb/2.png", "found 0 bytes"}}, {}, {}};
  report.info.hints = {
      {"large-mask", HintSeverity::warning, "61 % of the <image> is masked", "check mask.png"}};
  report.info.map = io::MapSummary{0.1, 3, 10};
  report.timing = {{io::summarise("flow", {10, 12}), io::summarise("total", {20, 22})}, 40, 1000000};
  const cv::Mat truth = test::truth_ramp(size);
  Accumulator accumulator;
  ReportFrame frame{"0.1 s", cv::Mat(size, CV_8UC1, cv::Scalar(99)),
                    cv::Mat(size, CV_32FC2, cv::Scalar(3, -4)), test::noisy_estimate(truth, 0.1, 1, 2),
                    truth};
  accumulator.add(frame.depth, truth);
  report.accuracy = accumulator.result();
  report.frames = {frame, frame};
  report.frames[1].depth.bound = 0.8 * frame.depth.depth;
  report.map = &some_map();
  report.trajectory = {{0, 0, 0.05}, {1, 0, 0.05}, {2.06, 0, 0.05}};
  return report;
}

std::size_t occurrences(const std::string& text, const std::string& part) {
  std::size_t found = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
  return found;
}

TEST(Report, LoadsNothingFromOutside) {
  const std::string html = to_html(some_report());
  const std::regex link(R"re((?:src|href)="([^"]{0,20}))re");
  int links = 0;
  for (std::sregex_iterator it(html.begin(), html.end(), link), end; it != end; ++it, ++links) {
    EXPECT_THAT((*it)[1].str(), testing::StartsWith("data:image/")) << "outside the page";
  }
  EXPECT_EQ(links, 1 + 2 * 6 + 1 + 4 + 2)
      << "the wheel, six pictures per frame, one bound, four views of the map, two ahead";
  EXPECT_THAT(html, AllOf(Not(HasSubstr("url(")), Not(HasSubstr("<script src")), Not(HasSubstr("@import"))));
}

TEST(Report, ClosesEveryElementItOpens) {
  const std::string html = to_html(some_report());
  for (const std::string element :
       {"div", "table", "tr", "td", "th", "svg", "figure", "figcaption", "p", "span", "h2", "text"}) {
    EXPECT_EQ(occurrences(html, "<" + element + ">") + occurrences(html, "<" + element + " "),
              occurrences(html, "</" + element + ">"))
        << element;
  }
}

TEST(Report, ShowsNamesAsTextNotAsMarkup) {
  EXPECT_THAT(to_html(some_report()),
              AllOf(HasSubstr("&lt;b&gt;garden &amp; house"), Not(HasSubstr("<b>garden"))));
}

TEST(Report, SaysWhatTheRunSays) {
  EXPECT_THAT(to_html(some_report()),
              AllOf(HasSubstr("pade 1.2.3"), HasSubstr("rgb/2.png"), HasSubstr("found 0 bytes"),
                    HasSubstr("depth.window"), HasSubstr("beyond 16 m")));
}

TEST(Report, SaysTheHintsBeforeAnythingElse) {
  const std::string html = to_html(some_report());
  const std::size_t hint = html.find("61 % of the &lt;image&gt; is masked");
  ASSERT_NE(hint, std::string::npos);
  EXPECT_LT(hint, html.find("<h2>"));
  EXPECT_THAT(html, HasSubstr("check mask.png"));
}

TEST(Report, ShowsTheWayAheadWithItsReach) {
  const std::string html = to_html(some_report());
  EXPECT_THAT(html, AllOf(HasSubstr("The way ahead of the last pose"),
                          HasSubstr("<b>5.6 m</b>; then it touches an obstacle"),
                          HasSubstr(std::string(occupancy_colours[0])),
                          HasSubstr(std::string(occupancy_colours[1]))));
  Report hovering = some_report();
  hovering.trajectory = {{2.35, 0, 0}, {2.36, 0, 0}};
  hovering.look = {0, 0, 0};
  EXPECT_THAT(to_html(hovering), Not(HasSubstr("The way ahead")));
  hovering.look = {1, 0, 0};
  EXPECT_THAT(to_html(hovering), HasSubstr("<b>5.3 m</b>"));
}

TEST(Report, DrawsFreeSpaceWhereNothingIsOccupied) {
  auto tree = std::make_unique<octomap::OcTree>(0.1);
  test::fill(*tree, {0, -1, -1}, {4, 1, 1}, false);
  const auto map = std::move(mapping::OccupancyMap::create({}, std::move(tree))).value();
  Report report = some_report();
  report.map = &map;
  report.info.map->occupied_voxels = 0;
  EXPECT_THAT(to_html(report),
              AllOf(HasSubstr("Nothing is occupied"), HasSubstr("at the height of the flight"),
                    Not(HasSubstr("all obstacles from"))));
}

TEST(Report, IsTheSameTwice) { EXPECT_EQ(to_html(some_report()), to_html(some_report())); }

TEST(Report, NeedsNeitherTruthNorMapNorTimingNorFrames) {
  Report report;
  report.info.sequence = "empty";
  const std::string html = to_html(report);
  EXPECT_THAT(html,
              AllOf(HasSubstr("no true depth"), HasSubstr("Nothing is occupied"), HasSubstr("</html>")));
  EXPECT_THAT(html, Not(HasSubstr("nan")));
}

TEST(ReportPictures, SurviveAsPng) {
  const cv::Mat picture = colourise_states((cv::Mat_<std::uint8_t>(2, 3) << 0, 1, 2, 3, 4, 5));
  const std::string uri = png_uri(picture, 100, false);
  const std::string prefix = "data:image/png;base64,";
  ASSERT_EQ(uri.substr(0, prefix.size()), prefix);
  // Decoded by the plainest means: six bits per digit.
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::vector<unsigned char> bytes;
  unsigned bits = 0;
  int held = 0;
  for (const char c : uri.substr(prefix.size())) {
    if (c == '=') break;
    bits = bits << 6 | static_cast<unsigned>(digits.find(c));
    held += 6;
    if (held >= 8) bytes.push_back(static_cast<unsigned char>(bits >> (held -= 8) & 255U));
  }
  const cv::Mat decoded = *io::decode_image(bytes, io::Pixels::colour);
  ASSERT_EQ(decoded.size(), picture.size());
  EXPECT_EQ(cv::norm(decoded, picture, cv::NORM_INF), 0);
}

TEST(ReportPictures, NearIsWarmAndNothingIsGrey) {
  const cv::Mat depth = (cv::Mat_<float>(1, 3) << 0.5F, 19.0F, std::numeric_limits<float>::quiet_NaN());
  const cv::Mat picture = colourise(depth, 0, 20, Palette::turbo_near_warm);
  EXPECT_GT(picture.at<cv::Vec3b>(0)[2], picture.at<cv::Vec3b>(0)[0]) << "red over blue";
  EXPECT_LT(picture.at<cv::Vec3b>(1)[2], picture.at<cv::Vec3b>(1)[0]);
  EXPECT_EQ(picture.at<cv::Vec3b>(2), cv::Vec3b(0xa6, 0xa6, 0xa6));
}

TEST(ReportScales, AreRound) {
  EXPECT_DOUBLE_EQ(round_up_125(0.013), 0.02);
  EXPECT_DOUBLE_EQ(round_up_125(5), 5);
  EXPECT_DOUBLE_EQ(round_up_125(5.1), 10);
  EXPECT_DOUBLE_EQ(round_up_125(0), 1);
}

TEST(ReportFrames, AreSpreadEvenly) {
  EXPECT_THAT(evenly_spread(8, 4), ElementsAre(1, 3, 5, 7));
  EXPECT_THAT(evenly_spread(100, 1), ElementsAre(50));
  EXPECT_THAT(evenly_spread(2, 4), ElementsAre(0, 1));
  EXPECT_TRUE(evenly_spread(0, 4).empty());
}

/// The picture of a drawing.
cv::Mat picture_of(const std::string& svg) {
  const std::size_t at = svg.find("data:image/");
  const std::string uri = svg.substr(at, svg.find('"', at) - at);
  const std::string bytes = bytes_of_uri(uri);
  return *io::decode_image(io::image_bytes(bytes), io::Pixels::colour);
}

int pixels_of(const cv::Mat& picture, mapping::Occupancy state) {
  const cv::Vec3b colour =
      colourise_occupancy(cv::Mat(1, 1, CV_8UC1, cv::Scalar(static_cast<int>(state)))).at<cv::Vec3b>(0);
  cv::Mat same;
  cv::inRange(picture, colour, colour, same);
  return cv::countNonZero(same);
}

TEST(MapViews, ShowFreeOccupiedAndUnknownWhereTheyAre) {
  // The lane is 80 x 30 voxels free and the wall 2 x 30 voxels occupied, in every section along x.
  const std::vector<Eigen::Vector3d> path = {{0, 0, 0.05}, {8.2, 0, 0.05}};
  const MapScene scene{some_map(), path};
  const MapViews views = draw_map(scene);
  const cv::Mat level = picture_of(views.level);
  EXPECT_EQ(pixels_of(level, mapping::Occupancy::free), 80 * 30);
  EXPECT_EQ(pixels_of(level, mapping::Occupancy::occupied), 2 * 30);
  EXPECT_EQ(pixels_of(level, mapping::Occupancy::unknown), static_cast<int>(level.total()) - 82 * 30);
  const cv::Mat section = picture_of(views.section);
  EXPECT_EQ(section.cols, 82 + 150) << "the path and 15 m ahead";
  EXPECT_EQ(pixels_of(section, mapping::Occupancy::free), 80 * 30);
  EXPECT_EQ(pixels_of(section, mapping::Occupancy::occupied), 2 * 30);
}

TEST(MapViews, FollowTheHeightOfThePath) {
  // Above the lane nothing is known.
  const std::vector<Eigen::Vector3d> path = {{0, 0, 2.05}, {8.2, 0, 2.05}};
  const cv::Mat level = picture_of(draw_map({some_map(), path}).level);
  EXPECT_EQ(pixels_of(level, mapping::Occupancy::unknown), static_cast<int>(level.total()));
}

TEST(MapViews, ShowEveryVoxelOfAPrunedCube) {
  auto tree = std::make_unique<octomap::OcTree>(0.1);
  test::fill(*tree, {0.05, 0.05, 0.05}, {0.75, 0.75, 0.75}, true);
  tree->updateInnerOccupancy();
  tree->prune();
  const auto map = std::move(mapping::OccupancyMap::create({}, std::move(tree))).value();
  ASSERT_EQ(map.occupied().size(), 1U) << "one cube of 8 voxels to a side";
  const std::vector<Eigen::Vector3d> path = {{0, 0, 0}, {0.5, 0, 0}};
  const cv::Mat top = picture_of(draw_map({map, path}).top);
  const cv::Vec3b none(0xa6, 0xa6, 0xa6);
  cv::Mat empty;
  cv::inRange(top, none, none, empty);
  EXPECT_EQ(static_cast<int>(top.total()) - cv::countNonZero(empty), 64);
}

TEST(MapViews, TurnToTheWidthOfThePage) {
  auto tree = std::make_unique<octomap::OcTree>(0.1);
  test::fill(*tree, {0.05, 0.05, 0.05}, {0.95, 7.95, 0.95}, false);
  test::fill(*tree, {0.05, 8.05, 0.05}, {0.05, 8.05, 0.05}, true);
  test::fill(*tree, {0.95, 0.05, 0.05}, {0.95, 0.05, 0.95}, true);
  const auto map = std::move(mapping::OccupancyMap::create({}, std::move(tree))).value();
  const std::vector<Eigen::Vector3d> path = {{0.5, 0, 0.5}, {0.5, 8, 0.5}};
  const MapViews views = draw_map({map, path, Eigen::Vector3d::UnitZ(), {0, 0, 0}, {1000, 500, true}});
  EXPECT_TRUE(views.wide);
  const cv::Mat level = picture_of(views.level);
  EXPECT_GT(level.cols, 3 * level.rows);
  // x points upward on the page and y to the left: seen from above, not from below.
  EXPECT_EQ(pixels_of(level, mapping::Occupancy::free), 80 * 10 - 1);
  EXPECT_EQ(pixels_of(level, mapping::Occupancy::occupied), 1);
  const cv::Rect top_right(level.cols / 2, 0, level.cols - level.cols / 2, level.rows / 2);
  EXPECT_EQ(pixels_of(level(top_right), mapping::Occupancy::occupied), 1)
      << "the pole at the smallest y and the largest x";
}

TEST(MapViews, StaySmallHoweverLongTheFlight) {
  constexpr int kPoles = 121;
  auto tree = std::make_unique<octomap::OcTree>(0.1);
  for (int i = 0; i < kPoles; ++i)
    test::fill(*tree, {10.0 * i + 0.05, 2.05, 0.05}, {10.0 * i + 0.05, 2.05, 3}, true);
  tree->updateInnerOccupancy();
  const auto map = std::move(mapping::OccupancyMap::create({}, std::move(tree))).value();
  std::vector<Eigen::Vector3d> path;
  for (int i = 0; i <= 60000; ++i) path.emplace_back(0.02 * i, std::sin(1e-3 * i), 1.5);
  const MapViews views = draw_map({map, path});
  for (const std::string& svg : {views.top, views.level, views.side, views.section}) {
    EXPECT_LE(picture_of(svg).cols, 1400);
    EXPECT_LT(svg.size(), 250000U);
  }
  const cv::Mat top = picture_of(views.top);
  cv::Mat empty;
  cv::inRange(top, cv::Vec3b(0xa6, 0xa6, 0xa6), cv::Vec3b(0xa6, 0xa6, 0xa6), empty);
  EXPECT_EQ(static_cast<int>(top.total()) - cv::countNonZero(empty), kPoles);
}

TEST(Corridor, IsDrawnToScale) {
  const std::vector<Eigen::Vector3d> path = {{0, 0, 0}, {2, 0, 0}};
  const CorridorViews views = draw_corridor({some_map(), path});
  EXPECT_NEAR(views.reach, 5.65, 0.03);
  for (const std::string& view : {views.level, views.upright}) {
    const cv::Mat picture = picture_of(view);
    ASSERT_EQ(picture.size(), cv::Size(300, 120)) << "half voxels";
    EXPECT_EQ(pixels_of(picture, mapping::Occupancy::free), 2 * 60 * 2 * 30);
    EXPECT_EQ(pixels_of(picture, mapping::Occupancy::occupied), 2 * 2 * 2 * 30);
  }
}

struct Up {
  const char* name;
  Eigen::Vector3d direction;
  const char *right, *away;
};
class MapFromAbove : public testing::TestWithParam<Up> {};

TEST_P(MapFromAbove, NamesTheHorizontalAxes) {
  auto tree = std::make_unique<octomap::OcTree>(0.1);
  test::fill(*tree, {0, 0, 0}, {0, 0, 0}, true);
  test::fill(*tree, {1, 2, 3}, {1, 2, 3}, true);
  const auto map = std::move(mapping::OccupancyMap::create({}, std::move(tree))).value();
  const std::vector<Eigen::Vector3d> path = {{0, 0, 0}, {1, 1, 1}};
  const MapViews views = draw_map({map, path, GetParam().direction});
  EXPECT_THAT(views.top, AllOf(HasSubstr(std::string(">") + GetParam().right + " [m]"),
                               HasSubstr(std::string(">") + GetParam().away + " [m]")));
}

INSTANTIATE_TEST_SUITE_P(WithUp, MapFromAbove,
                         testing::Values(Up{"AlongZ", {0, 0, 1}, "x", "y"},
                                         Up{"AgainstY", {0, -1, 0}, "x", "z"},
                                         Up{"Tilted", {0, 0.28, 0.96}, "x", "y′"}),
                         [](const auto& instance) { return instance.param.name; });

/// What comes from names of files and lines of logs must not become part of the page.
TEST(ReportText, TitlesAndRemarksAreTextAndNothingElse) {
  const std::string remark = "line 3: <script>alert(1)</script> & more";
  const std::string page = begin_page("a<b> \"flight\"", plot_page_style, {&remark, 1});
  EXPECT_EQ(page.find("<b>"), std::string::npos);
  EXPECT_EQ(page.find("<script"), std::string::npos);
  EXPECT_NE(page.find("<title>a&lt;b&gt; &quot;flight&quot;</title>"), std::string::npos);
  EXPECT_NE(page.find("<p>line 3: &lt;script&gt;alert(1)&lt;/script&gt; &amp; more</p>"), std::string::npos);
}

}  // namespace
}  // namespace pade::evaluation

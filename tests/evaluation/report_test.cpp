// The report is one page that needs nothing else, and says what the run says.
#include "pade/evaluation/report.hpp"

#include <cmath>
#include <regex>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

#include "pade/evaluation/report_map.hpp"
#include "pade/evaluation/report_pictures.hpp"

#include "evaluation/synthetic_depth.hpp"

namespace pade::evaluation {
namespace {
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

Report some_report() {
  const cv::Size size(64, 48);
  Report report;
  report.info.version = "1.2.3";
  report.info.sequence = "/flights/<b>garden & house</b>";
  report.info.options = R"({"depth":{"window":2},"flow":"dis"})";
  report.info.camera.width = size.width;
  report.info.camera.height = size.height;
  report.info.range_limit = 20;
  report.info.health = {3, 2, 1, {{"rgb/2.png", "found 0 bytes"}}, {}};
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
  report.occupied = {{0, 0, 0}, {1, 2, 0.5F}, {3, 1, 2}};
  report.trajectory = {{0, 0, 1}, {1, 0, 1}};
  return report;
}

std::size_t count(const std::string& text, const std::string& part) {
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
  EXPECT_EQ(links, 1 + 2 * 6 + 3) << "the wheel, six pictures per frame, three views of the map";
  EXPECT_THAT(html, AllOf(Not(HasSubstr("url(")), Not(HasSubstr("<script")), Not(HasSubstr("@import"))));
}

TEST(Report, ClosesEveryElementItOpens) {
  const std::string html = to_html(some_report());
  for (const std::string element :
       {"div", "table", "tr", "td", "th", "svg", "figure", "figcaption", "p", "span", "h2", "text"}) {
    EXPECT_EQ(count(html, "<" + element + ">") + count(html, "<" + element + " "),
              count(html, "</" + element + ">"))
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
  const cv::Mat decoded = cv::imdecode(bytes, cv::IMREAD_COLOR);
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

struct Up {
  const char* name;
  Eigen::Vector3d direction;
  const char *right, *away;
};
class MapFromAbove : public testing::TestWithParam<Up> {};

TEST_P(MapFromAbove, NamesTheHorizontalAxes) {
  const std::vector<Eigen::Vector3f> occupied = {{0, 0, 0}, {1, 2, 3}};
  const std::vector<Eigen::Vector3d> path = {{0, 0, 0}, {1, 1, 1}};
  const MapViews views = draw_map({occupied, path, 0.1, GetParam().direction});
  EXPECT_THAT(views.top, AllOf(HasSubstr(std::string(">") + GetParam().right + " [m]"),
                               HasSubstr(std::string(">") + GetParam().away + " [m]")));
}

INSTANTIATE_TEST_SUITE_P(WithUp, MapFromAbove,
                         testing::Values(Up{"AlongZ", {0, 0, 1}, "x", "y"},
                                         Up{"AgainstY", {0, -1, 0}, "x", "z"},
                                         Up{"Tilted", {0, 0.28, 0.96}, "x", "y′"}),
                         [](const auto& instance) { return instance.param.name; });

}  // namespace
}  // namespace pade::evaluation

// Logs as other tools write them: units, topics, quotes, decimal commas, and what is said of those that
// cannot be read.
#include <cmath>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pade/io/navigation/navigation_log.hpp"

#include "io/sequence/flight_folders.hpp"
#include "support/temporary_folder.hpp"

namespace pade::io {
namespace {

using Eigen::Vector3d;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;

struct Log {
  const char* name;
  std::string text;
};

/// Three rows of the same measurement, 10 ms apart from 0 on, in words of each kind.
const Log kImus[] = {
    {"PlotJuggler",
     "__time,/imu/data/angular_velocity/x,/imu/data/angular_velocity/y,/imu/data/angular_velocity/z,"
     "/imu/data/linear_acceleration/x,/imu/data/linear_acceleration/y,/imu/data/linear_acceleration/z\n"
     "0.00,0.1,0.2,0.3,1,2,9.7\n0.01,0.1,0.2,0.3,1,2,9.7\n0.02,0.1,0.2,0.3,1,2,9.7\n"},
    {"CommentOfWords",
     "# frame=FLU\n# id timestamp ax ay az gx gy gz\n1 0.00 1 2 9.7 0.1 0.2 0.3\n2 0.01 1 2 9.7 0.1 0.2 0.3\n"
     "3 0.02 1 2 9.7 0.1 0.2 0.3\n"},
    {"Quoted",
     "# "
     "frame=FLU\n\"t_s\",\"gx\",\"gy\",\"gz\",\"ax\",\"ay\",\"az\"\n\"0.00\",\"0.1\",\"0.2\",\"0.3\",\"1\","
     "\"2\",\"9.7\"\n"
     "\"0.01\",\"0.1\",\"0.2\",\"0.3\",\"1\",\"2\",\"9.7\"\n\"0.02\",\"0.1\",\"0.2\",\"0.3\",\"1\",\"2\",\"9."
     "7\"\n"},
    {"UnitsBelowTheHeading",
     fmt::format("# frame=FLU\nt,gx,gy,gz,ax,ay,az\ns,deg/s,deg/s,deg/s,g,g,g\n0,{0}\n0.01,{0}\n0.02,{0}\n",
                 fmt::format("{:.12g},{:.12g},{:.12g},{:.12g},{:.12g},{:.12g}", 0.1 * 180 / M_PI,
                             0.2 * 180 / M_PI, 0.3 * 180 / M_PI, 1 / 9.80665, 2 / 9.80665, 9.7 / 9.80665))},
    {"DecimalCommasInTheTime",
     "# frame=FLU\nt_s;gx;gy;gz;ax;ay;az\n0,00;0,1;0,2;0,3;1;2;9,7\n0,01;0,1;0,2;0,3;1;2;9,7\n"
     "0,02;0,1;0,2;0,3;1;2;9,7\n"},
};

class ImuLogs : public testing::TestWithParam<Log> {};

TEST_P(ImuLogs, GiveTheSameSamples) {
  std::vector<std::string> remarks;
  const auto read = parse_imu(GetParam().text, "imu.csv", remarks);
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->size(), 3U);
  EXPECT_EQ(read->back().time, Time::from_seconds(0.02));
  EXPECT_LT((read->back().angular_rate - Vector3d(0.1, 0.2, 0.3)).norm(), 1e-9);
  EXPECT_LT((read->back().specific_force - Vector3d(1, 2, 9.7)).norm(), 1e-9);
}

INSTANTIATE_TEST_SUITE_P(Of, ImuLogs, testing::ValuesIn(kImus),
                         [](const auto& instance) { return std::string(instance.param.name); });

TEST(GnssUnits, AreThoseOfTheHeadingOrRefused) {
  std::vector<std::string> remarks;
  const auto read = parse_gnss(
      "# frame=ENU\nt_s,px [ft],py [ft],pz [ft],vE [km/h],vN [km/h],vU [km/h],sigma_px "
      "[cm],sigma_py,sigma_pz\n"
      "0,100,200,300,36,72,18,50,60,70\n",
      "gnss.csv", {}, remarks);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_LT((read->fixes[0].position - 0.3048 * Vector3d(100, 200, 300)).norm(), 1e-9);
  EXPECT_LT((read->velocities[0].velocity - Vector3d(10, 20, 5)).norm(), 1e-9);
  EXPECT_NEAR(read->fixes[0].covariance(1, 1), 0.36, 1e-12);
  const auto height = parse_gnss("t_s,lat,lon,alt [ft],vE [kn],vN,vU\n0,45,9,0,1,0,0\n1,45,9,100,1,0,0\n",
                                 "gnss.csv", {}, remarks);
  ASSERT_TRUE(height) << height.error().message;
  EXPECT_NEAR(height->fixes[1].position.z(), 30.48, 1e-6);
  EXPECT_NEAR(height->velocities[1].velocity.x(), 0.514444, 1e-6);
  for (const char* heading : {"t_s,lat,lon,alt [furlong],vE,vN,vU", "t_s,lat,lon,alt,vE [furlong],vN,vU",
                              "t_s,lat [furlong],lon,alt,vE,vN,vU"}) {
    const auto refused = parse_gnss(std::string(heading) + "\n0,45,9,0,1,0,0\n", "gnss.csv", {}, remarks);
    ASSERT_FALSE(refused) << heading;
    EXPECT_THAT(refused.error().message, HasSubstr("found unit 'furlong'"));
  }
  const auto baro = parse_barometer("t_s,alt [cm]\n0,1200\n", "baro.csv", remarks);
  ASSERT_TRUE(baro) << baro.error().message;
  EXPECT_NEAR(baro->front().height, 12, 1e-12);
}

TEST(GnssLog, ReadsNavSatFixOfRos) {
  std::vector<std::string> remarks;
  const std::string heading =
      "%time,field.header.seq,field.status.status,field.latitude,field.longitude,field.altitude,"
      "field.position_covariance0,field.position_covariance1,field.position_covariance4,"
      "field.position_covariance8,field.position_covariance_type\n";
  const auto read = parse_gnss(heading +
                                   "1600000000000000000,0,0,45,9,100,4,0,9,16,2\n"
                                   "1600000000200000000,1,-1,0,0,0,4,0,9,16,0\n"
                                   "1600000000400000000,2,0,45,9,101,0,0,0,0,0\n",
                               "gnss.csv", {}, remarks);
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->fixes.size(), 2U) << "a status of -1 is no fix";
  EXPECT_EQ(read->fixes[1].time, Time{1'600'000'000'400'000'000});
  EXPECT_EQ(read->fixes[0].covariance.diagonal(), Vector3d(4, 9, 16)) << "variances of east, north, up";
  EXPECT_EQ(read->fixes[1].covariance.diagonal(), Vector3d(2.25, 2.25, 6.25)) << "0 is unknown";
  EXPECT_THAT(remarks, Contains(HasSubstr("1 rows without a fix were left out")));
}

TEST(GnssLog, NamesWhatIsWrong) {
  std::vector<std::string> remarks;
  const auto message = [&](const std::string& text) {
    const auto read = parse_gnss(text, "gnss.csv", {}, remarks);
    return read ? std::string() : read.error().message;
  };
  EXPECT_THAT(message("t_s,lat,lon,alt\n0,4722.61,832.5,100\n"),
              AllOf(HasSubstr("line 2"), HasSubstr("ddmm.mmmm")));
  EXPECT_THAT(message("time,lat,lon,alt\n2020-09-13T12:26:00Z,47,8,100\n"),
              AllOf(HasSubstr("line 2: found time \"2020-09-13T12:26:00Z\""), HasSubstr("seconds")));
  EXPECT_EQ(message("t_s,lat,lon,alt,vE,vN\n0,47,8,100,1,2\n"), "");
  EXPECT_THAT(remarks, Contains(HasSubstr("there is no v")));
}

TEST(ImuLog, NamesTheFirstRowThatIsNoNumber) {
  std::vector<std::string> remarks;
  const auto read =
      parse_imu("# frame=FLU\nt_s;gx;gy;gz;ax;ay;az\n0;1.234,5;0;0;0;0;9\n", "imu.csv", remarks);
  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().message, HasSubstr("line 3: \"0;1.234,5;0;0;0;0;9\""));
}

TEST(LogFolder, NamesTheFilesThatWaitForTheirNames) {
  const test::TemporaryFolder folder;
  test::write_text(folder / "log_sensor_combined_0.csv", "timestamp\n");
  const auto read = read_navigation_log(folder.path(), {});
  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().message,
              AllOf(HasSubstr("expected imu.csv"), HasSubstr("found log_sensor_combined_0.csv")));
  test::write_text(folder / "flight.ulg", "ULog");
  const auto file = read_navigation_log(folder / "flight.ulg", {});
  ASSERT_FALSE(file);
  EXPECT_THAT(file.error().message, AllOf(HasSubstr("is a file"), HasSubstr("ulog2csv")));
}

TEST(EchoedLogs, HaveTheTimesOfTheirHeaders) {
  const std::string imu_columns =
      ",angular_velocity.x,angular_velocity.y,angular_velocity.z,linear_acceleration.x,linear_acceleration.y,"
      "linear_acceleration.z\n";
  const std::string values = ",0.1,0.2,0.3,1,2,9.7\n";
  std::string whole = "%time,field.header.seq,field.header.stamp" + imu_columns;
  std::string parted = "__time,/imu/header/stamp/sec,/imu/header/stamp/nanosec" + imu_columns;
  std::string zeros = whole;
  for (std::int64_t i = 0; i < 5; ++i) {
    const std::int64_t measured = 1'500'000'000'023'456'789 + 10'000'000 * i;
    const std::int64_t recorded = measured + 50'000'000;
    whole += fmt::format("{},{},{}", recorded, i, measured) + values;
    zeros += fmt::format("{},{},0", recorded, i) + values;
    parted += fmt::format("{},{},{}", to_string(Time{recorded}), measured / 1'000'000'000,
                          measured % 1'000'000'000) +
              values;
  }
  for (const std::string& text : {whole, parted}) {
    std::vector<std::string> remarks;
    const auto read = parse_imu(text, "imu.csv", remarks);
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(read->at(1).time.nanoseconds, 1'500'000'000'033'456'789);
    EXPECT_THAT(remarks, Contains(HasSubstr("the times are those of the headers")));
  }
  std::vector<std::string> remarks;
  EXPECT_EQ(parse_imu(zeros, "imu.csv", remarks)->at(1).time.nanoseconds, 1'500'000'000'083'456'789);
}

TEST(GnssLogs, TheStepsOverruleTheUnitThatSuchLogsHave) {
  std::string text = "timestamp,fix_type,lat,lon,alt\n";
  for (int i = 0; i < 20; ++i) text += fmt::format("{:.3f},3,470000000,80000000,500000\n", 1.6e9 + 0.2 * i);
  std::vector<std::string> remarks;
  const auto read = parse_gnss(text, "gnss.csv", {}, remarks);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->fixes[5].time, (Time{1'600'000'001'000'000'000}));
  EXPECT_THAT(remarks, Contains(HasSubstr("timestamp is taken as seconds, from its steps, and not as the "
                                          "microseconds that such logs have")));
}

TEST(GnssLogs, AVerticalVelocityThatIsAlwaysZeroIsLeftOpen) {
  std::string text = "# frame=ENU origin=47,8,400\nt_s,pE,pN,pU,vE,vN,vU\n";
  for (int i = 0; i < 20; ++i) text += fmt::format("{:.1f},0,0,{},1,0,0\n", 0.2 * i, 0.4 * i);
  std::vector<std::string> remarks;
  const auto read = parse_gnss(text, "gnss.csv", {}, remarks);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(measured_axes(read->velocities[3]), Vector3d(1, 1, 0));
  EXPECT_THAT(remarks, Contains(HasSubstr("has no vertical velocity")));
}

}  // namespace
}  // namespace pade::io

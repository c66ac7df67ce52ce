#include "pade/io/navigation/navigation_log.hpp"

#include <algorithm>
#include <numbers>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "navigation/flight.hpp"

namespace pade::io {
namespace {

using testing::HasSubstr;

constexpr const char* kRow = "0.005,0.1,0.2,0.3,1,2,9.7\n";

std::string imu_text(const std::string& head) {
  std::string text = head;
  for (int i = 0; i < 10; ++i) text += "0.00" + std::to_string(i) + ",0.1,0.2,0.3,1,2,9.7\n";
  return text;
}

std::string refusal(const std::string& text) {
  std::vector<std::string> remarks;
  const auto result = parse_imu(text, "imu.csv", remarks);
  return result ? "accepted" : result.error().message;
}

TEST(ImuLog, ReadsBackWhatWasWritten) {
  const auto log = navigation::record({}, 2, simulation::ImuModel::industrial(), {}, 1);
  std::vector<std::string> remarks;
  const auto read = parse_imu(format_imu(log.imu), "imu.csv", remarks);
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->size(), log.imu.size());
  for (std::size_t i = 0; i < log.imu.size(); ++i) {
    EXPECT_EQ((*read)[i].time, log.imu[i].time);
    EXPECT_EQ((*read)[i].angular_rate, log.imu[i].angular_rate);
    EXPECT_EQ((*read)[i].specific_force, log.imu[i].specific_force);
  }
  EXPECT_TRUE(remarks.empty());
}

TEST(GnssLog, ReadsBackWhatWasWritten) {
  auto log =
      navigation::record({}, 3, simulation::ImuModel::industrial(), {.lever_arm = {0.1, 0, 0.2}}, 1).gnss;
  log.origin = GeodeticOrigin{48.5, 9.25, 400};
  log.velocities.erase(log.velocities.begin() + 3);
  std::vector<std::string> remarks;
  const auto read = parse_gnss(format_gnss(log), "gnss.csv", {}, remarks);
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->fixes.size(), log.fixes.size());
  ASSERT_EQ(read->velocities.size(), log.velocities.size());
  EXPECT_EQ(read->lever_arm, log.lever_arm);
  EXPECT_EQ(read->origin->latitude, 48.5);
  for (std::size_t i = 0; i < log.fixes.size(); ++i) {
    EXPECT_EQ(read->fixes[i].position, log.fixes[i].position);
    EXPECT_LT((read->fixes[i].covariance - log.fixes[i].covariance).norm(), 1e-12);
  }
}

TEST(ImuLog, TurnsForwardRightDownIntoForwardLeftUp) {
  std::vector<std::string> remarks;
  const auto frd = parse_imu(imu_text("# frame=FRD\nt_s,gx,gy,gz,ax,ay,az\n"), "imu.csv", remarks);
  ASSERT_TRUE(frd);
  EXPECT_EQ(frd->front().specific_force, Eigen::Vector3d(1, -2, -9.7));
  EXPECT_EQ(frd->front().angular_rate, Eigen::Vector3d(0.1, -0.2, -0.3));
}

TEST(ImuLog, RefusesWhatItWouldMisread) {
  const std::string heading = "t_s,gx,gy,gz,ax,ay,az\n";
  EXPECT_THAT(refusal(imu_text(heading)), HasSubstr("no frame given, expected a line '# frame=FLU'"));
  EXPECT_THAT(refusal(imu_text("# frame=FLU\n")), HasSubstr("expected a heading"));
  EXPECT_THAT(refusal(""), HasSubstr("empty"));
  EXPECT_THAT(refusal("# frame=FLU\n" + heading), HasSubstr("no rows"));
  EXPECT_THAT(refusal("# frame=FLU\nt_s,gx,gy,gz\n0,1,2,3\n"),
              HasSubstr("found the columns t_s, gx, gy, gz; expected"));
  EXPECT_THAT(refusal("# frame=FLU\n" + heading + "0,1,2\n0.1,1,2\n"),
              HasSubstr("imu.csv:3: 2 of 2 lines do not have 7"));
}

TEST(ImuLog, NamesWrongUnits) {
  const std::string head = "# frame=FLU\nt_s,gx,gy,gz,ax,ay,az\n";
  std::string g = head;
  std::string degrees = head;
  std::string milliseconds = head;
  for (int i = 0; i < 20; ++i) {
    const std::string t = std::to_string(0.01 * i);
    g += t + ",0.1,0.1,0.1,0.02,0.01,0.99\n";
    degrees += t + ",40,10,1,0,0,9.8\n";
    milliseconds += std::to_string(10 * i) + ",0.1,0,0,0,0,9.8\n";
  }
  EXPECT_THAT(refusal(g), HasSubstr("this is in g"));
  EXPECT_THAT(refusal(degrees), HasSubstr("this is in deg/s"));
  EXPECT_THAT(refusal(milliseconds), HasSubstr("stamps are not in seconds"));
}

TEST(ImuLog, LeavesOutBadRowsAndSaysSo) {
  std::vector<std::string> remarks;
  const auto read = parse_imu(imu_text("# frame=FLU\nt_s,gx,gy,gz,ax,ay,az\n") +
                                  "nan,1,1,1,1,1,1\n0.2,nan,1,1,1,1,9\n0.3,1,2\n" + kRow,
                              "imu.csv", remarks);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->size(), 11U);
  ASSERT_EQ(remarks.size(), 1U);
  EXPECT_THAT(remarks[0], HasSubstr("3 of 14 rows left out"));
}

TEST(ImuLog, ReadsEurocWithStampsThatADoubleCannotHold) {
  std::vector<std::string> remarks;
  std::string text =
      "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],a_RS_S_x [m "
      "s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\r\n";
  text +=
      "1403636579758555392,-0.1,0.14,0.077,9.0874956,0.13,-3.69\r\n1403636579763555584,-0.1,0.14,0.077,9."
      "0874956,0.13,-3.69\r\n";
  const auto read = parse_imu(text, "data.csv", remarks);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ((*read)[0].time.nanoseconds, 1403636579758555392);
  EXPECT_EQ((*read)[1].specific_force.z(), -3.69);
}

TEST(GnssLog, TurnsNorthEastDownIntoEastNorthUp) {
  std::vector<std::string> remarks;
  const auto read = parse_gnss(
      "# t_s,pN_m,pE,pD,vN_mps,vE,vD,sN,sE,sD,svN,svE,svD (antenna; lever FRD 0.05,0.02,-0.08 "
      "m)\n1.5,1,2,3,4,5,6,0.1,0.2,0.3,0.4,0.5,0.6\n",
      "gnss.csv", {}, remarks);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->fixes[0].position, Eigen::Vector3d(2, 1, -3));
  EXPECT_EQ(read->velocities[0].velocity, Eigen::Vector3d(5, 4, -6));
  EXPECT_LT((read->fixes[0].covariance.diagonal() - Eigen::Vector3d(0.04, 0.01, 0.09)).norm(), 1e-15);
  EXPECT_EQ(*read->lever_arm, Eigen::Vector3d(0.05, -0.02, 0.08));
}

TEST(GnssLog, PlacesGeodeticPositionsOnTheGround) {
  std::vector<std::string> remarks;
  const auto read =
      parse_gnss("# t_s,lat_deg,lon_deg,h_m,vN_mps,vE,vD\n0,45,9,100,0,0,0\n1,45.001,9.001,101,0,0,0\n",
                 "gnss.csv", {}, remarks);
  ASSERT_TRUE(read) << read.error().message;
  // Radii of curvature of WGS84 at 45°: meridian 6367.38 km, prime vertical 6388.84 km.
  const double degree = std::numbers::pi / 180;
  EXPECT_NEAR(read->fixes[1].position.x(), 6388838 * std::cos(45 * degree) * 0.001 * degree, 0.02);
  EXPECT_NEAR(read->fixes[1].position.y(), 6367382 * 0.001 * degree, 0.02);
  EXPECT_NEAR(read->fixes[1].position.z(), 1, 0.01);
  EXPECT_THAT(remarks[0], HasSubstr("no sigmas"));
}

TEST(GnssLog, LeavesOutWhatHasNoFiniteSigma) {
  std::vector<std::string> remarks;
  const auto read = parse_gnss(
      "# frame=ENU\nt_s,pE,pN,pU,vE,vN,vU,sE,sN,sU,svE,svN,svU\n"
      "0,1,2,3,4,5,6,1,1,nan,0.1,0.1,0.1\n1,1,2,3,4,5,6,1,1,1,0.1,1e200,0.1\n2,1,2,3,4,5,6,nan,1,1,1,nan,1\n",
      "gnss.csv", {}, remarks);
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->fixes.size(), 1U);
  EXPECT_EQ(read->fixes[0].time, Time::from_seconds(1));
  ASSERT_EQ(read->velocities.size(), 1U);
  EXPECT_EQ(read->velocities[0].time, Time::from_seconds(0));
  ASSERT_EQ(remarks.size(), 1U);
  EXPECT_THAT(remarks[0], HasSubstr("1 of 3 rows left out"));
}

TEST(GnssLog, RefusesAFileWithoutFrame) {
  std::vector<std::string> remarks;
  const auto read = parse_gnss("t_s,px,py,pz,vx,vy,vz\n0,1,2,3,4,5,6\n", "gnss.csv", {}, remarks);
  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().message, HasSubstr("# frame=ENU origin=lat,lon,h"));
}

TEST(GnssLog, RefusesColumnsOfOtherNamesWithTheListOfThoseThatAreUnderstood) {
  std::vector<std::string> remarks;
  const auto read = parse_gnss("# frame=ENU\nt_s,a,b,c,d,e,f,g,h,i,j,k,l\n0,1,2,3,4,5,6,7,8,9,10,11,12\n",
                               "gnss.csv", {}, remarks);
  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().message, testing::AllOf(HasSubstr("found the columns t_s, a, b"),
                                                   HasSubstr("px py pz"), HasSubstr("lat lon alt")));
}

TEST(GnssLog, RefusesNamesThatContradictTheStatedFrame) {
  std::vector<std::string> remarks;
  const auto read = parse_gnss("# frame=ENU\nt_s,pN,pE,pD\n0,1,2,3\n", "gnss.csv", {}, remarks);
  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().message,
              HasSubstr("frame=ENU but the columns of the position are named pn pe pd"));
}

TEST(GnssLog, TakesASigmaOfZeroAsUnknown) {
  std::vector<std::string> remarks;
  const auto read =
      parse_gnss("# frame=ENU\nt_s,pE,pN,pU,vE,vN,vU,sE,sN,sU,svE,svN,svU\n0,1,2,3,4,5,6,0,0,0,0,0,0\n",
                 "gnss.csv", {}, remarks);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->fixes[0].covariance(0, 0), 1.5 * 1.5);
  EXPECT_EQ(read->velocities[0].covariance(2, 2), 0.25 * 0.25);
  EXPECT_THAT(remarks, testing::Contains(HasSubstr("taken as unknown")));
}

TEST(GnssLog, NeedsNoVelocitiesAndSaysWhatThatMeans) {
  std::vector<std::string> remarks;
  const auto read = parse_gnss("t_s,lat,lon,alt\n0,45,9,100\n1,45,9,100\n", "gnss.csv", {}, remarks);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->fixes.size(), 2U);
  EXPECT_TRUE(read->velocities.empty());
  EXPECT_THAT(remarks, testing::Contains(HasSubstr("no columns of velocity")));
}

TEST(GnssLog, ReadsWhatAutopilotsWrite) {
  std::vector<std::string> remarks;
  // ArduPilot: course over ground in degrees, speed downwards; the second receiver and a row without fix are
  // left out.
  const auto ardupilot = parse_gnss(
      "TimeUS,I,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,VZ,Yaw,U\n"
      "1000000,0,3,1,2,9,1.1,45.0,9.0,100,2.0,90,-0.5,0,1\n1000000,1,3,1,2,9,1.1,46.0,9.0,100,2.0,90,-0.5,0,"
      "1\n"
      "1200000,0,1,1,2,9,1.1,45.5,9.0,100,2.0,90,-0.5,0,1\n1400000,0,4,1,2,9,1.1,45.0,9.0,101,2.0,0,-0.5,0,"
      "1\n",
      "GPS.csv", {}, remarks);
  ASSERT_TRUE(ardupilot) << ardupilot.error().message;
  ASSERT_EQ(ardupilot->velocities.size(), 2U);
  EXPECT_LT((ardupilot->velocities[0].velocity - Eigen::Vector3d(2, 0, 0.5)).norm(), 1e-12);
  EXPECT_LT((ardupilot->velocities[1].velocity - Eigen::Vector3d(0, 2, 0.5)).norm(), 1e-12);
  EXPECT_EQ(ardupilot->fixes[1].time, Time::from_seconds(1.4));
  EXPECT_NEAR(ardupilot->fixes[1].position.z(), 1, 1e-6);
  // PX4: integers of 1e-7 degrees and millimetres.
  const auto px4 = parse_gnss(
      "timestamp,lat,lon,alt,vel_n_m_s,vel_e_m_s,vel_d_m_s,fix_type\n"
      "5000000,450000000,90000000,100000,1,2,3,3\n5200000,450000000,90000000,101000,1,2,3,3\n",
      "gps.csv", {}, remarks);
  ASSERT_TRUE(px4) << px4.error().message;
  EXPECT_EQ(px4->fixes[0].time, Time::from_seconds(5));
  EXPECT_NEAR(px4->fixes[1].position.z(), 1, 1e-6);
  EXPECT_EQ(px4->velocities[0].velocity, Eigen::Vector3d(2, 1, -3));
}

struct ImuDialect {
  const char* name;
  std::string heading;
  double per_second;  ///< what the stamps count
  bool frd;
  double rate_scale = 1;
  double force_scale = 1;
  char separator = ',';
};

class ImuDialects : public testing::TestWithParam<ImuDialect> {};

TEST_P(ImuDialects, GiveTheSameSamples) {
  const ImuDialect& d = GetParam();
  std::string text = d.heading;
  for (int i = 0; i < 10; ++i) {
    const double s = d.frd ? -1 : 1;
    std::string row = fmt::format("{:.0f}", d.per_second * (100 + 0.01 * i));
    if (d.per_second == 1) row = fmt::format("{:.2f}", 100 + 0.01 * i);
    for (const double v : {0.1 / d.rate_scale, s * 0.2 / d.rate_scale, s * 0.3 / d.rate_scale,
                           1 / d.force_scale, s * 2 / d.force_scale, s * 9.7 / d.force_scale}) {
      row += fmt::format(",{:.12g}", v);
    }
    std::replace(row.begin(), row.end(), ',', d.separator);
    text += row + "\n";
  }
  std::vector<std::string> remarks;
  const auto read = parse_imu(text, "imu.csv", remarks);
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->size(), 10U);
  EXPECT_EQ(read->at(9).time, Time::from_seconds(100.09));
  EXPECT_LT((read->at(0).angular_rate - Eigen::Vector3d(0.1, 0.2, 0.3)).norm(), 1e-9);
  EXPECT_LT((read->at(0).specific_force - Eigen::Vector3d(1, 2, 9.7)).norm(), 1e-9);
}

constexpr double kDegree = std::numbers::pi / 180;

INSTANTIATE_TEST_SUITE_P(
    Of, ImuDialects,
    testing::Values(
        ImuDialect{"OursInDegreesAndG", "# frame=FLU\nt_s,gx [deg/s],gy,gz,ax [g],ay,az\n", 1, false, kDegree,
                   9.80665},
        ImuDialect{"Semicolons", "# frame=FLU\nt_s;gx;gy;gz;ax;ay;az\n", 1, false, 1, 1, ';'},
        ImuDialect{"Tabs", "# frame=FLU\nt_s\tgx\tgy\tgz\tax\tay\taz\n", 1, false, 1, 1, '\t'},
        ImuDialect{"Blanks", "# frame=FLU\nt_s gx gy gz ax ay az\n", 1, false, 1, 1, ' '},
        ImuDialect{"RatesAndForces", "# frame=FRD\nt_s,wx,wy,wz,fx,fy,fz\n", 1, true},
        ImuDialect{
            "Px4",
            "timestamp,gyro_rad[0],gyro_rad[1],gyro_rad[2],accelerometer_m_s2[0],accelerometer_m_s2[1],"
            "accelerometer_m_s2[2]\n",
            1e6, true},
        ImuDialect{"ArduPilot", "TimeUS,GyrX,GyrY,GyrZ,AccX,AccY,AccZ\n", 1e6, true},
        ImuDialect{"MavlinkInMilliseconds", "time_ms,xgyro,ygyro,zgyro,xacc,yacc,zacc\n", 1e3, true},
        ImuDialect{"RosBag",
                   "%time,field.angular_velocity.x,field.angular_velocity.y,field.angular_velocity.z,"
                   "field.linear_acceleration.x,field.linear_acceleration.y,field.linear_acceleration.z\n",
                   1e9, false},
        ImuDialect{"UnnamedMicroseconds",
                   "# frame=FLU\ntimestamp,gyro_x_dps,gyro_y_dps,gyro_z_dps,accel_x_g,accel_y_g,accel_z_g\n",
                   1e6, false, kDegree, 9.80665},
        ImuDialect{"Recordings",
                   "# t_s,gyr_x_radps,gyr_y,gyr_z,acc_x_mps2,acc_y,acc_z (FRD body, as mounted)\n", 1, true}),
    [](const auto& instance) { return std::string(instance.param.name); });

TEST(ImuLog, TakesColumnsByTheirNamesAndNotByTheirBeginnings) {
  std::vector<std::string> remarks;
  const auto read = parse_imu(
      "# "
      "frame=FLU\nt_s,gyro_temp_c,a_flag,gz,gy,gx,ax,ay,az\n0,35,1,0.3,0.2,0.1,1,2,9.7\n0.01,35,1,0.3,0.2,0."
      "1,1,2,9.7\n",
      "imu.csv", remarks);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->front().angular_rate, Eigen::Vector3d(0.1, 0.2, 0.3));
  EXPECT_EQ(read->front().specific_force, Eigen::Vector3d(1, 2, 9.7));
}

TEST(ImuLog, ReadsDecimalCommasBetweenSemicolons) {
  std::vector<std::string> remarks;
  const auto read =
      parse_imu("# frame=FLU\nt_s;gx;gy;gz;ax;ay;az\n0.00;0,1;0,2;0,3;1;2;9,7\n0.01;0,1;0,2;0,3;1;2;9,7\n",
                "imu.csv", remarks);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->front().angular_rate, Eigen::Vector3d(0.1, 0.2, 0.3));
}

TEST(ImuLog, NamesTheLineWhereAClockWasSetBack) {
  std::vector<std::string> remarks;
  const auto read =
      parse_imu(imu_text("# frame=FLU\nt_s,gx,gy,gz,ax,ay,az\n9.99,0,0,0,0,0,9.8\n"), "imu.csv", remarks);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_THAT(remarks, testing::Contains(HasSubstr("imu.csv:4: stamps go back from 9.990000 to 0.000000 s")));
}

TEST(BarometerLog, LeavesOutARowWithoutAFiniteSigma) {
  std::vector<std::string> remarks;
  const auto read = parse_barometer("t_s,height_m,sigma_m\n0,1,0.1\n1,2,x\n", "baro.csv", remarks);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->size(), 1U);
  ASSERT_EQ(remarks.size(), 1U);
  EXPECT_THAT(remarks[0], HasSubstr("1 of 2 rows left out"));
}

TEST(TruthLog, LooksNorthLevelWhenTheQuaternionIsTheIdentityOfNed) {
  std::vector<std::string> remarks;
  const auto read =
      parse_truth("# t_s,pN_m,pE,pD,vN_mps,vE,vD,qw,qx,qy,qz (q: NED<-FRD)\n0,1,2,3,4,5,6,1,0,0,0\n",
                  "truth.csv", remarks);
  ASSERT_TRUE(read) << read.error().message;
  const Pose& T = (*read)[0].T_world_body;
  EXPECT_LT((T.rotation * Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitY()).norm(), 1e-12)
      << "forward is north";
  EXPECT_LT((T.rotation * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitZ()).norm(), 1e-12) << "up is up";
  EXPECT_EQ(T.translation, Eigen::Vector3d(2, 1, -3));
}

TEST(Stamps, AreReadFromTheFirstFieldOfEachLine) {
  const auto read = parse_stamps("# comment\ntimestamp filename\n1.5 a.png\n2.25,b\n\n3\n", "rgb.txt");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(*read, (std::vector{Time::from_seconds(1.5), Time::from_seconds(2.25), Time::from_seconds(3)}));
  EXPECT_FALSE(parse_stamps("1.5\nx\n", "rgb.txt"));
}

}  // namespace
}  // namespace pade::io

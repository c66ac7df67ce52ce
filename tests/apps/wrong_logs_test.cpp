// Logs of IMU and GNSS that are not what they claim to be: each is named with what to do.
#include <cmath>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include "apps/recording.hpp"
#include "apps/wrong_input.hpp"

namespace pade {
namespace {

namespace fs = std::filesystem;
using test::Recording;
using test::write_file;
using test::Wrong;

constexpr double kDegree = 0.017453292519943295;
constexpr const char* kNavigate = "navigate log -o OUT";

const Wrong kLogs[] = {
    {"ColumnsThatNobodyKnows",
     [](const fs::path& f) {
       Recording r(1, 5);
       r.imu_head = "# frame=FLU\nt_s,roll_rate,pitch_rate,yaw_rate,acc1,acc2,acc3\n";
       r.write(f / "log");
     },
     kNavigate,
     1,
     {"imu.csv", "roll_rate", "gx gy gz"}},
    {"OnlyATemperature",
     [](const fs::path& f) {
       Recording r(1, 5);
       r.write(f / "log");
       write_file(f / "log" / "imu.csv", "t_s,gyro_temperature,accel_temperature\n0.0,20,21\n0.1,20,21\n");
     },
     kNavigate,
     1,
     {"imu.csv", "gyro_temperature", "gx gy gz"}},
    {"UnitThatNobodyKnows",
     [](const fs::path& f) {
       Recording r(1, 5);
       r.imu_head = "# frame=FLU\nt_s,gx [rpm],gy [rpm],gz [rpm],ax,ay,az\n";
       r.write(f / "log");
     },
     kNavigate,
     1,
     {"rpm", "rad/s or deg/s"}},
    {"NobodySaysWhichAxes",
     [](const fs::path& f) {
       Recording r(1, 5);
       r.imu_head = "t_s,gx,gy,gz,ax,ay,az\n";
       r.write(f / "log");
     },
     kNavigate,
     1,
     {"imu.csv", "# frame=FLU"}},
    {"NoVelocities",
     [](const fs::path& f) {
       Recording r(1);
       r.velocities = false;
       r.gnss_head = "# frame=ENU\nt_s,px,py,pz,sigma_px,sigma_py,sigma_pz\n";
       r.write(f / "log");
     },
     kNavigate,
     0,
     {"no columns of velocity", "--heading"}},
    {"UnitOfTheHeadingThatNobodyKnows",
     [](const fs::path& f) {
       Recording r(1, 5);
       r.gnss_head =
           "# frame=ENU\nt_s,px,py,pz,vx "
           "[knot/s],vy,vz,sigma_px,sigma_py,sigma_pz,sigma_vx,sigma_vy,sigma_vz\n";
       r.write(f / "log");
     },
     kNavigate,
     1,
     {"found unit 'knot/s' of vx", "km/h"}},
    {"LatitudesInMinutes",
     [](const fs::path& f) {
       Recording r(1, 5);
       r.write(f / "log");
       write_file(f / "log" / "gnss.csv", "t_s,lat,lon,alt\n0,4722.61,832.5,408\n0.2,4722.61,832.5,408\n");
     },
     kNavigate,
     1,
     {"gnss.csv: line 2: found latitude 4722.61", "ddmm.mmmm"}},
    {"TimesOfTheDay",
     [](const fs::path& f) {
       Recording r(1, 5);
       r.write(f / "log");
       write_file(f / "log" / "gnss.csv", "time,lat,lon,alt\n2020-09-13T12:26:00.0Z,47.3,8.5,408\n");
     },
     kNavigate,
     1,
     {"line 2: found time \"2020-09-13T12:26:00.0Z\"", "seconds"}},
    {"TablesOfAnAutopilotUnderTheirOwnNames",
     [](const fs::path& f) {
       write_file(f / "log" / "log_sensor_combined_0.csv", "timestamp\n");
       write_file(f / "log" / "log_vehicle_gps_position_0.csv", "timestamp\n");
     },
     kNavigate,
     1,
     {"expected imu.csv", "found log_sensor_combined_0.csv"}},
    {"ALogThatIsNoFolder",
     [](const fs::path& f) {
       write_file(f / "log", "no folder");
       fs::rename(f / "log", f / "log.bin");
     },
     "navigate log.bin -o OUT",
     1,
     {"is a file", "mavlogdump"}},
    {"ALogOfPx4ThatIsNone",
     [](const fs::path& f) {
       write_file(f / "log", "ULog");
       fs::rename(f / "log", f / "log.ulg");
     },
     "navigate log.ulg -o OUT",
     1,
     {"log.ulg: found no log of PX4"}},
    {"ARecordingOfAGroundStationThatIsNone",
     [](const fs::path& f) {
       write_file(f / "log", "no packets");
       fs::rename(f / "log", f / "log.tlog");
     },
     "navigate log.tlog -o OUT",
     1,
     {"log.tlog: found no packet of MAVLink"}},
    {"NoHeading",
     [](const fs::path& f) {
       Recording r(1, 5);
       r.imu_head = "";
       r.write(f / "log");
     },
     kNavigate,
     1,
     {"imu.csv:1", "expected a heading", "t_s,gx,gy,gz"}},
    {"NoGnss",
     [](const fs::path& f) {
       Recording(1, 5).write(f / "log");
       fs::remove(f / "log" / "gnss.csv");
     },
     kNavigate,
     1,
     {"no GNSS log found", "gnss.csv"}},
};

/// Each fix is that of `rows` of 0.2 s before.
void with_late_positions(const fs::path& folder, std::size_t rows) {
  Recording r(2, 90);
  auto& fixes = r.log.gnss.fixes;
  for (std::size_t i = fixes.size() - 1; i >= rows; --i) fixes[i].position = fixes[i - rows].position;
  r.write(folder / "log");
}

const Wrong kImplausible[] = {
    {"DegreesPerSecondGently",
     [](const fs::path& f) {
       Recording r(0.3);
       r.each_imu([](ImuSample& s) { s.angular_rate /= kDegree; });
       r.write(f / "log");
     },
     kNavigate,
     0,
     {"ERROR", "deg/s"}},
    {"DegreesPerSecond",
     [](const fs::path& f) {
       Recording r(2);
       r.each_imu([](ImuSample& s) { s.angular_rate /= kDegree; });
       r.write(f / "log");
     },
     kNavigate,
     1,
     {"in deg/s", "gx [deg/s]"}},
    {"AccelerationsInG",
     [](const fs::path& f) {
       Recording r(1);
       r.each_imu([](ImuSample& s) { s.specific_force /= 9.80665; });
       r.write(f / "log");
     },
     kNavigate,
     1,
     {"this is in g", "ax [g]"}},
    {"AccelerationsInMilliG",
     [](const fs::path& f) {
       Recording r(1);
       r.each_imu([](ImuSample& s) { s.specific_force /= 9.80665e-3; });
       r.write(f / "log");
     },
     kNavigate,
     1,
     {"this is in mg", "ax [mg]"}},
    {"ForwardRightDownCalledForwardLeftUp",
     [](const fs::path& f) {
       Recording r(1);
       r.each_imu([](ImuSample& s) {
         s.angular_rate = s.angular_rate.cwiseProduct(Eigen::Vector3d(1, -1, -1));
         s.specific_force = s.specific_force.cwiseProduct(Eigen::Vector3d(1, -1, -1));
       });
       r.write(f / "log");
     },
     kNavigate,
     0,
     {"frame=FRD"}},
    {"AxesThatChangedPlaces",
     [](const fs::path& f) {
       Recording r(2);
       r.each_imu([](ImuSample& s) {
         std::swap(s.angular_rate.x(), s.angular_rate.y());
         std::swap(s.specific_force.x(), s.specific_force.y());
       });
       r.write(f / "log");
     },
     kNavigate,
     0,
     {"ERROR", "left-handed"}},
    {"GyroscopesTurnedRound",
     [](const fs::path& f) {
       Recording r(2);
       r.each_imu([](ImuSample& s) { s.angular_rate *= -1; });
       r.write(f / "log");
     },
     kNavigate,
     0,
     {"ERROR", "other sign"}},
    {"OnlyTheGyroscopesForwardRightDown",
     [](const fs::path& f) {
       Recording r(1);
       r.each_imu(
           [](ImuSample& s) { s.angular_rate = s.angular_rate.cwiseProduct(Eigen::Vector3d(1, -1, -1)); });
       r.write(f / "log");
     },
     kNavigate,
     0,
     {"ERROR", "FLU and FRD"}},
    {"NorthEastDownCalledEastNorthUp",
     [](const fs::path& f) {
       Recording r(2);
       r.each_velocity([](GnssVelocity& v) {
         v.velocity = {v.velocity.y(), v.velocity.x(), -v.velocity.z()};
       });
       r.each_fix([](GnssFix& p) { p.position = {p.position.y(), p.position.x(), -p.position.z()}; });
       r.write(f / "log");
     },
     kNavigate,
     0,
     {"ERROR", "north, east, down"}},
    {"OnlyTheVelocitiesNorthEastDown",
     [](const fs::path& f) {
       Recording r(2);
       r.each_velocity([](GnssVelocity& v) {
         v.velocity = {v.velocity.y(), v.velocity.x(), -v.velocity.z()};
       });
       r.write(f / "log");
     },
     kNavigate,
     0,
     {"ERROR", "north, east, down"}},
    {"DegreesUnderEastNorth",
     [](const fs::path& f) {
       Recording r(1);
       r.each_fix([](GnssFix& p) {
         p.position = {8.54 + p.position.x() / 75000, 47.37 + p.position.y() / 111000, 408 + p.position.z()};
       });
       r.write(f / "log");
     },
     kNavigate,
     0,
     {"ERROR", "latitude and longitude", "lat, lon"}},
    {"DegreesUnderNorthEastOfTheSouth",
     [](const fs::path& f) {
       Recording r(2);
       r.each_fix([](GnssFix& p) {
         p.position = {-33.86 + p.position.y() / 111000, 151.2 + p.position.x() / 92000, 20 + p.position.z()};
       });
       r.write(f / "log");
     },
     kNavigate,
     0,
     {"ERROR", "latitude and longitude", "lat, lon"}},
    {"SigmaZero",
     [](const fs::path& f) {
       Recording r(1);
       r.sigma = 0;
       r.write(f / "log");
     },
     kNavigate,
     0,
     {"sigma", "1.5"}},
    {"SigmaNegative",
     [](const fs::path& f) {
       Recording r(1);
       r.sigma = -1;
       r.write(f / "log");
     },
     kNavigate,
     0,
     {"sigma", "1.5"}},
    {"LeapSeconds",
     [](const fs::path& f) {
       Recording r(2, 70);
       r.shift_gnss(18);
       r.write(f / "log");
     },
     kNavigate,
     0,
     {"leap seconds"}},
    {"LeapSecondsToTai",
     [](const fs::path& f) {
       Recording r(2, 110);
       r.shift_gnss(-37);
       r.write(f / "log");
     },
     kNavigate,
     0,
     {"leap seconds"}},
    {"GnssLate",
     [](const fs::path& f) {
       Recording r(2);
       r.shift_gnss(0.25);
       r.write(f / "log");
     },
     kNavigate,
     0,
     {"late", "--gnss-latency 0.2"}},
    {"OnlyThePositionsLate",
     [](const fs::path& f) { with_late_positions(f, 1); },
     kNavigate,
     0,
     {"positions are 0.", "late", "--gnss-latency"}},
    {"OnlyThePositionsLater",
     [](const fs::path& f) { with_late_positions(f, 2); },
     kNavigate,
     0,
     {"positions are 0.4", "late", "--gnss-latency 0.4"}},
    {"ClocksApart",
     [](const fs::path& f) {
       Recording r(1);
       r.shift_gnss(1.7e9);
       r.write(f / "log");
     },
     kNavigate,
     1,
     {"no overlap"}},
    {"ClocksThatHardlyMeet",
     [](const fs::path& f) {
       Recording r(1);
       r.shift_gnss(30);
       r.write(f / "log");
     },
     kNavigate,
     0,
     {"they share 10 s only", "clocks differ"}},
    {"ClockSetBack",
     [](const fs::path& f) {
       Recording r(1);
       for (std::size_t i = r.log.imu.size() / 2; i < r.log.imu.size(); ++i)
         r.log.imu[i].time.nanoseconds -= 8'000'000'000;
       r.write(f / "log");
     },
     kNavigate,
     0,
     {"ERROR", "stamps go back", "imu.csv:", "cut the log there"}},
    {"TwoLogsInOne",
     [](const fs::path& f) {
       Recording r(1);
       const std::size_t count = r.log.imu.size();
       for (std::size_t i = 0; i < count; ++i) r.log.imu.push_back(r.log.imu[i]);
       r.write(f / "log");
     },
     kNavigate,
     0,
     {"ERROR", "stamps go back", "imu.csv:", "cut the log there"}},
    {"StampsOfTwentyMilliseconds",
     [](const fs::path& f) {
       Recording r(1);
       r.each_imu([](ImuSample& s) { s.time.nanoseconds -= s.time.nanoseconds % 20'000'000; });
       r.write(f / "log");
     },
     kNavigate,
     0,
     {"straight line", "repeat"}},
    {"StampsThatJitter",
     [](const fs::path& f) {
       Recording r(1);
       std::mt19937 random(1);
       r.each_imu([&](ImuSample& s) { s.time.nanoseconds += random() % 30'000'000; });
       r.write(f / "log");
     },
     kNavigate,
     0,
     {"straight line"}},
    {"FiftyHertzPicked",
     [](const fs::path& f) {
       Recording r(1);
       std::mt19937 random(1);
       std::normal_distribution<double> shake(0, 3);
       std::vector<ImuSample> picked;
       for (std::size_t i = 0; i < r.log.imu.size(); i += 2) {
         picked.push_back(r.log.imu[i]);
         picked.back().specific_force += Eigen::Vector3d(shake(random), shake(random), shake(random));
       }
       r.log.imu = picked;
       r.write(f / "log");
     },
     kNavigate,
     0,
     {"picked"}},
    {"TwentyHertzPicked",
     [](const fs::path& f) {
       Recording r(1);
       std::mt19937 random(2);
       std::normal_distribution<double> shake(0, 5);
       std::vector<ImuSample> picked;
       for (std::size_t i = 0; i < r.log.imu.size(); i += 5) {
         picked.push_back(r.log.imu[i]);
         picked.back().specific_force += Eigen::Vector3d(shake(random), shake(random), shake(random));
       }
       r.log.imu = picked;
       r.write(f / "log");
     },
     kNavigate,
     0,
     {"picked"}},
    {"BarometerThatPointsDown",
     [](const fs::path& f) {
       Recording r(2);
       r.barometer = test::barometer(40, [](double t) { return 400 - 8 * std::sin(0.5 * t); });
       r.write(f / "log");
     },
     kNavigate,
     0,
     {"ERROR", "barometer", "baro.csv"}},
    {"BarometerInFeet",
     [](const fs::path& f) {
       Recording r(2);
       r.barometer = test::barometer(40, [](double t) { return 1300 + 20 * t; });
       r.write(f / "log");
     },
     kNavigate,
     0,
     {"ERROR", "barometer", "baro.csv"}},
};

class WrongLogs : public testing::TestWithParam<Wrong> {};

TEST_P(WrongLogs, AreNamedWithWhatToDo) { test::expect_named(GetParam()); }

INSTANTIATE_TEST_SUITE_P(Of, WrongLogs, testing::ValuesIn(test::together(kLogs, kImplausible)),
                         [](const auto& instance) { return std::string(instance.param.name); });

}  // namespace
}  // namespace pade

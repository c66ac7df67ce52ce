// The map on disk while a session goes on: whole at any moment, whatever ends the program.
#include "pade/live/map_saver.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>
#include <new>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include "pade/io/formats/map_files.hpp"
#include "pade/io/text.hpp"
#include "pade/live/recordings/session_recorder.hpp"
#include "pade/live/service.hpp"

#include "support/synced_files.hpp"

namespace pade::live {
namespace {

namespace fs = std::filesystem;
using mapping::MapView;
using mapping::OccupancyMap;

/// Walls at so many metres, one behind the other, each seen from the near side.
std::shared_ptr<const MapView> walls(int count) {
  Camera camera;
  camera.width = 40;
  camera.height = 30;
  camera.fx = camera.fy = 30;
  camera.cx = 19.5;
  camera.cy = 14.5;
  OccupancyMap map = std::move(OccupancyMap::create()).value();
  for (int i = 0; i < count; ++i) {
    DepthImage image;
    image.time = Time{i * 100'000'000LL};
    image.depth = cv::Mat(camera.height, camera.width, CV_32FC1, cv::Scalar(1 + 0.5 * i));
    image.variance = cv::Mat(image.depth.size(), CV_32FC1, cv::Scalar(0));
    image.state = cv::Mat(image.depth.size(), CV_8UC1, cv::Scalar(0));
    Pose pose;
    pose.translation.x() = 8.0 * i;
    map.integrate(image, camera, pose);
  }
  return MapView::of(map);
}

LiveUpdate update_with(std::shared_ptr<const MapView> view) { return {Time{}, Pose{}, std::move(view), 1}; }

std::string bytes_of_view(const MapView& view) {
  return io::bytes_of(io::encode_map(view, io::MapFormat::bt));
}

class MapOnDisk : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / fmt::format("pade_map_saver_{}", std::random_device{}());
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  [[nodiscard]] fs::path file(const std::string& name) const { return folder_ / name; }
  [[nodiscard]] std::string content(const std::string& name) const {
    const auto text = io::read_file(file(name));
    return text ? *text : std::string();
  }

  fs::path folder_;
};

template <class Condition>
bool within_seconds(double seconds, const Condition& condition) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return true;
}

TEST_F(MapOnDisk, IsTheNewestViewWithinTheInterval) {
  MapSaver saver(file("map.bt"), 0.05);
  for (const int count : {1, 3}) {
    const auto view = walls(count);
    saver.take(update_with(view));
    EXPECT_TRUE(within_seconds(5, [&] { return content("map.bt") == bytes_of_view(*view); })) << count;
  }
  // A map lies there before it is counted.
  EXPECT_TRUE(within_seconds(5, [&] { return saver.report().saved == 2; })) << saver.report().saved;
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  EXPECT_EQ(saver.report().saved, 2U) << "the same map is written again";
}

TEST_F(MapOnDisk, OfBeforeAJumpIsKeptUnderItsNumber) {
  const auto first = walls(2);
  const auto second = walls(1);
  const auto third = walls(3);
  MapSaver saver(file("map.bt"), 0);
  saver.begin_anew();  // before anything was mapped: there is nothing to keep
  saver.take(update_with(first));
  saver.begin_anew();
  saver.take(update_with(second));
  saver.begin_anew();
  saver.begin_anew();
  saver.take(update_with(third));
  const SaverReport report = saver.finish();
  EXPECT_EQ(content("map-1.bt"), bytes_of_view(*first));
  EXPECT_EQ(content("map-2.bt"), bytes_of_view(*second));
  EXPECT_EQ(report.saved, 2U);
  EXPECT_THAT(report.finished, testing::ElementsAre(file("map-1.bt").string(), file("map-2.bt").string()));
  EXPECT_FALSE(fs::exists(file("map-3.bt")));
  EXPECT_FALSE(fs::exists(file("map.bt"))) << "autosave is off";
}

/// Whoever starts the program again, systemd among them, finds what it had saved before.
TEST_F(MapOnDisk, OfAnEarlierSessionIsKeptToo) {
  const auto first = walls(1);
  const auto second = walls(2);
  for (int session = 0; session < 3; ++session) {
    MapSaver saver(file("map.bt"), 0.02);
    if (session == 1) continue;  // that maps nothing
    saver.take(update_with(session == 0 ? first : second));
    ASSERT_TRUE(within_seconds(5, [&] { return saver.report().saved > 0; }));
    EXPECT_EQ(saver.finish().earlier, session == 0 ? "" : file("map-1.bt").string());
  }
  EXPECT_EQ(content("map-1.bt"), bytes_of_view(*first));
  EXPECT_EQ(content("map.bt"), bytes_of_view(*second));
  EXPECT_FALSE(fs::exists(file("map-2.bt")));
}

/// Neither a session in which nothing was seen nor one that wrote only at its end costs what was there.
TEST_F(MapOnDisk, OfAnEarlierSessionIsNotWrittenOverByAnEmptyOne) {
  std::ofstream(file("map.bt")) << "earlier";
  const OccupancyMap empty = std::move(OccupancyMap::create()).value();
  {
    MapSaver saver(file("map.bt"), 0.01);
    saver.take(update_with(MapView::of(empty)));
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    const SaverReport report = saver.finish();
    EXPECT_FALSE(report.any);
    EXPECT_EQ(report.saved, 0U);
    EXPECT_EQ(content("map.bt"), "earlier");
  }
  MapSaver saver(file("map.bt"), 0);
  EXPECT_FALSE(saver.finish().any);
  ASSERT_TRUE(saver.write_last(empty));  // whatever it holds, and though no view ever came
  EXPECT_EQ(content("map-1.bt"), "earlier");
  EXPECT_EQ(saver.report().earlier, file("map-1.bt").string());
  ASSERT_TRUE(saver.write_last(empty));
  EXPECT_FALSE(fs::exists(file("map-2.bt"))) << "its own is written over";
}

/// Without them another threshold would be taken, and what was there before would say where on Earth this
/// lies.
TEST_F(MapOnDisk, ItsOptionsAndItsOriginLieBesideIt) {
  for (const char* const name : {"map.bt", "map.ot", "map.json"})
    std::ofstream(file(name)) << "earlier " << name;
  mapping::MapOptions options;
  options.occupancy_threshold = 0.4;
  const auto expect_beside = [&](const std::string& name, double x) {
    const auto read = io::options_beside(file(name));
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(read->occupancy_threshold, 0.4) << name;
    EXPECT_EQ(io::local_origin_of(file(name)).x(), x) << name;
  };
  MapSaver saver(file("map.bt"), 0.02, options);
  LiveUpdate update = update_with(walls(1));
  update.origin.x() = 100;
  saver.take(update);
  ASSERT_TRUE(within_seconds(5, [&] { return saver.report().saved > 0; }));
  expect_beside("map.bt", 100);
  EXPECT_EQ(saver.report().earlier, file("map-1.bt").string());
  for (const char* const extension : {".bt", ".ot", ".json"})
    EXPECT_EQ(content(fmt::format("map-1{}", extension)), fmt::format("earlier map{}", extension));
  EXPECT_FALSE(fs::exists(file("map.ot"))) << "it would be read by what lies beside another map";
  saver.begin_anew();
  update.origin.x() = 3000;
  saver.take(update);
  saver.finish();
  ASSERT_TRUE(saver.write_last(std::move(OccupancyMap::create(options)).value()));
  expect_beside("map-2.bt", 100);
  expect_beside("map.bt", 3000);
}

/// What cannot be moved stays.
TEST_F(MapOnDisk, OfAnEarlierSessionThatCannotBeMovedStays) {
  // Longer than a name may be once it has its number.
  const std::string name = std::string(252, 'm') + ".bt";
  std::ofstream(file(name)) << "earlier";
  MapSaver saver(file(name), 0);
  saver.finish();
  const Status status = saver.write_last(std::move(OccupancyMap::create()).value());
  ASSERT_FALSE(status);
  EXPECT_THAT(status.error().message, testing::HasSubstr("cannot be moved"));
  EXPECT_EQ(content(name), "earlier");
}

TEST_F(MapOnDisk, ThatCannotBeWrittenIsCountedAndNamed) {
  MapSaver saver(folder_ / "nowhere" / "map.bt", 0.02);
  saver.take(update_with(walls(1)));
  ASSERT_TRUE(within_seconds(5, [&] { return saver.report().failed > 0; }));
  const SaverReport report = saver.finish();
  EXPECT_EQ(report.saved, 0U);
  EXPECT_THAT(report.error, testing::HasSubstr("nowhere"));
}

/// As a power cut, at any moment: what lies there is the whole of one of the maps, and nothing but.
TEST_F(MapOnDisk, IsWholeAfterFiftyKills) {
  const std::array views{walls(1), walls(2), walls(3), walls(4)};
  std::vector<std::string> bytes;
  for (const auto& view : views) bytes.push_back(bytes_of_view(*view));
  std::mt19937 random(3);
  std::uniform_int_distribution<int> moment(0, 25000);  // us after the first map lies there
  int there = 0;
  for (int kill = 0; kill < 50; ++kill) {
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      MapSaver saver(file("map.bt"), 0.0005);
      for (std::size_t i = 0;; ++i) {
        saver.take(update_with(views[i % views.size()]));
        std::this_thread::sleep_for(std::chrono::microseconds(300));
      }
    }
    const bool saved = within_seconds(5, [&] { return fs::exists(file("map.bt")); });
    std::this_thread::sleep_for(std::chrono::microseconds(moment(random)));
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    ASSERT_TRUE(saved) << "kill " << kill;
    for (const auto& entry : fs::directory_iterator(folder_)) {
      if (!entry.path().filename().string().starts_with("map")) continue;  // half of one, under a hidden name
      if (entry.path().extension() == ".json") {
        EXPECT_TRUE(io::decode_local_origin(content(entry.path().filename().string()), "map.json"))
            << "kill " << kill;
        fs::remove(entry.path());
        continue;
      }
      const std::string left = content(entry.path().filename().string());
      ASSERT_THAT(bytes, testing::Contains(left)) << "kill " << kill << ": " << left.size() << " bytes";
      ++there;
      fs::remove(entry.path());
    }
  }
  EXPECT_EQ(there, 50);
}

/// What a killed child had to say, in memory that outlives it.
struct Witness {
  std::atomic<int> saved{-1};  // the last map that lies there for certain
  std::atomic<bool> begun{false};
};

/// @param each  called in the child with the number of the map that comes, until it is killed
void kill_at(int microseconds, Witness& witness, const std::function<void(int)>& each) {
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    for (int i = 0;; ++i) {
      each(i);
      witness.begun = true;
    }
  }
  EXPECT_TRUE(within_seconds(5, [&] { return witness.begun.load(); }));
  std::this_thread::sleep_for(std::chrono::microseconds(microseconds));
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
}

/// What lies there is the last map that was saved, or the one that was just being written: never an older
/// one, and never one with the origin of another, though the poses jump at each third.
TEST_F(MapOnDisk, LosesInFiftyKillsOnlyWhatCameAfterTheLastSave) {
  const std::array views{walls(1), walls(2), walls(3), walls(4), walls(5), walls(6)};
  const int count = static_cast<int>(views.size());
  std::vector<std::string> bytes;
  for (const auto& view : views) bytes.push_back(bytes_of_view(*view));
  void* const shared =
      ::mmap(nullptr, sizeof(Witness), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  ASSERT_NE(shared, MAP_FAILED);
  std::mt19937 random(4);
  std::uniform_int_distribution<int> moment(0, 60000);  // us
  int maps = 0;
  for (int kill = 0; kill < 50 && !HasFailure(); ++kill) {
    Witness& witness = *new (shared) Witness;
    std::optional<MapSaver> saver;  // of the child
    kill_at(moment(random), witness, [&](int i) {
      if (!saver) saver.emplace(file("map.bt"), 0.0001);
      if (i % 3 == 2) saver->begin_anew();
      LiveUpdate update = update_with(views[static_cast<std::size_t>(i % count)]);
      update.origin.x() = (i + 1) / 3;  // NOLINT(bugprone-integer-division): jumps so far
      const std::size_t before = saver->report().saved;
      const std::size_t wanted = before + (i % 3 == 2 ? 2 : 1);  // the one that ended, and this one
      saver->take(update);
      while (saver->report().saved < wanted) std::this_thread::sleep_for(std::chrono::microseconds(50));
      witness.saved = i;
    });
    const int saved = witness.saved;
    int newest = -1;
    for (const auto& entry : fs::directory_iterator(folder_)) {
      const std::string name = entry.path().filename().string();
      if (!name.starts_with("map") || entry.path().extension() != ".bt") continue;
      ASSERT_TRUE(fs::exists(io::side_car_of(entry.path()))) << "kill " << kill << ": " << name;
      // Of the three pictures of a map that has this origin it is one.
      const int last = 3 * static_cast<int>(io::local_origin_of(entry.path()).x()) + 1;
      int number = last;
      while (number > last - 3 &&
             (number < 0 || content(name) != bytes[static_cast<std::size_t>(number % count)]))
        --number;
      EXPECT_GT(number, last - 3) << "kill " << kill << ": " << name;
      newest = std::max(newest, number);
      ++maps;
    }
    EXPECT_GE(newest, saved) << "kill " << kill;
    EXPECT_LE(newest, saved + 1) << "kill " << kill;
    for (const auto& entry : fs::directory_iterator(folder_)) fs::remove(entry.path());
  }
  EXPECT_GE(maps, 50);
  ::munmap(shared, sizeof(Witness));
}

/// The start of a session moves what an earlier one has left; whatever ends it, no map loses what lies beside
/// it.
TEST_F(MapOnDisk, KeepsWhatLiesBesideAnEarlierOneInFiftyKills) {
  const auto view = walls(1);
  void* const shared =
      ::mmap(nullptr, sizeof(Witness), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  ASSERT_NE(shared, MAP_FAILED);
  std::mt19937 random(5);
  std::uniform_int_distribution<int> moment(0, 5000);  // us
  for (int kill = 0; kill < 50; ++kill) {
    kill_at(moment(random), *new (shared) Witness, [&](int) {
      MapSaver saver(file("map.bt"), 0.0001);
      saver.take(update_with(view));
      while (saver.report().saved == 0) std::this_thread::sleep_for(std::chrono::microseconds(50));
    });
  }
  int maps = 0;
  for (const auto& entry : fs::directory_iterator(folder_)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with("map") || entry.path().extension() != ".bt") continue;
    EXPECT_TRUE(fs::exists(io::side_car_of(entry.path()))) << name;
    EXPECT_EQ(content(name), bytes_of_view(*view)) << name;
    ++maps;
  }
  EXPECT_GE(maps, 50);
  ::munmap(shared, sizeof(Witness));
}

/// Pulling the battery takes what the system had not written yet: of a file the bytes, so that it is there
/// and empty, of a folder the names.
TEST_F(MapOnDisk, IsOnTheDiskItselfAndSoIsTheRecording) {
  using testing::Contains;
  test::SyncedFiles& disk = test::SyncedFiles::all();
  const auto expect_whole = [&](const std::string& name, const std::string& before) {
    const auto synced = disk.take();
    const auto file = std::find_if(synced.begin(), synced.end(), [&](const test::Synced& s) {
      return s.path.find(before) != std::string::npos && s.bytes == content(name).size();
    });
    ASSERT_NE(file, synced.end()) << name << ": its bytes";
    EXPECT_TRUE(std::any_of(file, synced.end(),
                            [&](const test::Synced& s) {
                              return s.path == folder_.string() &&
                                     std::count(s.names.begin(), s.names.end(), name) == 1;
                            }))
        << name << ": its name";
  };
  disk.take();
  const auto view = walls(2);
  MapSaver saver(file("map.bt"), 0.02);
  saver.take(update_with(view));
  ASSERT_TRUE(within_seconds(5, [&] { return saver.report().saved > 0; }));
  expect_whole("map.bt", ".map.bt.partial");
  saver.begin_anew();
  ASSERT_TRUE(within_seconds(5, [&] { return saver.report().finished.size() == 1; }));
  expect_whole("map-1.bt", ".map-1.bt.partial");
  saver.finish();

  OccupancyMap map = std::move(OccupancyMap::create()).value();
  MapSaver last(file("end.ot"), 0);
  last.finish();
  ASSERT_TRUE(last.write_last(map));
  expect_whole("end.ot", ".end.ot.partial");

  Camera small;
  small.width = small.height = 8;
  auto recorder = SessionRecorder::create(file("flight.mcap"), small, {});
  ASSERT_TRUE(recorder) << recorder.error().message;
  (*recorder)->take({cv::Mat::zeros(8, 8, CV_8UC1), Time{1'000'000'000}, Pose{}, Matrix6d::Zero()});
  ASSERT_TRUE((*recorder)->finish());
  expect_whole("flight.mcap", "flight.mcap.part");
}

/// A socket as systemd has one.
class Listener {
 public:
  explicit Listener(const std::string& address) : socket_(::socket(AF_UNIX, SOCK_DGRAM, 0)) {
    sockaddr_un here{};
    here.sun_family = AF_UNIX;
    address.copy(here.sun_path, sizeof here.sun_path - 1);
    if (address.front() == '@') here.sun_path[0] = '\0';
    const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + address.size());
    EXPECT_EQ(::bind(socket_, reinterpret_cast<const sockaddr*>(&here), length), 0);
  }
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;
  ~Listener() { ::close(socket_); }
  [[nodiscard]] std::string next() const {
    std::array<char, 512> buffer{};
    const auto size = ::recv(socket_, buffer.data(), buffer.size(), MSG_DONTWAIT);
    return size < 0 ? std::string() : std::string(buffer.data(), static_cast<std::size_t>(size));
  }

 private:
  int socket_;
};

TEST_F(MapOnDisk, AndSystemdHearsOfTheSession) {
  for (const std::string& address :
       {file("notify").string(), fmt::format("@pade-test-{}", std::random_device{}())}) {
    const Listener systemd(address);
    const ServiceManager service(address);
    EXPECT_TRUE(service.listens());
    service.ready();
    service.alive("no image from the camera\nREADY=0");
    service.stopping();
    EXPECT_EQ(systemd.next(), "READY=1");
    EXPECT_EQ(systemd.next(), "WATCHDOG=1\nSTATUS=no image from the camera");
    EXPECT_EQ(systemd.next(), "STOPPING=1");
    EXPECT_EQ(systemd.next(), "");
  }
  EXPECT_FALSE(ServiceManager("").listens());
  EXPECT_FALSE(ServiceManager("relative").listens());
  EXPECT_FALSE(ServiceManager("/" + std::string(200, 'x')).listens());
  ServiceManager(file("gone").string()).ready();  // nobody is there any more: no harm
}

}  // namespace
}  // namespace pade::live

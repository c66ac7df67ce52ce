// Messages as clients get them, read by their advertised definitions, and what clients get that are slow.
#include "pade/live/web/publisher.hpp"

#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <string>
#include <tuple>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pade/io/image/image_codec.hpp"
#include "pade/io/recording/messages/message_definitions.hpp"
#include "pade/live/web/pictures.hpp"
#include "pade/live/web/thinned_path.hpp"

#include "live/web/schema_reader.hpp"
#include "live/web/small_world.hpp"

namespace pade::live {
namespace {

using ::testing::HasSubstr;
using Voxel = std::tuple<long, long, long>;

std::string schema_of(WebChannel channel) {
  return io::message_definition(web_channels[static_cast<std::size_t>(channel)].type,
                                io::MessageEncoding::cdr);
}

/// A client of a publisher, without a network between.
struct Follower {
  Decoded next(Publisher& publisher, WebChannel channel) {
    const auto message = publisher.next(channel, cursor);
    if (!message) return {};
    return SchemaReader(schema_of(channel)).read(*message->bytes);
  }
  Publisher::Cursor cursor;
};

struct PublisherBed {
  explicit PublisherBed(cv::Size size = {96, 64})
      : world(size), publisher(world.camera(), forward_mounting(), SectorOptions{}, healthy) {
    publisher.set_hungry(true);
  }
  SmallWorld world;
  Publisher publisher;
};

TEST(WebMessages, SayWhatTheMapperSaid) {
  PublisherBed bed;
  bed.world.give(bed.publisher, 2, {1, 2, 3});
  Follower client;
  const Decoded depth = client.next(bed.publisher, WebChannel::depth);
  EXPECT_EQ(depth["width"].number, 96);
  EXPECT_EQ(depth["height"].number, 64);
  EXPECT_EQ(depth["encoding"].text, "32FC1");
  EXPECT_EQ(depth["header"]["frame_id"].text, "camera");
  const cv::Mat pixels(64, 96, CV_32FC1, const_cast<char*>(depth["data"].text.data()));
  EXPECT_EQ(pixels.at<float>(30, 60), 2.0F);
  EXPECT_TRUE(std::isnan(pixels.at<float>(30, 5)));
  const Decoded sigma = client.next(bed.publisher, WebChannel::sigma);
  EXPECT_NEAR(reinterpret_cast<const float*>(sigma["data"].text.data())[30 * 96 + 60], 0.1, 1e-6);

  const Decoded transforms = client.next(bed.publisher, WebChannel::transforms)["transforms"];
  ASSERT_EQ(transforms.list.size(), 2U);
  EXPECT_EQ(transforms.list[0]["header"]["frame_id"].text, "map");
  EXPECT_EQ(transforms.list[0]["child_frame_id"].text, "base_link");
  EXPECT_EQ(transforms.list[0]["transform"]["translation"]["y"].number, 2);
  EXPECT_EQ(transforms.list[1]["child_frame_id"].text, "camera");
  const Decoded& turn = transforms.list[1]["transform"]["rotation"];
  const Eigen::Quaterniond rotation(turn["w"].number, turn["x"].number, turn["y"].number, turn["z"].number);
  EXPECT_TRUE(rotation.toRotationMatrix().isApprox(forward_camera_rotation(), 1e-9));

  const Decoded path = client.next(bed.publisher, WebChannel::path)["poses"];
  ASSERT_EQ(path.list.size(), 1U);
  EXPECT_EQ(path.list[0]["pose"]["position"]["z"].number, 3);

  const Decoded cloud = client.next(bed.publisher, WebChannel::cloud);
  EXPECT_EQ(cloud["point_step"].number, 16);
  EXPECT_EQ(cloud["fields"].list[3]["name"].text, "sigma");
  EXPECT_EQ(cloud["width"].number, 72 * 64);
  const std::string& data = cloud["data"].text;
  ASSERT_EQ(data.size(), 16U * 72 * 64);
  const auto* const point = reinterpret_cast<const float*>(data.data());
  EXPECT_NEAR(point[0], 1 + 2, 1e-5);  // ahead is x
  EXPECT_NEAR(point[3], 0.1, 1e-6);

  const Decoded info = client.next(bed.publisher, WebChannel::camera_info);
  EXPECT_EQ(info["k"].list[0].number, 60);
  for (const WebChannel channel : {WebChannel::camera, WebChannel::obstacles, WebChannel::depth_picture}) {
    const std::string file = client.next(bed.publisher, channel)["data"].text;
    const cv::Mat picture = *io::decode_image(io::image_bytes(file), io::Pixels::colour);
    EXPECT_EQ(picture.size(), cv::Size(96, 64)) << static_cast<int>(channel);
  }
}

/// Far from the origin of the poses a map has an origin of its own, which is said by a transform.
TEST(WebMessages, OfAMapWithAnOriginOfItsOwnAreInItsFrame) {
  PublisherBed bed;
  bed.world.origin = {500'000, 2, 0};
  bed.world.give(bed.publisher, 2, {1, 0, 0});
  Follower client;
  for (const WebChannel channel : {WebChannel::cloud, WebChannel::path}) {
    EXPECT_EQ(client.next(bed.publisher, channel)["header"]["frame_id"].text, "pade_map");
  }
  bed.publisher.refresh({}, true);
  const Decoded voxels = client.next(bed.publisher, WebChannel::voxels)["markers"];
  ASSERT_FALSE(voxels.list.empty());
  EXPECT_EQ(voxels.list.back()["header"]["frame_id"].text, "pade_map");
  const Decoded transforms = client.next(bed.publisher, WebChannel::transforms)["transforms"];
  ASSERT_EQ(transforms.list.size(), 3U);
  EXPECT_EQ(transforms.list[0]["header"]["frame_id"].text, "pade_map");
  EXPECT_EQ(transforms.list[0]["child_frame_id"].text, "base_link");
  EXPECT_EQ(transforms.list[1]["header"]["frame_id"].text, "map");
  EXPECT_EQ(transforms.list[1]["child_frame_id"].text, "pade_map");
  EXPECT_EQ(transforms.list[1]["transform"]["translation"]["x"].number, 500'000);
  EXPECT_EQ(transforms.list[1]["transform"]["rotation"]["w"].number, 1);
}

/// An image of depth is of the size that its calibration states, whatever windows the mapper has.
TEST(WebMessages, DepthInCellsIsOnThePixelsOfTheCamera) {
  PublisherBed bed({90, 62});
  bed.world.window = 4;
  bed.world.give(bed.publisher, 2, {0, 0, 0});
  Follower client;
  const Decoded info = client.next(bed.publisher, WebChannel::camera_info);
  for (const WebChannel channel : {WebChannel::depth, WebChannel::sigma}) {
    const Decoded image = client.next(bed.publisher, channel);
    EXPECT_EQ(image["width"].number, info["width"].number);
    EXPECT_EQ(image["height"].number, info["height"].number);
    const cv::Mat pixels(62, 90, CV_32FC1, const_cast<char*>(image["data"].text.data()));
    EXPECT_TRUE(std::isnan(pixels.at<float>(61, 19)));
    EXPECT_NEAR(pixels.at<float>(61, 20), channel == WebChannel::depth ? 2 : 0.1, 1e-6);
    EXPECT_NEAR(pixels.at<float>(0, 89), channel == WebChannel::depth ? 2 : 0.1, 1e-6);
  }
  EXPECT_EQ(client.next(bed.publisher, WebChannel::cloud)["width"].number, 18 * 16);
}

TEST(WebMessages, SectorsKeepFreeAndUnknownApart) {
  PublisherBed bed;
  std::array<std::uint16_t, kBins> distances{};
  distances.fill(kUnknownDistance);
  distances[0] = 250;
  distances[1] = 2001;
  distances[71] = 1999;
  bed.publisher.take_sectors(distances, {5'000'000'007});
  Follower client;
  const Decoded scan = client.next(bed.publisher, WebChannel::sectors);
  ASSERT_EQ(scan["ranges"].list.size(), kBins);
  EXPECT_EQ(scan["header"]["stamp"]["sec"].number, 5);
  EXPECT_EQ(scan["header"]["stamp"]["nanosec"].number, 7);
  EXPECT_EQ(scan["ranges"].list[0].number, 2.5);
  EXPECT_NEAR(scan["ranges"].list[1].number, 19.99, 1e-5);  // to the left: that before the first, clockwise
  EXPECT_EQ(scan["ranges"].list[71].number, std::numeric_limits<double>::infinity());
  EXPECT_TRUE(std::isnan(scan["ranges"].list[36].number));
  EXPECT_NEAR(scan["angle_increment"].number * 72, 2 * M_PI, 1e-5);
  EXPECT_NEAR(scan["angle_max"].number, 2 * M_PI * 71 / 72, 1e-5);
}

TEST(WebMessages, HealthIsTheSameAsJson) {
  PublisherBed bed;
  SessionCounts counts;
  counts.frames = 12;
  counts.mapped = 7;
  counts.skipped = 2;
  counts.dropped = 3;
  counts.reasons["no pose in time"] = 2;
  bed.publisher.take_counts(counts);
  bed.publisher.refresh({3, 4, 5, 6, "because \"of\" this"}, true);
  Follower client;
  const Decoded status = client.next(bed.publisher, WebChannel::health)["status"];
  ASSERT_EQ(status.list.size(), 1U);
  EXPECT_EQ(status.list[0]["level"].number, 0);
  EXPECT_EQ(status.list[0]["message"].text, "obstacle mapping active");
  std::map<std::string, std::string> values;
  for (const Decoded& pair : status.list[0]["values"].list) values[pair["key"].text] = pair["value"].text;
  EXPECT_EQ(values["dropped"], "3");
  EXPECT_EQ(values["web_clients"], "3");
  EXPECT_EQ(values["web_dropped"], "5");
  EXPECT_EQ(values["skipped_because"], "no pose in time: 2");
  const std::string json = json_of(bed.publisher.health());
  EXPECT_THAT(json, HasSubstr(R"("web_last_refusal": "because \"of\" this")"));
  values.erase("web_last_refusal");
  for (const auto& [key, value] : values)
    EXPECT_THAT(json, HasSubstr(fmt::format("\"{}\": \"{}\"", key, value)));
}

TEST(SessionHealth, CountsEachPacketThatWasLost) {
  HealthInputs inputs;
  inputs.link.in.gaps = 2;
  inputs.link.in.lost = 9;
  const auto values = SessionHealth().of(inputs).values;
  EXPECT_THAT(values, testing::Contains(testing::Pair("packets_lost", "9")));
}

Voxel voxel_at(double x, double y, double z, double side) {
  return {std::lround(x / side - 0.5), std::lround(y / side - 0.5), std::lround(z / side - 0.5)};
}

/// What the map has, by the octree's leaves.
std::set<Voxel> occupied_of(const mapping::MapView& view) {
  std::set<Voxel> voxels;
  view.for_each_leaf([&](const mapping::MapLeaf& leaf) {
    if (!leaf.is_occupied) return;
    const long side = 1L << (16 - leaf.depth);
    std::array<long, 3> at{};
    for (int bit = 0; bit < 16; ++bit)
      for (std::size_t axis = 0; axis < 3; ++axis)
        at[axis] |= static_cast<long>(leaf.code >> (3 * bit + static_cast<int>(axis)) & 1U) << bit;
    for (long z = 0; z < side; ++z)
      for (long y = 0; y < side; ++y)
        for (long x = 0; x < side; ++x)
          voxels.insert({at[0] + x - 32768, at[1] + y - 32768, at[2] + z - 32768});
  });
  return voxels;
}

/// What a client draws.
struct Drawn {
  std::map<int, std::set<Voxel>> blocks;
  int removed = 0;
  void take(const std::vector<io::CubeMarker>& markers) {
    for (const io::CubeMarker& marker : markers) {
      removed += marker.action == io::CubeMarker::Action::remove ? 1 : 0;
      if (marker.action == io::CubeMarker::Action::remove_all) {
        blocks.clear();
        continue;
      }
      auto& block = blocks[marker.number];
      block.clear();
      EXPECT_EQ(marker.centres.size(), marker.colours.size());
      for (const Eigen::Vector3f& c : marker.centres)
        block.insert(voxel_at(c.x(), c.y(), c.z(), marker.side));
    }
  }
  [[nodiscard]] std::set<Voxel> all() const {
    std::set<Voxel> all;
    for (const auto& [number, block] : blocks) all.insert(block.begin(), block.end());
    return all;
  }
};

/// Clients that look now and then, each in steps of its own, and one that comes late: all draw the map.
TEST(VoxelLog, WhoeverFollowsItDrawsTheMap) {
  struct Ignore : Sink {
    void take(const LiveUpdate& /*update*/) override {}
  } ignore;
  SmallWorld world;
  VoxelLog log;
  std::mt19937 random(5);
  std::array<Drawn, 3> drawn;
  std::array<std::uint64_t, 3> known{};
  TouchedBlocks touched;
  const auto catch_up = [&](std::size_t i, std::size_t most) {
    while (known[i] != log.newest()) drawn[i].take(log.since(known[i], most));
  };
  for (int frame = 0; frame < 80; ++frame) {
    if (frame == 60) {
      world.begin_anew(ignore);
      touched.clear();
      log.begin_anew();
    }
    // A wall that goes, then others that come and go.
    const double any = 1.5 + 0.1 * static_cast<double>(random() % 30);
    world.give(ignore, frame < 10 ? 2 : frame < 40 ? 4.5 : any, {0.005 * frame, 0, 0});
    add_touched(world.mapped().change, touched);
    if (frame % 3 != 0) continue;
    log.update(world.view(), std::exchange(touched, {}));
    if (frame % 2 == 0) drawn[0].take(log.since(known[0], 50));  // never quite there
    if (frame % 9 == 0) {
      catch_up(1, 300);
      EXPECT_EQ(drawn[1].all(), occupied_of(*world.view())) << frame;
    }
  }
  log.update(world.view(), touched);
  const std::set<Voxel> truth = occupied_of(*world.view());
  EXPECT_GT(truth.size(), 200U);
  EXPECT_EQ(log.occupied(), truth.size());
  for (std::size_t i = 0; i < 3; ++i) {
    catch_up(i, 200);
    EXPECT_EQ(drawn[i].all(), truth) << i;
  }
}

TEST(VoxelLog, ABlockThatIsEmptyAgainIsTakenAway) {
  struct Ignore : Sink {
    void take(const LiveUpdate& /*update*/) override {}
  } ignore;
  SmallWorld wall, empty;
  wall.give(ignore, 3, {0, 0, 0});
  TouchedBlocks touched;
  add_touched(wall.mapped().change, touched);
  VoxelLog log;
  log.update(wall.view(), touched);
  Drawn drawn;
  std::uint64_t known = 0;
  drawn.take(log.since(known, 1'000'000));
  EXPECT_EQ(drawn.all(), occupied_of(*wall.view()));
  EXPECT_FALSE(drawn.all().empty());
  log.update(mapping::MapView::of(empty.map()), touched);
  drawn.take(log.since(known, 1'000'000));
  EXPECT_GT(drawn.removed, 0);
  EXPECT_TRUE(drawn.all().empty());
  EXPECT_EQ(log.occupied(), 0U);
  // Whoever comes now need not hear of it.
  std::uint64_t late = 0;
  EXPECT_EQ(log.since(late, 1'000'000).size(), 1U);
  EXPECT_EQ(late, log.newest());
}

TEST(VoxelLog, WhatStaysTheSameIsNotSentAgain) {
  struct Ignore : Sink {
    void take(const LiveUpdate& /*update*/) override {}
  } ignore;
  SmallWorld world;
  VoxelLog log;
  for (int i = 0; i < 20; ++i) {
    world.give(ignore, 3, {0, 0, 0});
    TouchedBlocks touched;
    add_touched(world.mapped().change, touched);
    EXPECT_FALSE(touched.empty());
    log.update(world.view(), touched);
  }
  const std::uint64_t settled = log.newest();
  for (int i = 0; i < 5; ++i) {
    world.give(ignore, 3, {0, 0, 0});
    TouchedBlocks touched;
    add_touched(world.mapped().change, touched);
    log.update(world.view(), touched);
  }
  EXPECT_EQ(log.newest(), settled);
}

TEST(Publisher, AClientThatIsSlowGetsTheNewestAndIsToldOfTheRest) {
  PublisherBed bed;
  Follower client;
  bed.world.give(bed.publisher, 3, {0, 0, 0});
  EXPECT_FALSE(client.next(bed.publisher, WebChannel::depth).fields.empty());
  EXPECT_TRUE(client.next(bed.publisher, WebChannel::depth).fields.empty());  // it has it
  bed.publisher.set_hungry(false);  // as while it is busy with a message
  for (int i = 0; i < 5; ++i) bed.world.give(bed.publisher, 3, {0.1 * i, 0, 0});
  EXPECT_TRUE(client.next(bed.publisher, WebChannel::depth).fields.empty()) << "images were kept for nobody";
  EXPECT_EQ(bed.publisher.missed(WebChannel::depth, client.cursor), 4U);  // the next may still be the fifth
  bed.publisher.set_hungry(true);
  bed.world.give(bed.publisher, 4, {1, 0, 0});
  const Decoded depth = client.next(bed.publisher, WebChannel::depth);
  EXPECT_EQ(reinterpret_cast<const float*>(depth["data"].text.data())[30 * 96 + 60], 4.0F);
  EXPECT_EQ(client.cursor.dropped, 5U);
  EXPECT_EQ(bed.publisher.missed(WebChannel::depth, client.cursor), 0U);
}

TEST(Publisher, AMapThatBeginsAnewIsForgottenByItsClients) {
  PublisherBed bed;
  Follower client;
  const auto voxels = [&] {
    bed.publisher.refresh({}, true);
    return client.next(bed.publisher, WebChannel::voxels);
  };
  bed.world.give(bed.publisher, 3, {0, 0, 0});
  bed.world.give(bed.publisher, 3, {0.2, 0, 0});
  const Decoded first = voxels();
  ASSERT_GT(first["markers"].list.size(), 1U);
  EXPECT_EQ(first["markers"].list[0]["action"].number, 3);  // DELETEALL
  EXPECT_EQ(first["markers"].list[1]["action"].number, 0);
  EXPECT_EQ(first["markers"].list[1]["type"].number, 6);  // CUBE_LIST
  bed.world.begin_anew(bed.publisher);
  const Decoded empty = voxels();
  ASSERT_EQ(empty["markers"].list.size(), 1U);
  EXPECT_EQ(empty["markers"].list[0]["action"].number, 3);
  EXPECT_TRUE(client.next(bed.publisher, WebChannel::path)["poses"].list.empty());
}

TEST(ThinnedPath, KeepsTheWholeWayInAThousandPoses) {
  ThinnedPath path;
  constexpr int kPoses = 100'000;
  for (int i = 0; i < kPoses; ++i) {
    Pose pose;
    pose.translation.x() = 0.03 * i;
    path.add({Time{i}, pose});
  }
  ASSERT_GT(path.poses().size(), 400U);
  EXPECT_LE(path.poses().size(), 1000U);
  EXPECT_EQ(path.poses().front().time.nanoseconds, 0);
  EXPECT_GT(path.poses().back().pose.translation.x(), 0.03 * kPoses - 15);
}

TEST(Pictures, ColoursSayHowNearAndHowCertain) {
  const cv::Mat image(8, 8, CV_8UC1, cv::Scalar(100));
  cv::Mat depth(8, 8, CV_32FC1, cv::Scalar(10));
  cv::Mat variance(8, 8, CV_32FC1, cv::Scalar(0.01));
  depth.at<float>(0, 0) = 2.9F;
  depth.at<float>(0, 1) = 5.9F;
  depth.at<float>(0, 2) = NAN;
  depth.at<float>(0, 3) = 2;
  variance.at<float>(0, 3) = 1;  // half of it: nobody knows
  const cv::Mat seen = obstacle_picture(image, depth, variance);
  const auto red = seen.at<cv::Vec3b>(0, 0), yellow = seen.at<cv::Vec3b>(0, 1);
  EXPECT_GT(red[2], red[1] + 60);
  EXPECT_GT(std::min(yellow[1], yellow[2]), yellow[0] + 60);
  for (const cv::Point plain : {cv::Point(2, 0), cv::Point(3, 0), cv::Point(4, 4)})
    EXPECT_EQ(seen.at<cv::Vec3b>(plain), cv::Vec3b(100, 100, 100)) << plain;
  const cv::Mat picture = depth_picture(depth, variance, {16, 16});
  EXPECT_EQ(picture.at<cv::Vec3b>(0, 4), picture.at<cv::Vec3b>(0, 6));  // no depth, and too uncertain a one
  EXPECT_NE(picture.at<cv::Vec3b>(0, 0), picture.at<cv::Vec3b>(0, 4));
  EXPECT_EQ(small_picture(cv::Mat(960, 1280, CV_8UC3)).size(), cv::Size(640, 480));
  EXPECT_EQ(small_picture(picture).size(), picture.size());
}

}  // namespace
}  // namespace pade::live

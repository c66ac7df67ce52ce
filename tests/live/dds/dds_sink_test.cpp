// What a session publishes, to subscribers of every kind.
#include "pade/live/dds/dds_sink.hpp"

#include <atomic>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pade/io/formats/map_files.hpp"
#include "pade/io/recording/messages/messages.hpp"

#include "live/dds/fake_network.hpp"
#include "live/web/small_world.hpp"

namespace pade::live {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
constexpr auto kSinkTestCdr = io::MessageEncoding::cdr;

std::string data_of(const std::string& file) {
  const std::size_t at = file.find("\ndata\n");
  return file.substr(at + 6);
}

/// octomap_msgs/Octomap.
struct OctomapMessage {
  io::MessageHeader header;
  bool binary = false;
  std::string id, data;
  double voxel = 0;
  bool failed = false;
};
OctomapMessage read_octomap(const std::string& bytes) {
  io::MessageReader reader(bytes, kSinkTestCdr);
  OctomapMessage message;
  message.header.stamp = reader.stamp();
  message.header.frame = reader.text();
  message.binary = reader.number<std::uint8_t>() != 0;
  message.id = reader.text();
  message.voxel = reader.number<double>();
  message.data = reader.bytes();
  message.failed = reader.failed() || reader.left() > 0;
  return message;
}

class DdsSinkTest : public testing::Test {
 protected:
  void start() {
    options_.map_period = 0.1;
    auto sink =
        DdsSink::start(network_, shared_, options_,
                       {world_.camera(), forward_mounting(), {}, states_body_, states_camera_}, healthy);
    ASSERT_TRUE(sink.ok());
    sink_ = std::move(*sink);
  }
  FakeNetwork network_;
  FakeTopics& topics_ = network_.topics;
  DdsOptions options_;
  DdsShared shared_{options_};
  SmallWorld world_;
  bool states_body_ = true, states_camera_ = true;
  std::unique_ptr<DdsSink> sink_;  // last: it uses the others
};

TEST_F(DdsSinkTest, TheMapIsThatOfItsFileAndComesOnlyWhenItHasChanged) {
  topics_.subscribe("/octomap_binary", 1);
  topics_.subscribe("/octomap_full", 1);
  start();
  EXPECT_EQ(topics_.qualities["/octomap_binary"], TopicQuality::latched);
  EXPECT_EQ(topics_.types["/octomap_full"], "octomap_msgs/Octomap");
  EXPECT_EQ(topics_.qualities["/pade/cloud"], TopicQuality::sensor);
  world_.give(*sink_, 3, {0, 0, 1});
  ASSERT_TRUE(topics_.await_count("/octomap_binary", 1));
  ASSERT_TRUE(topics_.await_count("/octomap_full", 1));
  const OctomapMessage binary = read_octomap(topics_.of("/octomap_binary").back());
  EXPECT_FALSE(binary.failed);
  EXPECT_TRUE(binary.binary);
  EXPECT_EQ(binary.id, "OcTree");
  EXPECT_EQ(binary.voxel, world_.view()->voxel());
  EXPECT_EQ(binary.header.frame, "map");
  EXPECT_EQ(binary.data, data_of(io::bytes_of(io::encode_map(world_.map(), io::MapFormat::bt))));
  EXPECT_EQ(read_octomap(topics_.of("/octomap_full").back()).data,
            data_of(io::bytes_of(io::encode_map(*world_.view(), io::MapFormat::ot))));
  // Health comes four times a second: after two of it the map would have come again.
  topics_.subscribe("/diagnostics", 1);
  ASSERT_TRUE(topics_.await_count("/diagnostics", 2));
  EXPECT_EQ(topics_.of("/octomap_binary").size(), 1U);
  world_.give(*sink_, 2, {0, 0, 1});
  ASSERT_TRUE(topics_.await_count("/octomap_binary", 2));
  world_.begin_anew(*sink_);
  ASSERT_TRUE(topics_.await_count("/octomap_binary", 3));
  EXPECT_THAT(read_octomap(topics_.of("/octomap_binary").back()).data, IsEmpty()) << "the map is empty again";
}

TEST_F(DdsSinkTest, WhoComesLateGetsTheMapThoughNothingChangesAnyMore) {
  start();
  world_.give(*sink_, 3, {0, 0, 1});
  topics_.subscribe("/diagnostics", 1);
  ASSERT_TRUE(topics_.await_count("/diagnostics", 2));
  EXPECT_THAT(topics_.of("/octomap_binary"), IsEmpty()) << "what nobody wants is not made";
  topics_.subscribe("/octomap_binary", 1);
  topics_.subscribe("/octomap_point_cloud_centers", 1);
  ASSERT_TRUE(topics_.await_count("/octomap_binary", 1));
  ASSERT_TRUE(topics_.await_count("/octomap_point_cloud_centers", 1));
  const std::size_t points = 16 * world_.map().counts().occupied;
  EXPECT_GE(topics_.of("/octomap_point_cloud_centers").back().size(), points);
  EXPECT_LT(topics_.of("/octomap_point_cloud_centers").back().size(), points + 300);
}

TEST_F(DdsSinkTest, FramesHaveTheStampsAndNamesOfThoseThatCame) {
  shared_.names.set_world("odom");
  shared_.names.set_camera("front_optical");
  for (const char* const topic : {"/pade/depth", "/pade/cloud", "/pade/path", "/tf"})
    topics_.subscribe(topic, 1);
  start();
  // The first frame may come before anybody is known to be hungry.
  std::size_t frames = 0;
  ASSERT_TRUE([&] {
    while (topics_.of("/pade/depth").empty() && frames++ < 1000) {
      world_.give(*sink_, 3, {0.2 * static_cast<double>(frames), 0, 1});
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    return !topics_.of("/pade/depth").empty();
  }());
  ASSERT_TRUE(topics_.await_count("/pade/cloud", 1));
  ASSERT_TRUE(topics_.await_count("/tf", 1));
  const auto depth = io::read_image_message(topics_.of("/pade/depth").back(), kSinkTestCdr);
  ASSERT_TRUE(depth.ok());
  EXPECT_EQ(depth->header.frame, "front_optical");
  EXPECT_EQ(depth->encoding, "32FC1");
  EXPECT_NEAR(static_cast<double>(depth->header.stamp.nanoseconds) * 1e-9,
              static_cast<double>(std::chrono::system_clock::now().time_since_epoch().count()) * 1e-9, 60)
      << "since 1970";
  const auto cloud = io::read_header(topics_.of("/pade/cloud").back(), kSinkTestCdr);
  EXPECT_EQ(cloud->frame, "odom");
  const auto transforms = io::read_transforms(topics_.of("/tf").back(), kSinkTestCdr);
  ASSERT_TRUE(transforms.ok());
  ASSERT_EQ(transforms->size(), 2U);
  EXPECT_EQ((*transforms)[0].header.frame, "odom");
  EXPECT_EQ((*transforms)[1].child, "front_optical");
}

TEST_F(DdsSinkTest, SaysNothingOfFramesThatOthersSpeakOf) {
  states_body_ = states_camera_ = false;
  shared_.names.set_world("odom");
  for (const char* const topic : {"/tf", "/octomap_binary", "/octomap_point_cloud_centers", "/pade/path"})
    topics_.subscribe(topic, 1);
  start();
  world_.give(*sink_, 3, {0, 0, 1});
  ASSERT_TRUE(topics_.await_count("/octomap_binary", 1));
  EXPECT_THAT(topics_.of("/tf"), IsEmpty());
  // But where the map is that has an origin of its own, nobody else can say.
  world_.begin_anew(*sink_);
  world_.origin = {500'000, -3, 7};
  world_.give(*sink_, 3, {0, 0, 1});
  ASSERT_TRUE(topics_.await_count("/tf", 1));
  const auto transforms = io::read_transforms(topics_.of("/tf").back(), kSinkTestCdr);
  ASSERT_TRUE(transforms.ok());
  ASSERT_EQ(transforms->size(), 1U);
  EXPECT_EQ((*transforms)[0].header.frame, "odom");
  EXPECT_EQ((*transforms)[0].child, "pade_map");
  EXPECT_EQ((*transforms)[0].position, world_.origin);
  for (const char* const topic : {"/octomap_binary", "/octomap_point_cloud_centers", "/pade/path"}) {
    for (int i = 0; i < 1000; ++i) {
      const auto header = io::read_header(topics_.of(topic).back(), kSinkTestCdr);
      ASSERT_TRUE(header);
      if (header->frame == "pade_map") break;
      ASSERT_LT(i, 999) << topic << " stays in " << header->frame;
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  }
}

TEST_F(DdsSinkTest, WhatAFrameThatWasLeftOutMadeTheMapForgetIsPublished) {
  topics_.subscribe("/octomap_binary", 1);
  start();
  world_.give(*sink_, 3, {0, 0, 1});
  ASSERT_TRUE(topics_.await_count("/octomap_binary", 1));
  world_.forget(*sink_);
  ASSERT_TRUE(topics_.await_count("/octomap_binary", 2));
  EXPECT_EQ(read_octomap(topics_.of("/octomap_binary").back()).data,
            data_of(io::bytes_of(io::encode_map(world_.map(), io::MapFormat::bt))));
  EXPECT_NE(topics_.of("/octomap_binary").back(), topics_.of("/octomap_binary").front());
}

TEST_F(DdsSinkTest, TopicsOfANamespaceAreItsOwnButForThoseThatAllShare) {
  options_.name_space = "uav1";
  start();
  EXPECT_TRUE(topics_.types.contains("/uav1/octomap_binary"));
  EXPECT_TRUE(topics_.types.contains("/uav1/pade/cloud"));
  EXPECT_TRUE(topics_.types.contains("/tf"));
  EXPECT_TRUE(topics_.types.contains("/diagnostics"));
}

TEST_F(DdsSinkTest, ASubscriberThatTakesNothingCostsTheMapperNothing) {
  std::mutex block;
  std::atomic<int> stuck{0};
  topics_.on_write = [&] {
    ++stuck;
    const std::lock_guard wait(block);
  };
  topics_.subscribe("/octomap_binary", 1);
  topics_.subscribe("/pade/cloud", 1);
  topics_.subscribe("/diagnostics", 1);
  block.lock();
  start();
  for (int i = 0; i < 5'000 && stuck == 0; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(2));
  ASSERT_GT(stuck, 0) << "the thread never wrote";
  // The thread stands in a write for as long as these are given: were one of them to wait for it, this would
  // never end.
  for (int i = 0; i < 50; ++i) {
    world_.give(*sink_, 3, {0.1 * i, 0, 1});
    sink_->take_sectors({}, now_of_ours());
    sink_->take_counts({});
    (void)sink_->text();
  }
  EXPECT_EQ(stuck, 1);
  block.unlock();
  ASSERT_TRUE(topics_.await_count("/octomap_binary", 1)) << "it goes on with the newest";
  EXPECT_EQ(read_octomap(topics_.of("/octomap_binary").back()).data,
            data_of(io::bytes_of(io::encode_map(world_.map(), io::MapFormat::bt))));
}

TEST_F(DdsSinkTest, TheLogSaysWhoAsksForWhatIsNotOffered) {
  topics_.subscribe("/diagnostics", 1);
  start();
  ASSERT_TRUE(topics_.await_count("/diagnostics", 1));
  EXPECT_THAT(sink_->text(), HasSubstr("/pade/cloud: a subscriber asks for another RELIABILITY"));
  EXPECT_THAT(sink_->text(), HasSubstr("1 subscriptions"));
}

}  // namespace
}  // namespace pade::live

// Topics over DDS itself, between two participants of this process. Another make is asked by scripts/dds.
#include "pade/live/dds/network.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "pade/live/camera/folder_source.hpp"

namespace pade::live {
namespace {

using testing::HasSubstr;

/// Each process has a domain of its own, so that tests that run side by side do not meet.
DdsOptions own_domain() {
  DdsOptions options;
  options.domain = 20 + static_cast<int>(::getpid() % 80);  // the ports lie below those of others
  options.localhost = true;
  return options;
}

class DdsNetworkTest : public testing::Test {
 protected:
  void SetUp() override {
    auto network = DdsNetwork::open(own_domain());
    if (!network && network.error().message.find("without CycloneDDS") != std::string::npos)
      GTEST_SKIP() << network.error().message;
    ASSERT_TRUE(network.ok()) << network.error().message;
    ours_ = std::move(*network);
    theirs_ = DdsNetwork::open(own_domain()).value();
  }
  static bool await(const std::function<bool()>& ready) {
    const Time begun = now_of_ours();
    while (!ready()) {
      if (seconds_between(begun, now_of_ours()) > 20) return false;
      ::usleep(5'000);
    }
    return true;
  }
  std::unique_ptr<DdsNetwork> ours_, theirs_;
};

TEST_F(DdsNetworkTest, MessagesOfEverySizeComeAsTheyWere) {
  const auto writer = ours_->writer("/t", "std_msgs/String", TopicQuality::stream).value();
  const auto reader = theirs_->reader("/t", "std_msgs/String", 200).value();
  ASSERT_TRUE(await([&] { return writer->subscribers() == 1; }));
  EXPECT_EQ(reader->remark(), "");
  for (const std::size_t size :
       {std::size_t{4}, std::size_t{5}, std::size_t{6}, std::size_t{7}, std::size_t{1'000'003}}) {
    std::string message(size, '\0');
    for (std::size_t i = 4; i < size; ++i) message[i] = static_cast<char>(31 * i);
    message[1] = 1;
    ASSERT_TRUE(writer->write(message));
    std::string come;
    ASSERT_TRUE(await([&] { return reader->take(come); })) << size;
    come.resize(std::min(come.size(), size));
    message[3] = come[3];  // says how many bytes were filled up
    EXPECT_TRUE(come == message) << size;
  }
}

TEST_F(DdsNetworkTest, ReadersTakeALatchedTopicFromNowOn) {
  const auto writer = ours_->writer("/m", "octomap_msgs/Octomap", TopicQuality::latched).value();
  for (const char last : {'a', 'b', 'c'})
    ASSERT_TRUE(writer->write(std::string({0, 1, 0, 0, last, 0, 0, 0})));
  const auto reader = theirs_->reader("/m", "octomap_msgs/Octomap", 5).value();
  ASSERT_TRUE(await([&] { return writer->subscribers() == 1; }));
  ASSERT_TRUE(writer->write(std::string({0, 1, 0, 0, 'd', 0, 0, 0})));
  std::string come;
  ASSERT_TRUE(await([&] { return reader->take(come); }));
  EXPECT_EQ(come[4], 'd');
}

TEST_F(DdsNetworkTest, SaysThatNobodyPublishesOrSomethingElse) {
  const auto reader = ours_->reader("/camera/image_raw", "sensor_msgs/Image", 5).value();
  EXPECT_THAT(reader->remark(), HasSubstr("nobody publishes /camera/image_raw in domain"));
  const auto writer =
      theirs_->writer("/camera/image_raw", "sensor_msgs/CompressedImage", TopicQuality::sensor).value();
  EXPECT_TRUE(await([&] {
    return reader->remark() ==
           "/camera/image_raw is published as sensor_msgs/CompressedImage, expected sensor_msgs/Image";
  })) << reader->remark();
}

}  // namespace
}  // namespace pade::live

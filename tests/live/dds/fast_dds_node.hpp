// A node of ROS 2 as Fast DDS makes one, with messages that fastcdr writes and reads. Nothing of ours is
// used: what a message is, is said here once more.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/DataWriterListener.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <opencv2/core.hpp>

namespace peer {

namespace dds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;
using eprosima::fastcdr::Cdr;
using eprosima::fastcdr::FastBuffer;
using Bytes = std::vector<char>;

/// A message as fastcdr wrote it, with its encapsulation.
class AnyMessage : public dds::TopicDataType {
 public:
  explicit AnyMessage(const char* name) {
    setName(name);
    m_typeSize = 1U << 16;
    m_isGetKeyDefined = false;
  }
  bool serialize(void* data, rtps::SerializedPayload_t* payload) override {
    const Bytes& bytes = *static_cast<Bytes*>(data);
    if (payload->max_size < bytes.size()) return false;
    std::memcpy(payload->data, bytes.data(), bytes.size());
    payload->length = static_cast<std::uint32_t>(bytes.size());
    payload->encapsulation = CDR_LE;
    return true;
  }
  bool deserialize(rtps::SerializedPayload_t* payload, void* data) override {
    const auto* const start = reinterpret_cast<const char*>(payload->data);
    static_cast<Bytes*>(data)->assign(start, start + payload->length);
    return true;
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) override {
    return [data] { return static_cast<std::uint32_t>(static_cast<Bytes*>(data)->size()); };
  }
  void* createData() override { return new Bytes; }
  void deleteData(void* data) override { delete static_cast<Bytes*>(data); }
  bool getKey(void* /*data*/, rtps::InstanceHandle_t* /*handle*/, bool /*md5*/) override { return false; }
};

struct Header {
  std::int64_t stamp = 0;  // ns
  std::string frame;
};

/// Writes a message.
class Out {
 public:
  explicit Out(std::size_t most = 1 << 16)
      : store_(most),
        buffer_(store_.data(), store_.size()),
        cdr_(buffer_, Cdr::LITTLE_ENDIANNESS, Cdr::DDS_CDR) {
    cdr_.serialize_encapsulation();
  }
  template <class Value>
  Out& operator<<(const Value& value) {
    cdr_ << value;
    return *this;
  }
  Out& operator<<(const Header& header) {
    cdr_ << static_cast<std::int32_t>(header.stamp / 1'000'000'000)
         << static_cast<std::uint32_t>(header.stamp % 1'000'000'000) << header.frame;
    return *this;
  }
  Bytes take() {
    store_.resize(cdr_.getSerializedDataLength());
    return store_;
  }

 private:
  Bytes store_;
  FastBuffer buffer_;
  Cdr cdr_;
};

/// Reads one.
class In {
 public:
  explicit In(Bytes bytes)
      : store_(std::move(bytes)),
        buffer_(store_.data(), store_.size()),
        cdr_(buffer_, Cdr::LITTLE_ENDIANNESS, Cdr::DDS_CDR) {
    cdr_.read_encapsulation();
  }
  template <class Value>
  In& operator>>(Value& value) {
    cdr_ >> value;
    return *this;
  }
  In& operator>>(Header& header) {
    std::int32_t seconds = 0;
    std::uint32_t rest = 0;
    cdr_ >> seconds >> rest >> header.frame;
    header.stamp = seconds * std::int64_t{1'000'000'000} + rest;
    return *this;
  }

 private:
  Bytes store_;
  FastBuffer buffer_;
  Cdr cdr_;
};

inline std::int64_t now_since_1970() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

/// A participant that keeps to this machine.
class Node {
 public:
  explicit Node(int domain) {
    dds::DomainParticipantQos qos;
    qos.transport().use_builtin_transports = false;
    auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
    udp->interfaceWhiteList.push_back("127.0.0.1");
    udp->sendBufferSize = udp->receiveBufferSize = 4 << 20;
    qos.transport().user_transports.push_back(udp);
    rtps::Locator_t loopback;
    rtps::IPLocator::setIPv4(loopback, 127, 0, 0, 1);
    qos.wire_protocol().builtin.initialPeersList.push_back(loopback);
    participant_ = dds::DomainParticipantFactory::get_instance()->create_participant(
        static_cast<std::uint32_t>(domain), qos);
    if (participant_ == nullptr) std::exit(3);
    publisher_ = participant_->create_publisher(dds::PUBLISHER_QOS_DEFAULT);
    subscriber_ = participant_->create_subscriber(dds::SUBSCRIBER_QOS_DEFAULT);
  }
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;
  ~Node() {
    participant_->delete_contained_entities();
    dds::DomainParticipantFactory::get_instance()->delete_participant(participant_);
  }

  dds::DataWriter* writer(const std::string& topic, const char* type, bool reliable) {
    dds::DataWriterQos qos;
    qos.reliability().kind = reliable ? dds::RELIABLE_RELIABILITY_QOS : dds::BEST_EFFORT_RELIABILITY_QOS;
    qos.history().kind = dds::KEEP_LAST_HISTORY_QOS;
    qos.history().depth = 10;
    qos.endpoint().history_memory_policy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    qos.publish_mode().kind = dds::ASYNCHRONOUS_PUBLISH_MODE;
    return publisher_->create_datawriter(of(topic, type), qos);
  }

  using Take = std::function<void(Bytes)>;
  dds::DataReader* reader(const std::string& topic, const char* type, bool reliable, bool latched,
                          Take take) {
    dds::DataReaderQos qos;
    qos.reliability().kind = reliable ? dds::RELIABLE_RELIABILITY_QOS : dds::BEST_EFFORT_RELIABILITY_QOS;
    qos.durability().kind = latched ? dds::TRANSIENT_LOCAL_DURABILITY_QOS : dds::VOLATILE_DURABILITY_QOS;
    qos.history().kind = dds::KEEP_LAST_HISTORY_QOS;
    qos.history().depth = latched ? 1 : 20;
    qos.endpoint().history_memory_policy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    listeners_.push_back(std::make_unique<Listener>(topic, std::move(take)));
    return subscriber_->create_datareader(of(topic, type), qos, listeners_.back().get());
  }

 private:
  class Listener : public dds::DataReaderListener {
   public:
    Listener(std::string topic, Take take) : topic_(std::move(topic)), take_(std::move(take)) {}
    void on_data_available(dds::DataReader* reader) override {
      Bytes bytes;
      dds::SampleInfo info;
      while (reader->take_next_sample(&bytes, &info) == ReturnCode_t::RETCODE_OK)
        if (info.valid_data) take_(std::move(bytes));
    }
    void on_requested_incompatible_qos(dds::DataReader* /*reader*/,
                                       const dds::RequestedIncompatibleQosStatus& status) override {
      std::cout << "incompatible " << topic_ << " " << status.last_policy_id << std::endl;
    }

   private:
    std::string topic_;
    Take take_;
  };

  dds::Topic* of(const std::string& topic, const char* type) {
    const std::string name = "rt" + topic;
    if (auto* const known = dynamic_cast<dds::Topic*>(participant_->lookup_topicdescription(name)))
      return known;
    dds::TypeSupport support(new AnyMessage(type));
    support.register_type(participant_);
    return participant_->create_topic(name, type, dds::TOPIC_QOS_DEFAULT);
  }

  dds::DomainParticipant* participant_ = nullptr;
  dds::Publisher* publisher_ = nullptr;
  dds::Subscriber* subscriber_ = nullptr;
  std::vector<std::unique_ptr<Listener>> listeners_;
};

constexpr const char* kImage = "sensor_msgs::msg::dds_::Image_";
constexpr const char* kCompressed = "sensor_msgs::msg::dds_::CompressedImage_";
constexpr const char* kInfo = "sensor_msgs::msg::dds_::CameraInfo_";
constexpr const char* kOdometry = "nav_msgs::msg::dds_::Odometry_";
constexpr const char* kCloud = "sensor_msgs::msg::dds_::PointCloud2_";
constexpr const char* kOctomap = "octomap_msgs::msg::dds_::Octomap_";
constexpr const char* kPath = "nav_msgs::msg::dds_::Path_";
constexpr const char* kHealth = "diagnostic_msgs::msg::dds_::DiagnosticArray_";

inline Bytes image_message(const Header& header, const cv::Mat& image, const std::string& encoding) {
  const std::size_t size = image.total() * image.elemSize();
  std::vector<std::uint8_t> data(image.data, image.data + size);
  Out out(size + 4096);
  out << header << static_cast<std::uint32_t>(image.rows) << static_cast<std::uint32_t>(image.cols)
      << encoding << std::uint8_t{0}
      << static_cast<std::uint32_t>(image.cols * static_cast<int>(image.elemSize())) << data;
  return out.take();
}

inline Bytes compressed_message(const Header& header, const std::vector<std::uint8_t>& file) {
  Out out(file.size() + 4096);
  out << header << std::string("mono8; png compressed ") << file;
  return out.take();
}

inline Bytes odometry_message(const Header& header, const std::string& child,
                              const std::array<double, 7>& pose) {
  Out out;
  out << header << child;
  for (const double value : pose) out << value;
  out << std::array<double, 36>{};
  for (int i = 0; i < 6; ++i) out << 0.0;
  out << std::array<double, 36>{};
  return out.take();
}

inline Bytes info_message(const Header& header, int width, int height, double fx, double fy, double cx,
                          double cy) {
  Out out;
  out << header << static_cast<std::uint32_t>(height) << static_cast<std::uint32_t>(width)
      << std::string("plumb_bob") << std::vector<double>{0, 0, 0, 0, 0}
      << std::array<double, 9>{fx, 0, cx, 0, fy, cy, 0, 0, 1}
      << std::array<double, 9>{1, 0, 0, 0, 1, 0, 0, 0, 1}
      << std::array<double, 12>{fx, 0, cx, 0, 0, fy, cy, 0, 0, 0, 1, 0};
  for (int i = 0; i < 6; ++i) out << std::uint32_t{0};
  out << std::uint8_t{0};
  return out.take();
}

}  // namespace peer

// Topics of ROS 2 on a network of DDS: messages as CDR in and out, without ROS.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "pade/core/result.hpp"
#include "pade/live/dds/dds_options.hpp"

namespace pade::live {

/// How messages of a topic are sent and kept, as ROS 2 does it.
enum class TopicQuality : std::uint8_t {
  sensor,   ///< best effort, the last 5, nothing for who comes later
  latched,  ///< reliable, the last one, also for who comes later
  stream,   ///< reliable, the last 100, nothing for who comes later
};

/// What became of a topic's messages so far.
struct TopicReport {
  std::size_t peers = 0;   ///< publishers, or subscribers, at the moment
  std::size_t count = 0;   ///< messages that came, or were sent
  std::size_t failed = 0;  ///< that could not be sent
  std::string mismatch;    ///< "a subscriber asks for another RELIABILITY"; empty: none
};

/// Messages of a topic. One thread.
class TopicReader {
 public:
  TopicReader() = default;
  TopicReader(const TopicReader&) = delete;
  TopicReader& operator=(const TopicReader&) = delete;
  virtual ~TopicReader() = default;

  /// The next message, with the four bytes before it; false: there is none.
  virtual bool take(std::string& message) = 0;
  /// Waits until there is one, at most so long, ms.
  virtual void wait(int milliseconds) = 0;
  /// Why nothing comes, where that is known: nobody publishes the topic, or as another type. Empty: somebody
  /// does.
  [[nodiscard]] virtual std::string remark() = 0;
  [[nodiscard]] virtual TopicReport report() = 0;
};

/// One thread.
class TopicWriter {
 public:
  TopicWriter() = default;
  TopicWriter(const TopicWriter&) = delete;
  TopicWriter& operator=(const TopicWriter&) = delete;
  virtual ~TopicWriter() = default;

  /// False: it could not be sent. Where a reliable subscriber does not take what it was sent, this waits for
  /// it up to 0.1 s.
  virtual bool write(std::string_view message) = 0;
  /// Subscribers at the moment.
  [[nodiscard]] virtual std::size_t subscribers() = 0;
  [[nodiscard]] virtual TopicReport report() = 0;
};

/// A participant in a domain. Any thread; must outlive its readers and writers.
class DdsNetwork {
 public:
  /// Errors: the program was built without CycloneDDS; there is no such network.
  /// @param options  that check() accepts
  static Result<std::unique_ptr<DdsNetwork>> open(const DdsOptions& options);
  DdsNetwork() = default;
  DdsNetwork(const DdsNetwork&) = delete;
  DdsNetwork& operator=(const DdsNetwork&) = delete;
  virtual ~DdsNetwork() = default;

  [[nodiscard]] virtual int domain() const = 0;
  /// @{
  /// @param topic  as in ROS: "/camera/image_raw"
  /// @param type   as in ROS: "sensor_msgs/Image"
  virtual Result<std::unique_ptr<TopicWriter>> writer(const std::string& topic, std::string_view type,
                                                      TopicQuality quality) = 0;
  /// Takes from publishers of every quality.
  /// @param kept  messages that wait to be taken; of more the oldest go
  virtual Result<std::unique_ptr<TopicReader>> reader(const std::string& topic, std::string_view type,
                                                      int kept) = 0;
  /// @}
};

/// "sensor_msgs::msg::dds_::Image_" of "sensor_msgs/Image".
std::string dds_type_name(std::string_view type);
/// The other way round; a name that is not of ROS as it is.
std::string ros_type_name(std::string_view dds_name);

}  // namespace pade::live

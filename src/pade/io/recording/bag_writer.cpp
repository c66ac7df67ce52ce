// rosbag 2.0, uncompressed: images in it are compressed already.
#include <map>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "pade/io/recording/messages/message_definitions.hpp"
#include "pade/io/recording/recording_writer.hpp"

namespace pade::io {
namespace {

constexpr std::string_view kMagic = "#ROSBAG V2.0\n";
constexpr std::size_t kHeaderRecord = 4096;  // bytes, filled up with blanks
constexpr std::size_t kChunkBytes = 768 * 1024;

template <class Number>
std::string bytes_of_number(Number value) {
  return {reinterpret_cast<const char*>(&value), sizeof(value)};
}

std::string field(std::string_view name, std::string_view value) {
  return fmt::format("{}{}={}", bytes_of_number(static_cast<std::uint32_t>(name.size() + 1 + value.size())),
                     name, value);
}

std::string counted(std::string_view bytes) {
  return bytes_of_number(static_cast<std::uint32_t>(bytes.size())).append(bytes);
}

std::string operation(std::uint8_t number) { return field("op", bytes_of_number(number)); }

std::string bytes_of_time(Time time) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  return bytes_of_number(static_cast<std::uint32_t>(time.nanoseconds / kSecond)) +
         bytes_of_number(static_cast<std::uint32_t>(time.nanoseconds % kSecond));
}

class BagWriter : public RecordingWriter {
 public:
  explicit BagWriter(PartialFile file) : file_(std::move(file)) {
    file_.append(kMagic);
    file_.append(header_record(0, 0, 0));
  }

  [[nodiscard]] MessageEncoding encoding() const override { return MessageEncoding::ros1; }

  Status write(std::string_view topic, std::string_view type, Time measured,
               std::string_view message) override {
    // rosbag plays nothing that was recorded at 0, which stands for no time.
    const Time time = std::max(measured, Time{1});
    const auto [known, added] = connections_.try_emplace(std::string(topic));
    Connection& connection = known->second;
    if (added) {
      connection.number = static_cast<std::uint32_t>(connections_.size() - 1);
      connection.record = connection_record(connection.number, topic, type);
      chunk_ += connection.record;
    }
    if (messages_ == 0) first_ = last_ = time;
    first_ = std::min(first_, time);
    last_ = std::max(last_, time);
    ++messages_;
    connection.places.emplace_back(time, static_cast<std::uint32_t>(chunk_.size()));
    chunk_ += counted(operation(0x02) + field("conn", bytes_of_number(connection.number)) +
                      field("time", bytes_of_time(time)));
    chunk_ += counted(message);
    return chunk_.size() < kChunkBytes ? Status() : end_chunk();
  }

  Status flush() override {
    if (Status status = end_chunk(); !status) return status;
    return file_.flush();
  }

  Status finish() override {
    if (Status status = end_chunk(); !status) return status;
    const std::uint64_t index = file_.size();
    for (const auto& [topic, connection] : connections_) file_.append(connection.record);
    for (const std::string& info : infos_) file_.append(info);
    file_.overwrite(kMagic.size(), header_record(index, connections_.size(), infos_.size()));
    return file_.commit();
  }

 private:
  struct Connection {
    std::uint32_t number = 0;
    std::string record;
    std::vector<std::pair<Time, std::uint32_t>> places;  ///< of its messages in the chunk
  };

  static std::string header_record(std::uint64_t index, std::size_t connections, std::size_t chunks) {
    std::string record =
        counted(operation(0x03) + field("index_pos", bytes_of_number(index)) +
                field("conn_count", bytes_of_number(static_cast<std::uint32_t>(connections))) +
                field("chunk_count", bytes_of_number(static_cast<std::uint32_t>(chunks))));
    return record + counted(std::string(kHeaderRecord - record.size() - 4, ' '));
  }

  static std::string connection_record(std::uint32_t number, std::string_view topic, std::string_view type) {
    return counted(operation(0x07) + field("conn", bytes_of_number(number)) + field("topic", topic)) +
           counted(field("topic", topic) + field("type", type) + field("md5sum", message_md5(type)) +
                   field("message_definition", message_definition(type, MessageEncoding::ros1)));
  }

  Status end_chunk() {
    if (messages_ == 0) return {};
    const std::uint64_t place = file_.size();
    const auto size = static_cast<std::uint32_t>(chunk_.size());
    file_.append(
        counted(operation(0x05) + field("compression", "none") + field("size", bytes_of_number(size))));
    file_.append(counted(chunk_));
    std::string counts;
    std::uint32_t used = 0;
    for (auto& [topic, connection] : connections_) {
      if (connection.places.empty()) continue;
      ++used;
      const auto count = static_cast<std::uint32_t>(connection.places.size());
      counts += bytes_of_number(connection.number) + bytes_of_number(count);
      file_.append(counted(operation(0x04) + field("ver", bytes_of_number(std::uint32_t{1})) +
                           field("conn", bytes_of_number(connection.number)) +
                           field("count", bytes_of_number(count))));
      std::string index;
      for (const auto& [time, offset] : connection.places)
        index += bytes_of_time(time) + bytes_of_number(offset);
      file_.append(counted(index));
      connection.places.clear();
    }
    infos_.push_back(
        counted(operation(0x06) + field("ver", bytes_of_number(std::uint32_t{1})) +
                field("chunk_pos", bytes_of_number(place)) + field("start_time", bytes_of_time(first_)) +
                field("end_time", bytes_of_time(last_)) + field("count", bytes_of_number(used))) +
        counted(counts));
    chunk_.clear();
    messages_ = 0;
    return file_.flush();
  }

  PartialFile file_;
  std::map<std::string, Connection> connections_;  // by topic
  std::vector<std::string> infos_;                 // records of the index, one per chunk
  std::string chunk_;
  Time first_, last_;         // of the chunk
  std::size_t messages_ = 0;  // of the chunk
};

}  // namespace

std::unique_ptr<RecordingWriter> bag_writer(PartialFile file) {
  return std::make_unique<BagWriter>(std::move(file));
}

}  // namespace pade::io

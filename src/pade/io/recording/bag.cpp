// rosbag 2.0 (http://wiki.ros.org/Bags/Format/2.0): records of a header and data; messages in chunks.
#include <algorithm>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "pade/io/recording/block_file.hpp"
#include "pade/io/recording/byte_reader.hpp"
#include "pade/io/text.hpp"

namespace pade::io {
namespace {

constexpr std::string_view kMagic = "#ROSBAG V2.0\n";
constexpr std::uint32_t kLongestHeader = 1U << 20;

enum Operation : std::uint8_t {
  kMessage = 0x02,
  kBagHeader = 0x03,
  kIndexData = 0x04,
  kChunk = 0x05,
  kChunkInfo = 0x06,
  kConnection = 0x07,
};

using Fields = std::map<std::string, std::string_view, std::less<>>;

/// The name=value pairs of a header; empty where they are none.
std::optional<Fields> fields_of(std::string_view header) {
  Fields fields;
  ByteReader reader(header);
  while (reader.left() > 0) {
    const std::string_view field = reader.counted();
    const std::size_t equals = field.find('=');
    if (reader.failed() || equals == std::string_view::npos) return std::nullopt;
    fields.emplace(field.substr(0, equals), field.substr(equals + 1));
  }
  return fields;
}

std::string_view text_of(const Fields& fields, std::string_view name) {
  const auto found = fields.find(name);
  return found == fields.end() ? std::string_view() : found->second;
}

/// Empty where the field is missing or of another size.
template <class Number>
std::optional<Number> number_of(const Fields& fields, std::string_view name) {
  const std::string_view bytes = text_of(fields, name);
  if (bytes.size() != sizeof(Number)) return std::nullopt;
  return ByteReader(bytes).number<Number>();
}

std::optional<Time> time_of(const Fields& fields) {
  const std::string_view bytes = text_of(fields, "time");
  if (bytes.size() != 8) return std::nullopt;
  ByteReader reader(bytes);
  const auto seconds = reader.number<std::uint32_t>();
  const auto nanoseconds = reader.number<std::uint32_t>();
  return Time{std::int64_t{1'000'000'000} * seconds + nanoseconds};
}

/// A record, and where its data lie.
struct Record {
  Operation operation{};
  Fields fields;
  std::uint64_t data = 0;  ///< offset
  std::uint64_t size = 0;
};

class BagReader {
 public:
  explicit BagReader(RandomFile file) : file_(std::move(file)) {}

  Result<Recording::Content> read() {
    if (file_.size() < kMagic.size()) return file_.damage(0, "the file is too short for a rosbag");
    std::uint64_t at = kMagic.size();
    while (at < file_.size()) {
      const std::uint64_t start = at;
      if (Status status = read_record(at); !status) {
        if (complete_ || topics_.empty()) return status.error();
        content_.remarks.push_back(
            fmt::format("it was not closed or is cut off: read up to byte {} of {} ({})", start, file_.size(),
                        status.error().message));
        break;
      }
    }
    if (Status status = check_counts(); !status) return status.error();
    if (!complete_ && content_.remarks.empty())
      content_.remarks.emplace_back("it was not closed: it has no index");
    content_.format = "rosbag 2.0";
    for (auto& [connection, topic] : topics_) content_.topics.push_back(std::move(topic));
    content_.source = std::make_unique<BlockSource>(std::move(file_), std::move(blocks_));
    return std::move(content_);
  }

 private:
  /// Reads the record at `at` and moves on to the next.
  Status read_record(std::uint64_t& at) {
    const std::uint64_t start = at;
    auto head = file_.read(at, 4);
    if (!head) return head.error();
    const auto length = ByteReader(*head).number<std::uint32_t>();
    if (length > kLongestHeader)
      return file_.damage(start, fmt::format("found a header of {} bytes, expected a record", length));
    auto header = file_.read(at + 4, std::uint64_t{length} + 4);
    if (!header) return header.error();
    const std::string_view bytes(*header);
    const std::uint64_t size = ByteReader(bytes.substr(length)).number<std::uint32_t>();
    const std::uint64_t data = at + 8 + length;
    if (size > file_.size() - data) {
      return file_.damage(
          start, fmt::format("the record has {} bytes, but the file ends at byte {}", size, file_.size()));
    }
    at = data + size;
    auto record = record_of(bytes.substr(0, length), data, size);
    if (!record) return file_.damage(start, "found no record of a rosbag");
    return take(*record, start);
  }

  static std::optional<Record> record_of(std::string_view header, std::uint64_t data, std::uint64_t size) {
    auto fields = fields_of(header);
    if (!fields) return std::nullopt;
    const auto operation = number_of<std::uint8_t>(*fields, "op");
    if (!operation || *operation < kMessage || *operation > kConnection) return std::nullopt;
    return Record{static_cast<Operation>(*operation), std::move(*fields), data, size};
  }

  Status take(const Record& record, std::uint64_t start) {
    switch (record.operation) {
      case kBagHeader:
        return take_bag_header(record, start);
      case kChunk:
        return take_chunk(record, start);
      case kChunkInfo:
        return take_chunk_info(record, start);
      case kIndexData:
        return {};
      case kMessage:
        return take_message(record, BlockSource::kNoBlock, start);
      case kConnection: {
        auto data = file_.read(record.data, record.size);
        if (!data) return data.error();
        indexed_connections_ += start >= index_ && complete_ ? 1U : 0U;
        return take_connection(record, *data, start);
      }
    }
    return {};
  }

  Status take_bag_header(const Record& record, std::uint64_t start) {
    const auto index = number_of<std::uint64_t>(record.fields, "index_pos");
    const auto chunks = number_of<std::uint32_t>(record.fields, "chunk_count");
    const auto connections = number_of<std::uint32_t>(record.fields, "conn_count");
    if (!index || !chunks || !connections || start != kMagic.size())
      return file_.damage(start, "the header of the bag is damaged");
    index_ = *index;
    chunk_count_ = *chunks;
    connection_count_ = *connections;
    complete_ = index_ > 0 && index_ <= file_.size();
    return {};
  }

  Status take_chunk(const Record& record, std::uint64_t start) {
    const auto size = number_of<std::uint32_t>(record.fields, "size");
    if (!size) return file_.damage(start, "the chunk does not say its size");
    const auto compression = compression_of(text_of(record.fields, "compression"));
    if (!compression) return file_.damage(start, compression.error().message);
    if (std::max<std::uint64_t>(*size, record.size) > kLargestBlock)
      return file_.damage(
          start, fmt::format("found a chunk of {} bytes, expected {} at most", *size, kLargestBlock));
    const Block block{record.data, record.size, *size, *compression};
    if (block.compression == Compression::none && block.size != block.content)
      return file_.damage(start,
                          fmt::format("the chunk states {} bytes and has {}", block.content, block.size));
    auto content = read_block(file_, block);
    if (!content) return content.error();
    ++chunks_;
    blocks_.push_back(block);
    return read_chunk(*content, block);
  }

  Status read_chunk(std::string_view content, const Block& block) {
    ByteReader reader(content);
    const bool plain = block.compression == Compression::none;
    const auto number = static_cast<std::uint32_t>(blocks_.size() - 1);
    while (reader.left() > 0) {
      const std::uint64_t place = block.offset + (plain ? reader.at() : 0);
      const std::string_view header = reader.counted();
      const auto size = reader.number<std::uint32_t>();
      const std::size_t data_at = reader.at();
      const std::string_view data = reader.take(size);
      auto record = reader.failed() ? std::nullopt : record_of(header, data_at, size);
      if (!record) return file_.damage(place, "found no record of a rosbag in the chunk here");
      Status status;
      if (record->operation == kConnection) {
        status = take_connection(*record, data, place);
      } else if (record->operation == kMessage) {
        if (plain) record->data += block.offset;
        status = take_message(*record, plain ? BlockSource::kNoBlock : number, place);
      } else {
        status = file_.damage(place, "found another record in a chunk, expected messages");
      }
      if (!status) return status;
    }
    return {};
  }

  Status take_connection(const Record& record, std::string_view data, std::uint64_t start) {
    const auto connection = number_of<std::uint32_t>(record.fields, "conn");
    const auto description = fields_of(data);
    const std::string_view name = text_of(record.fields, "topic");
    if (!connection || !description || name.empty() || text_of(*description, "type").empty())
      return file_.damage(start, "the description of a connection is damaged");
    const auto [known, added] = topics_.try_emplace(*connection);
    if (added) {
      known->second.name = name;
      known->second.type = text_of(*description, "type");
      known->second.encoding = "ros1";
    } else if (known->second.name != name || known->second.type != text_of(*description, "type")) {
      return file_.damage(start,
                          fmt::format("connection {} is described twice and differently", *connection));
    }
    return {};
  }

  Status take_message(const Record& record, std::uint32_t block, std::uint64_t start) {
    const auto connection = number_of<std::uint32_t>(record.fields, "conn");
    const auto time = time_of(record.fields);
    if (!connection || !time) return file_.damage(start, "the header of a message is damaged");
    const auto topic = topics_.find(*connection);
    if (topic == topics_.end())
      return file_.damage(start,
                          fmt::format("a message of connection {}, which nothing describes", *connection));
    topic->second.messages.push_back({*time, block, record.data, record.size});
    return {};
  }

  Status take_chunk_info(const Record& record, std::uint64_t start) {
    auto data = file_.read(record.data, record.size);
    if (!data) return data.error();
    ByteReader reader(*data);
    ++chunk_infos_;
    while (reader.left() > 0) {
      const auto connection = reader.number<std::uint32_t>();
      indexed_[connection] += reader.number<std::uint32_t>();
    }
    if (reader.failed()) return file_.damage(start, "the index of a chunk is damaged");
    return {};
  }

  /// A bag that was closed counts what is in it.
  Status check_counts() {
    if (!complete_) return {};
    if (chunks_ != chunk_count_ || chunk_infos_ != chunk_count_ ||
        indexed_connections_ != connection_count_) {
      return file_.damage(
          kMagic.size(),
          fmt::format("the bag states {} chunks and {} connections, found {} chunks, {} in the "
                      "index, and {} connections there",
                      chunk_count_, connection_count_, chunks_, chunk_infos_, indexed_connections_));
    }
    for (const auto& [connection, topic] : topics_) {
      if (indexed_[connection] == topic.messages.size()) continue;
      return file_.damage(index_, fmt::format("the index states {} messages of {}, found {}",
                                              indexed_[connection], topic.name, topic.messages.size()));
    }
    return {};
  }

  RandomFile file_;
  Recording::Content content_;
  std::map<std::uint32_t, Topic> topics_;  // by connection
  std::vector<Block> blocks_;
  std::map<std::uint32_t, std::uint64_t> indexed_;  // messages by connection
  std::uint64_t index_ = 0;
  std::uint32_t chunk_count_ = 0, connection_count_ = 0, chunks_ = 0, chunk_infos_ = 0,
                indexed_connections_ = 0;
  bool complete_ = false;  // it was closed, and its index is there
};

}  // namespace

Result<Recording::Content> read_bag(const std::filesystem::path& file) {
  auto opened = RandomFile::open(file);
  if (!opened) return opened.error();
  return BagReader(std::move(*opened)).read();
}

}  // namespace pade::io

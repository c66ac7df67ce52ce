// MCAP (https://mcap.dev/spec): records of a number, a length and their content; messages in chunks or not.
#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "pade/io/crc32.hpp"
#include "pade/io/recording/block_file.hpp"
#include "pade/io/recording/byte_reader.hpp"
#include "pade/io/recording/mcap_format.hpp"
#include "pade/io/text.hpp"

namespace pade::io {
namespace {

using namespace mcap;  // NOLINT: numbers of the format

constexpr std::uint64_t kHead = 9;  // number and length of a record

struct Channel {
  std::uint16_t schema = 0;
  Topic topic;
};

class McapReader {
 public:
  explicit McapReader(RandomFile file) : file_(std::move(file)) {}

  Result<Recording::Content> read() {
    auto ends = bool_of_ends();
    if (!ends) return ends.error();
    std::uint64_t at = kMagic.size();
    while (!footer_) {
      if (Status status = read_record(at); !status) {
        if (complete_ || channels_.empty()) return status.error();
        content_.remarks.push_back(
            fmt::format("it was not closed or is cut off: read up to byte {} of {} ({})", at, file_.size(),
                        status.error().message));
        break;
      }
    }
    if (footer_ && (!complete_ || at + kMagic.size() != file_.size()))
      return file_.damage(at, "found something else behind the footer, expected the end of an MCAP file");
    if (Status status = gather(); !status) return status.error();
    content_.format = "MCAP";
    content_.source = std::make_unique<BlockSource>(std::move(file_), std::move(blocks_));
    return std::move(content_);
  }

 private:
  /// Whether it begins as one; complete_ says whether it ends so as well.
  Result<bool> bool_of_ends() {
    auto head = file_.read(0, kMagic.size());
    if (!head) return head.error();
    if (*head != kMagic) return file_.damage(0, "found another beginning, expected that of an MCAP file");
    auto tail = file_.read(file_.size() - kMagic.size(), kMagic.size());
    if (!tail) return tail.error();
    complete_ = *tail == kMagic && file_.size() > kMagic.size();
    crc_.add(head->data(), head->size());
    return true;
  }

  /// Reads the record at `at` and moves on to the next.
  Status read_record(std::uint64_t& at) {
    auto head = file_.read(at, kHead);
    if (!head) return head.error();
    ByteReader reader(*head);
    const auto operation = reader.number<std::uint8_t>();
    const auto size = reader.number<std::uint64_t>();
    const std::uint64_t data = at + kHead;
    if (operation == 0) return file_.damage(at, "found the record number 0, expected a record of MCAP");
    if (size > file_.size() - data) {
      return file_.damage(
          at, fmt::format("the record has {} bytes, but the file ends at byte {}", size, file_.size()));
    }
    if (operation == kDataEnd) {
      if (Status status = check_data(at, data, size); !status) return status;
    } else if (!data_ended_) {
      crc_.add(head->data(), head->size());
      if (Status status = add_to_checksum(data, size); !status) return status;
    }
    if (Status status = take(operation, at, data, size); !status) return status;
    at = data + size;
    return {};
  }

  /// Bytes of the data section, in pieces: attachments may be large. What take() reads again is in the
  /// system's cache.
  Status add_to_checksum(std::uint64_t data, std::uint64_t size) {
    constexpr std::uint64_t kAtOnce = std::uint64_t{1} << 20;
    for (std::uint64_t done = 0; done < size; done += kAtOnce) {
      auto piece = file_.read(data + done, std::min(kAtOnce, size - done));
      if (!piece) return piece.error();
      crc_.add(piece->data(), piece->size());
    }
    return {};
  }

  Status check_data(std::uint64_t at, std::uint64_t data, std::uint64_t size) {
    auto content = file_.read(data, std::min<std::uint64_t>(size, 4));
    if (!content) return content.error();
    if (size != 4 || data_ended_) return file_.damage(at, "the end of the data is damaged");
    const auto stated = ByteReader(*content).number<std::uint32_t>();
    data_ended_ = true;
    if (stated == 0 || stated == crc_.value()) return {};
    return file_.damage(
        at, fmt::format("the data up to here have the checksum {:08x}, expected {:08x}: some of them "
                        "are damaged",
                        crc_.value(), stated));
  }

  Status take(std::uint8_t operation, std::uint64_t at, std::uint64_t data, std::uint64_t size) {
    const bool wanted = operation == kSchema || operation == kChannel || operation == kMessage ||
                        operation == kChunk || operation == kFooter || operation == kStatistics;
    if (!wanted) return {};
    if (size > kLargestBlock)
      return file_.damage(
          at, fmt::format("found a record of {} bytes, expected {} at most", size, kLargestBlock));
    auto content = file_.read(data, size);
    if (!content) return content.error();
    if (operation == kChunk) return take_chunk(*content, at, data);
    if (operation == kFooter) return take_footer(*content, at);
    if (operation == kStatistics) return take_statistics(*content, at);
    return take_plain(operation, *content, at, BlockSource::kNoBlock, data);
  }

  /// @param at  where messages about it point; `data` is its offset in block or file
  Status take_plain(std::uint8_t operation, std::string_view content, std::uint64_t at, std::uint32_t block,
                    std::uint64_t data) {
    ByteReader reader(content);
    if (operation == kSchema) {
      const auto id = reader.number<std::uint16_t>();
      const std::string_view name = reader.counted();
      if (reader.failed()) return file_.damage(at, "a schema is damaged");
      schemas_[id] = name;
    } else if (operation == kChannel) {
      Channel channel;
      const auto id = reader.number<std::uint16_t>();
      channel.schema = reader.number<std::uint16_t>();
      channel.topic.name = reader.counted();
      channel.topic.encoding = reader.counted();
      if (reader.failed()) return file_.damage(at, "a channel is damaged");
      const auto [known, added] = channels_.try_emplace(id, channel);
      if (!added &&
          (known->second.topic.name != channel.topic.name || known->second.schema != channel.schema))
        return file_.damage(at, fmt::format("channel {} is described twice and differently", id));
    } else if (operation == kMessage) {
      const auto id = reader.number<std::uint16_t>();
      reader.number<std::uint32_t>();  // sequence
      const auto time = static_cast<std::int64_t>(reader.number<std::uint64_t>());
      reader.number<std::uint64_t>();  // of publishing
      const auto channel = channels_.find(id);
      if (reader.failed() || time < 0 || time > kLastTime)
        return file_.damage(at, "the head of a message is damaged");
      if (channel == channels_.end())
        return file_.damage(at, fmt::format("a message of channel {}, which nothing describes", id));
      channel->second.topic.messages.push_back({Time{time}, block, data + reader.at(), reader.left()});
      ++messages_;
    }
    return {};
  }

  Status take_chunk(std::string_view content, std::uint64_t at, std::uint64_t data) {
    ByteReader reader(content);
    reader.take(16);  // times of the first and last message
    Block block;
    block.content = reader.number<std::uint64_t>();
    const auto crc = reader.number<std::uint32_t>();
    const std::string_view name = reader.counted();
    block.size = reader.number<std::uint64_t>();
    block.offset = data + reader.at();
    const std::string_view bytes = reader.take(block.size);
    if (reader.failed() || reader.left() > 0) return file_.damage(at, "a chunk is damaged");
    if (block.content > kLargestBlock)
      return file_.damage(
          at, fmt::format("found a chunk of {} bytes, expected {} at most", block.content, kLargestBlock));
    const auto compression = compression_of(name);
    if (!compression) return file_.damage(at, compression.error().message);
    block.compression = *compression;
    auto records = decompressed(*compression, bytes, block.content);
    if (!records) return file_.damage(at, records.error().message);
    if (crc != 0 && crc32(records->data(), records->size()) != crc)
      return file_.damage(at, "the chunk has another checksum than it states: it is damaged");
    blocks_.push_back(block);
    return read_chunk(*records, block, at);
  }

  Status read_chunk(std::string_view records, const Block& block, std::uint64_t at) {
    ByteReader reader(records);
    const bool plain = block.compression == Compression::none;
    const auto number = plain ? BlockSource::kNoBlock : static_cast<std::uint32_t>(blocks_.size() - 1);
    while (reader.left() > 0) {
      const auto operation = reader.number<std::uint8_t>();
      const auto size = reader.number<std::uint64_t>();
      const std::uint64_t data = reader.at() + (plain ? block.offset : 0);
      const std::string_view content = reader.take(size);
      const bool known = operation == kSchema || operation == kChannel || operation == kMessage;
      if (reader.failed() || (!known && operation < kOwnRecords))
        return file_.damage(at, "found no record of a message in the chunk");
      if (Status status = take_plain(operation, content, at, number, data); !status) return status;
    }
    return {};
  }

  Status take_statistics(std::string_view content, std::uint64_t at) {
    const auto count = ByteReader(content).number<std::uint64_t>();
    if (content.size() < 8) return file_.damage(at, "the statistics are damaged");
    if (count != messages_)
      return file_.damage(at, fmt::format("the file states {} messages, found {}", count, messages_));
    return {};
  }

  Status take_footer(std::string_view content, std::uint64_t at) {
    ByteReader reader(content);
    const auto summary = reader.number<std::uint64_t>();
    reader.number<std::uint64_t>();
    const auto stated = reader.number<std::uint32_t>();
    if (reader.failed() || summary > at || !data_ended_) return file_.damage(at, "the footer is damaged");
    footer_ = true;
    if (stated == 0) return {};
    const std::uint64_t from = summary == 0 ? at : summary;
    if (at - from > kLargestBlock) return file_.damage(at, "the footer is damaged");
    auto bytes = file_.read(from, at + kHead + 16 - from);
    if (!bytes) return bytes.error();
    if (crc32(bytes->data(), bytes->size()) == stated) return {};
    return file_.damage(from, "the summary has another checksum than the footer states: it is damaged");
  }

  /// The channels as topics; those of one name and type are one.
  Status gather() {
    for (auto& [id, channel] : channels_) {
      const auto schema = schemas_.find(channel.schema);
      if (schema != schemas_.end()) {
        channel.topic.type = schema->second;
      } else if (channel.schema != 0) {
        return file_.damage(
            0, fmt::format("channel {} has schema {}, which nothing describes", id, channel.schema));
      }
      content_.topics.push_back(std::move(channel.topic));
    }
    return {};
  }

  RandomFile file_;
  Recording::Content content_;
  std::map<std::uint16_t, std::string> schemas_;
  std::map<std::uint16_t, Channel> channels_;
  std::vector<Block> blocks_;
  Crc32 crc_;  // of the data section
  std::uint64_t messages_ = 0;
  bool complete_ = false;  // it ends as one that was closed
  bool data_ended_ = false;
  bool footer_ = false;
};

}  // namespace

Result<Recording::Content> read_mcap(const std::filesystem::path& file) {
  auto opened = RandomFile::open(file);
  if (!opened) return opened.error();
  return McapReader(std::move(*opened)).read();
}

}  // namespace pade::io

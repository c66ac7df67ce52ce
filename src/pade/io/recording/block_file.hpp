// A file of which parts are read, some of them compressed as a whole: what rosbag and MCAP have in common.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "pade/core/result.hpp"
#include "pade/io/recording/recording.hpp"

namespace pade::io {

/// A file open for reading at any place. Any thread.
class RandomFile {
 public:
  static Result<RandomFile> open(const std::filesystem::path& file);
  RandomFile(RandomFile&& other) noexcept;
  RandomFile& operator=(RandomFile&&) = delete;
  RandomFile(const RandomFile&) = delete;
  RandomFile& operator=(const RandomFile&) = delete;
  ~RandomFile();

  [[nodiscard]] std::uint64_t size() const { return size_; }
  [[nodiscard]] const std::string& name() const { return name_; }
  /// Error where the file has fewer than that, or cannot be read.
  [[nodiscard]] Result<std::string> read(std::uint64_t offset, std::uint64_t count) const;
  /// "FILE: byte N: WHAT", as an error.
  [[nodiscard]] Error damage(std::uint64_t at, std::string_view what) const;

 private:
  RandomFile(int handle, std::uint64_t size, std::string name)
      : handle_(handle), size_(size), name_(std::move(name)) {}
  int handle_;
  std::uint64_t size_;
  std::string name_;
};

/// How a block is compressed.
enum class Compression : std::uint8_t { none, bz2, lz4, zstd };
/// Error for a name that is none of them, or one that this program was built without.
Result<Compression> compression_of(std::string_view name);

/// Larger blocks are refused: it bounds the memory.
inline constexpr std::uint64_t kLargestBlock = 256ULL << 20;

/// What a block holds. Error where the bytes are damaged or do not make exactly `size` bytes.
Result<std::string> decompressed(Compression compression, std::string_view bytes, std::uint64_t size);

/// A part of the file that is compressed as a whole.
struct Block {
  std::uint64_t offset = 0;   ///< of its bytes in the file
  std::uint64_t size = 0;     ///< of them
  std::uint64_t content = 0;  ///< bytes that they make
  Compression compression = Compression::none;
};

/// Messages that lie in blocks, or directly in the file. The block that was read last is kept.
class BlockSource : public MessageSource {
 public:
  static constexpr std::uint32_t kNoBlock = 0xFFFFFFFF;  ///< MessagePlace::block of one that is in no block

  BlockSource(RandomFile file, std::vector<Block> blocks)
      : file_(std::move(file)), blocks_(std::move(blocks)) {}
  [[nodiscard]] Result<std::string> read(const MessagePlace& place, std::size_t most) const override;

 private:
  RandomFile file_;
  std::vector<Block> blocks_;
  mutable std::mutex mutex_;
  mutable std::uint32_t cached_ = kNoBlock;
  mutable std::string content_;
};

/// The bytes of a block.
Result<std::string> read_block(const RandomFile& file, const Block& block);

}  // namespace pade::io

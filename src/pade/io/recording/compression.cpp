// Blocks of recordings, decompressed piece by piece: never more memory than what really comes out.
#include <algorithm>
#include <memory>
#include <string>

#include <fmt/format.h>

#include "pade/io/recording/block_file.hpp"
#include "pade/io/text.hpp"

#ifdef PADE_HAS_BZIP2
#include <bzlib.h>
#endif
#ifdef PADE_HAS_LZ4
#include <lz4frame.h>
#endif
#ifdef PADE_HAS_ZSTD
#include <zstd.h>
#endif

namespace pade::io {
namespace {

constexpr std::size_t kPiece = std::size_t{1} << 18;

/// Room for the next piece, of which there is one byte more than is expected: too much is seen.
std::size_t grow(std::string& content, std::uint64_t expected) {
  const std::size_t had = content.size();
  content.resize(std::min<std::uint64_t>(had + kPiece, expected + 1));
  return content.size() - had;
}

Error wrong_size(std::size_t found, std::uint64_t expected) {
  return Error{fmt::format("the block makes {} bytes or more, expected {}", found, expected)};
}

#ifdef PADE_HAS_BZIP2
Result<std::string> from_bz2(std::string_view bytes, std::uint64_t expected) {
  bz_stream stream = {};
  if (BZ2_bzDecompressInit(&stream, 0, 0) != BZ_OK) return Error{"no memory to decompress it"};
  const std::unique_ptr<bz_stream, int (*)(bz_stream*)> owner(&stream, BZ2_bzDecompressEnd);
  stream.next_in = const_cast<char*>(bytes.data());  // NOLINT: the library does not write there
  stream.avail_in = static_cast<unsigned>(bytes.size());
  std::string content;
  int state = BZ_OK;
  while (state == BZ_OK && content.size() <= expected) {
    const std::size_t had = content.size();
    const std::size_t room = grow(content, expected);
    stream.next_out = content.data() + had;
    stream.avail_out = static_cast<unsigned>(room);
    state = BZ2_bzDecompress(&stream);
    content.resize(had + room - std::min<std::size_t>(stream.avail_out, room));
    if (state == BZ_OK && content.size() == had && stream.avail_in == 0) break;
  }
  if (state != BZ_STREAM_END && content.size() <= expected)
    return Error{fmt::format("the block compressed by bz2 is damaged (code {})", state)};
  if (content.size() != expected) return wrong_size(content.size(), expected);
  return content;
}
#endif

#ifdef PADE_HAS_LZ4
Result<std::string> from_lz4(std::string_view bytes, std::uint64_t expected) {
  LZ4F_dctx* context = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION)) != 0)
    return Error{"no memory to decompress it"};
  const std::unique_ptr<LZ4F_dctx, LZ4F_errorCode_t (*)(LZ4F_dctx*)> owner(context,
                                                                           LZ4F_freeDecompressionContext);
  std::string content;
  std::size_t hint = 1;
  while (hint != 0 && content.size() <= expected) {
    const std::size_t had = content.size();
    std::size_t room = grow(content, expected);
    std::size_t taken = bytes.size();
    hint = LZ4F_decompress(context, content.data() + had, &room, bytes.data(), &taken, nullptr);
    content.resize(had + (LZ4F_isError(hint) != 0 ? 0 : room));
    if (LZ4F_isError(hint) != 0)
      return Error{fmt::format("the block compressed by lz4 is damaged ({})", LZ4F_getErrorName(hint))};
    bytes.remove_prefix(taken);
    if (room == 0 && taken == 0) return Error{"the block compressed by lz4 is cut short"};
  }
  if (content.size() != expected) return wrong_size(content.size(), expected);
  return content;
}
#endif

#ifdef PADE_HAS_ZSTD
Result<std::string> from_zstd(std::string_view bytes, std::uint64_t expected) {
  const std::unique_ptr<ZSTD_DStream, std::size_t (*)(ZSTD_DStream*)> stream(ZSTD_createDStream(),
                                                                             ZSTD_freeDStream);
  if (stream == nullptr) return Error{"no memory to decompress it"};
  ZSTD_inBuffer in = {bytes.data(), bytes.size(), 0};
  std::string content;
  std::size_t hint = 1;
  while (hint != 0 && content.size() <= expected) {
    const std::size_t had = content.size();
    const std::size_t before = in.pos;
    const std::size_t room = grow(content, expected);
    ZSTD_outBuffer out = {content.data() + had, room, 0};
    hint = ZSTD_decompressStream(stream.get(), &out, &in);
    content.resize(had + out.pos);
    if (ZSTD_isError(hint) != 0)
      return Error{fmt::format("the block compressed by zstd is damaged ({})", ZSTD_getErrorName(hint))};
    if (out.pos == 0 && in.pos == before) return Error{"the block compressed by zstd is cut short"};
  }
  if (content.size() != expected) return wrong_size(content.size(), expected);
  return content;
}
#endif

}  // namespace

Result<Compression> compression_of(std::string_view name) {
  if (name.empty() || name == "none") return Compression::none;
#ifdef PADE_HAS_BZIP2
  if (name == "bz2") return Compression::bz2;
#endif
#ifdef PADE_HAS_LZ4
  if (name == "lz4") return Compression::lz4;
#endif
#ifdef PADE_HAS_ZSTD
  if (name == "zstd") return Compression::zstd;
#endif
  if (name == "bz2" || name == "lz4" || name == "zstd") {
    return Error{
        fmt::format("it is compressed by {}, which this build of pade cannot read (build it with lib{}-dev)",
                    name, name)};
  }
  return Error{fmt::format("found the compression {}, expected none, bz2, lz4 or zstd", in_quotes(name))};
}

Result<std::string> decompressed(Compression compression, std::string_view bytes, std::uint64_t size) {
  switch (compression) {
    case Compression::none:
      if (bytes.size() != size) return wrong_size(bytes.size(), size);
      return std::string(bytes);
#ifdef PADE_HAS_BZIP2
    case Compression::bz2:
      return from_bz2(bytes, size);
#endif
#ifdef PADE_HAS_LZ4
    case Compression::lz4:
      return from_lz4(bytes, size);
#endif
#ifdef PADE_HAS_ZSTD
    case Compression::zstd:
      return from_zstd(bytes, size);
#endif
    default:
      return Error{"it is compressed in a way that this build of pade cannot read"};
  }
}

}  // namespace pade::io

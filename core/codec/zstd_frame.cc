#include "core/codec/zstd_frame.h"

#include <zstd.h>

#include <memory>
#include <new>

#include "core/codec/bytes.h"

namespace dynmesh {
namespace {

constexpr int kLevel = 3;
constexpr size_t kFlushBytes = 16;  // what ending a block early can cost

using Context = std::unique_ptr<ZSTD_CCtx, decltype(&ZSTD_freeCCtx)>;

// Compression fails for want of memory only.
size_t OrThrow(size_t result) {
  if (ZSTD_isError(result)) throw std::bad_alloc();
  return result;
}

Context MakeContext(size_t content_bytes) {
  Context context(ZSTD_createCCtx(), &ZSTD_freeCCtx);
  if (context == nullptr) throw std::bad_alloc();
  OrThrow(ZSTD_CCtx_setParameter(context.get(), ZSTD_c_compressionLevel, kLevel));
  OrThrow(ZSTD_CCtx_setPledgedSrcSize(context.get(), content_bytes));
  return context;
}

}  // namespace

std::string CompressFrame(absl::string_view bytes) {
  std::string frame(ZSTD_compressBound(bytes.size()), '\0');
  frame.resize(OrThrow(ZSTD_compress(frame.data(), frame.size(), bytes.data(), bytes.size(), kLevel)));
  return frame;
}

std::string CompressFrameInParts(absl::string_view bytes, size_t part_bytes) {
  const Context context = MakeContext(bytes.size());
  const size_t num_parts = bytes.size() / part_bytes;
  std::string frame(ZSTD_compressBound(bytes.size()) + num_parts * kFlushBytes, '\0');
  ZSTD_outBuffer out{frame.data(), frame.size(), 0};
  for (size_t part = 0; part < num_parts; ++part) {
    ZSTD_inBuffer in{bytes.data() + part * part_bytes, part_bytes, 0};
    const ZSTD_EndDirective directive = part + 1 == num_parts ? ZSTD_e_end : ZSTD_e_flush;
    while (OrThrow(ZSTD_compressStream2(context.get(), &out, &in, directive)) != 0) {
      if (out.pos == out.size) throw std::bad_alloc();
    }
  }
  frame.resize(out.pos);
  return frame;
}

uint64_t FrameContentBytes(absl::string_view frame) {
  static_assert(ZSTD_CONTENTSIZE_UNKNOWN > uint64_t{1} << 63 && ZSTD_CONTENTSIZE_ERROR > uint64_t{1} << 63);
  return ZSTD_getFrameContentSize(frame.data(), frame.size());
}

absl::StatusOr<std::string> DecompressFrame(absl::string_view frame, uint64_t min_bytes, uint64_t max_bytes) {
  const unsigned long long claimed = ZSTD_getFrameContentSize(frame.data(), frame.size());
  if (claimed == ZSTD_CONTENTSIZE_ERROR || claimed == ZSTD_CONTENTSIZE_UNKNOWN || claimed < min_bytes ||
      claimed > max_bytes || ZSTD_findFrameCompressedSize(frame.data(), frame.size()) != frame.size()) {
    return CorruptPayload("a zstd section does not claim what the section table says");
  }
  std::string content(claimed, '\0');
  if (ZSTD_decompress(content.data(), content.size(), frame.data(), frame.size()) != claimed) {
    return CorruptPayload("a zstd section cannot be decompressed");
  }
  return content;
}

}  // namespace dynmesh

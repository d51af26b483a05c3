#include "daemon/storage/dataset/hdf5_pack.hpp"

#include <zlib.h>

#include <algorithm>

#include "classifier/base/parallel.hpp"

namespace weft::daemon::hdf5 {
namespace {

/// The first byte of all items, then the second byte, and so on.
Bytes shuffled(ByteView items, std::size_t item_bytes) {
  Bytes out(items.size());
  auto to = out.begin();
  for (std::size_t byte = 0; byte < item_bytes; ++byte)
    for (std::size_t at = byte; at < items.size(); at += item_bytes) *to++ = items[at];
  return out;
}

Bytes deflated(const Bytes& bytes, int level) {
  uLongf size = compressBound(bytes.size());
  Bytes out(size);
  if (compress2(out.data(), &size, bytes.data(), bytes.size(), level) != Z_OK) return {};
  out.resize(size);
  return out;
}

}  // namespace

std::vector<Bytes> pack_chunks(ByteView column, const ChunkLayout& layout) {
  std::vector<Bytes> out((column.size() + layout.chunk_bytes - 1) / layout.chunk_bytes);
  classifier::parallel_for(out.size(), 0, [&](std::size_t i) {
    const std::size_t at = i * layout.chunk_bytes;
    const ByteView rows = column.subspan(at, std::min(layout.chunk_bytes, column.size() - at));
    Bytes chunk(rows.begin(), rows.end());
    chunk.resize(layout.chunk_bytes);
    out[i] = deflated(shuffled(chunk, layout.item_bytes), layout.deflate_level);
  });
  return out;
}

}  // namespace weft::daemon::hdf5

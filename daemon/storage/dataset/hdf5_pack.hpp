#pragma once
// Packs the chunks of a column outside of the HDF5 library, on all cores. The bytes equal those of
// the library's own shuffle and deflate filters.

#include <cstddef>
#include <span>
#include <vector>

#include "protocols/base/bytes.hpp"

namespace weft::daemon::hdf5 {

/// How a column is divided into chunks.
struct ChunkLayout {
  std::size_t chunk_bytes = 0;  ///< unpacked; a multiple of the row size
  std::size_t item_bytes = 0;   ///< size of one number or text
  int deflate_level = 0;
};

/// Each chunk of `column`, packed; the last one is padded with zero bytes. An empty chunk: zlib
/// failed.
std::vector<Bytes> pack_chunks(ByteView column, const ChunkLayout& layout);

}  // namespace weft::daemon::hdf5

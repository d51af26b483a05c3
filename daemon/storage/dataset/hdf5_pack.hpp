#pragma once
// Chunks of a column, packed outside of the HDF5 library: on all cores, byte for byte as its own
// filters shuffle and deflate pack them.

#include <cstddef>
#include <span>
#include <vector>

#include "protocols/base/bytes.hpp"

namespace weft::daemon::hdf5 {

/// How a column lies in its chunks.
struct ChunkLayout {
  std::size_t chunk_bytes = 0;  ///< unpacked; a whole number of rows
  std::size_t item_bytes = 0;   ///< of one number or text
  int deflate_level = 0;
};

/// Each chunk of `column`, packed; the last is filled up with zero bytes. An empty one: zlib
/// failed.
std::vector<Bytes> pack_chunks(ByteView column, const ChunkLayout& layout);

}  // namespace weft::daemon::hdf5

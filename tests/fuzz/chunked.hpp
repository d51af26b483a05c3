#pragma once
// The same bytes to a splitter at once and in pieces: what it takes out of them may not depend on
// where a read() happened to end.

#include <algorithm>
#include <vector>

#include "protocols/base/bytes.hpp"
#include "tests/fuzz/target.hpp"

namespace weft::fuzz {

/// All that `splitter` finds in `bytes`, handed to it in pieces of the sizes that `sizes` says (0
/// counts as 1, the last one again and again; none: at once).
template <class Item, class Splitter>
std::vector<Item> split(Splitter& splitter, ByteView bytes, ByteView sizes) {
  std::vector<Item> found;
  Item item;
  for (std::size_t piece = 0; !bytes.empty(); ++piece) {
    const std::size_t wanted =
        sizes.empty() ? bytes.size() : std::max<std::size_t>(sizes[piece % sizes.size()], 1);
    const std::size_t size = std::min(wanted, bytes.size());
    splitter.push(bytes.first(size));
    while (splitter.next(item)) found.push_back(item);
    bytes = bytes.subspan(size);
  }
  return found;
}

/// The first bytes of an input choose the pieces, the others are the stream.
struct ChunkedInput {
  static constexpr std::size_t size_count = 4;
  ByteView sizes;
  ByteView stream;

  explicit ChunkedInput(ByteView input)
      : sizes(input.first(std::min(size_count, input.size()))),
        stream(input.subspan(sizes.size())) {}
};

}  // namespace weft::fuzz

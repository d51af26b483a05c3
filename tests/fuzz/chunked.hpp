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

/// What every splitter of numbered frames promises on any bytes. `damage_of` counts the frames that
/// it could not use, `inspect` is shown each that it gave.
template <class Splitter, class Frame, class DamageOf, class Inspect>
void try_frames(const ChunkedInput& input, const DamageOf& damage_of, const Inspect& inspect) {
  Splitter whole;
  Splitter pieces;
  const auto at_once = split<Frame>(whole, input.stream, {});
  demand(at_once == split<Frame>(pieces, input.stream, input.sizes),
         "any chunking gives the same frames");
  demand(damage_of(whole) == damage_of(pieces), "any chunking sees the same damage");
  demand(whole.skipped_bytes() == pieces.skipped_bytes(), "any chunking skips the same bytes");
  Bytes clean;
  for (const Frame& frame : at_once) {
    inspect(frame);
    append(clean, frame);
  }
  demand(clean.size() + whole.skipped_bytes() <= input.stream.size(), "no byte is counted twice");
  Splitter again;
  demand(split<Frame>(again, clean, {}) == at_once, "frames that were read are written back");
  demand(again.skipped_bytes() == 0, "what is written has no garbage");
}

}  // namespace weft::fuzz

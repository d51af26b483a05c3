#pragma once
// Gives the same bytes to a splitter at once and in pieces: its output must not depend on the ends
// of the read() calls.

#include <algorithm>
#include <vector>

#include "protocols/base/bytes.hpp"
#include "tests/fuzz/target.hpp"

namespace weft::fuzz {

/// All items that `splitter` finds in `bytes`. `sizes` are those of the pieces: 0 counts as 1, the
/// last one repeats; none: all at once.
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

/// Checks the invariants of every splitter of numbered frames on any bytes. `damage_of` counts the
/// unusable frames, `inspect` gets each usable one.
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

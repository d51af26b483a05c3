#pragma once
// Ways to hand a byte stream to a splitter.

#include <random>
#include <vector>

#include "protocols/base/bytes.hpp"

namespace weft::testing {

/// Pushes `stream` in pieces of random length up to `longest`, and takes out what comes.
template <class Splitter, class Frame>
std::vector<Frame> split_in_pieces(Splitter& splitter, ByteView stream, std::size_t longest,
                                   std::mt19937& random) {
  std::vector<Frame> frames;
  Frame frame;
  while (!stream.empty()) {
    const std::size_t piece = std::min<std::size_t>(1 + random() % longest, stream.size());
    splitter.push(stream.first(piece));
    stream = stream.subspan(piece);
    while (splitter.next(frame)) frames.push_back(frame);
  }
  return frames;
}

inline Bytes random_bytes(std::size_t count, std::mt19937& random) {
  Bytes out(count);
  for (std::uint8_t& b : out) b = static_cast<std::uint8_t>(random());
  return out;
}

}  // namespace weft::testing

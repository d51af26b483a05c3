#pragma once
// Byte streams of random frames, ways to give one to a splitter, and the invariants of every
// splitter of frames with a check value.

#include <algorithm>
#include <catch2/catch.hpp>
#include <cstdint>
#include <random>
#include <vector>

#include "protocols/base/bytes.hpp"

namespace weft::testing {

/// Pushes `stream` in pieces of random length up to `longest`, and takes the frames.
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

/// Frames, and their joined bytes.
template <class Frame>
struct FrameStream {
  Bytes bytes;
  std::vector<Frame> frames;
  std::vector<std::size_t> ends;  ///< end of each frame in `bytes`
};

/// `count` frames drawn by `make`.
template <class Frame>
FrameStream<Frame> random_stream(std::size_t count, std::mt19937& random,
                                 Frame (*make)(std::mt19937&)) {
  FrameStream<Frame> out;
  for (std::size_t i = 0; i < count; ++i) {
    out.frames.push_back(make(random));
    append(out.bytes, out.frames.back());
    out.ends.push_back(out.bytes.size());
  }
  return out;
}

/// For any chunks of a stream all its frames come out; no byte remains and none is damaged.
template <class Splitter, class Frame>
void check_any_chunking(std::mt19937& random, Frame (*make)(std::mt19937&)) {
  const FrameStream<Frame> stream = random_stream(200, random, make);
  for (const std::size_t longest : {1U, 2U, 3U, 7U, 47U, 64U, 4000U}) {
    Splitter splitter;
    CHECK(split_in_pieces<Splitter, Frame>(splitter, stream.bytes, longest, random) ==
          stream.frames);
    CHECK(splitter.skipped_bytes() == 0);
    CHECK(splitter.damaged() == 0);
  }
}

/// A flipped bit loses only its own frame. `quiet`: number of zeros after the stream, for a
/// protocol that waits for a false length.
template <class Splitter, class Frame>
void check_flipped_bit(std::mt19937& random, Frame (*make)(std::mt19937&), std::size_t quiet = 0) {
  for (int round = 0; round < 300; ++round) {
    const FrameStream<Frame> stream = random_stream(6, random, make);
    Bytes bytes = stream.bytes;
    const std::size_t at = stream.ends[0] + random() % (stream.ends[1] - stream.ends[0]);
    bytes[at] ^= static_cast<std::uint8_t>(1U << random() % 8);
    bytes.insert(bytes.end(), quiet, 0);
    Splitter splitter;
    std::vector<Frame> expected = stream.frames;
    expected.erase(expected.begin() + 1);
    CHECK(split_in_pieces<Splitter, Frame>(splitter, bytes, 500, random) == expected);
  }
}

/// A frame cut at any place is given up for the next one. Zeros follow: at least its length and
/// `quiet` (as above).
template <class Splitter, class Frame>
void check_cut_frame(std::mt19937& random, Frame (*make)(std::mt19937&), std::size_t quiet = 0) {
  const FrameStream<Frame> cut = random_stream(1, random, make);
  const FrameStream<Frame> whole = random_stream(1, random, make);
  for (std::size_t size = 0; size < cut.bytes.size(); ++size) {
    Bytes bytes(cut.bytes.begin(), cut.bytes.begin() + static_cast<std::ptrdiff_t>(size));
    bytes.insert(bytes.end(), whole.bytes.begin(), whole.bytes.end());
    bytes.insert(bytes.end(), std::max(quiet, cut.bytes.size()), 0);
    Splitter splitter;
    CHECK(split_in_pieces<Splitter, Frame>(splitter, bytes, 30, random) == whole.frames);
  }
}

/// Memory stays bounded if no frame is taken, and the excess is counted.
template <class Splitter>
void check_bounded(std::uint8_t byte) {
  Splitter splitter;
  for (int i = 0; i < 20; ++i) splitter.push(Bytes(10000, byte));
  CHECK(splitter.skipped_bytes() == 20 * 10000 - Splitter::capacity);
}

inline Bytes random_bytes(std::size_t count, std::mt19937& random) {
  Bytes out(count);
  for (std::uint8_t& b : out) b = static_cast<std::uint8_t>(random());
  return out;
}

}  // namespace weft::testing

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "protocols/base/crc.hpp"
#include "protocols/imprint/imprint.hpp"
#include "tests/unit/protocols/streams.hpp"
#include "tests/unit/protocols/vectors.hpp"

namespace imprint_test {

using namespace weft;
using namespace weft::protocols::imprint;
using weft::testing::from_hex;
using weft::testing::split_in_pieces;
using weft::testing::Vector;

namespace {

Bytes encode(const Frame& frame) {
  Bytes out;
  append(out, frame);
  return out;
}

Window window_of(const nlohmann::json& json) {
  return {json.at(0), json.at(1), json.at(2), json.at(3)};
}

Frame frame_of(const nlohmann::json& f) {
  Frame frame;
  frame.sequence = f.at("sequence");
  frame.device_us = f.at("device_us");
  const std::string kind = f.at("kind");
  if (kind == "description") {
    frame.description = {f.at("serial"),        f.at("firmware"), f.at("rows"),
                         f.at("cols"),          f.at("bits"),     f.at("spacing_um"),
                         f.at("full_scale_pa"), f.at("period_us")};
    return frame;
  }
  frame.kind = kind == "scan" ? Kind::scan : Kind::request;
  frame.window = window_of(f.at("window"));
  if (frame.kind == Kind::request) return frame;
  const std::size_t first = f.at("first"), step = f.at("step");
  for (std::size_t i = 0; i < frame.window.taxels(); ++i)
    frame.counts[i] = static_cast<std::uint8_t>((first + step * i) % 128);
  return frame;
}

Frame random_frame(std::mt19937& random) {
  const auto byte_below = [&](unsigned limit) {
    return static_cast<std::uint8_t>(random() % limit);
  };
  Frame frame;
  frame.kind = static_cast<Kind>(random() % 3);
  frame.sequence = static_cast<std::uint16_t>(random());
  frame.device_us = static_cast<std::uint32_t>(random());
  if (frame.kind == Kind::description) {
    frame.description = {
        static_cast<std::uint32_t>(random()), {1, 2, 3}, byte_below(129), byte_below(129), 7, 280,
        static_cast<std::uint32_t>(random()), 200000};
    return frame;
  }
  frame.window = {byte_below(118), byte_below(118), 0, 0};
  frame.window.rows = static_cast<std::uint8_t>(1 + byte_below(10));
  frame.window.cols = static_cast<std::uint8_t>(1 + byte_below(10));
  for (std::size_t i = 0; frame.kind == Kind::scan && i < frame.window.taxels(); ++i)
    frame.counts[i] = byte_below(128);
  return frame;
}

struct Stream {
  Bytes bytes;
  std::vector<Frame> frames;
  std::vector<std::size_t> ends;
};

Stream random_stream(std::size_t count, std::mt19937& random) {
  Stream s;
  for (std::size_t i = 0; i < count; ++i) {
    s.frames.push_back(random_frame(random));
    append(s.bytes, s.frames.back());
    s.ends.push_back(s.bytes.size());
  }
  return s;
}

/// A frame that no writer of ours makes, with right check values.
Bytes sealed(Kind kind, const Bytes& body) {
  // Both checks are over what a right frame has, so the frame is made by hand here.
  Bytes out{protocols::imprint::sync[0],
            protocols::imprint::sync[1],
            version,
            static_cast<std::uint8_t>(kind),
            static_cast<std::uint8_t>(body.size()),
            static_cast<std::uint8_t>(body.size() >> 8),
            0,
            0,
            0,
            0,
            0,
            0};
  const auto seal = [&](std::uint32_t value, int bytes) {
    for (int i = 0; i < bytes; ++i) out.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
  };
  seal(crc16_ccitt(ByteView(out).subspan(2)), 2);
  out.insert(out.end(), body.begin(), body.end());
  seal(crc32(ByteView(out).subspan(2)), 4);
  return out;
}

}  // namespace

TEST_CASE("every imprint vector decodes to its fields and encodes back to its bytes") {
  const std::vector<Vector> vectors = testing::load_vectors("imprint");
  REQUIRE(vectors.size() >= 9);
  for (const Vector& vector : vectors) {
    INFO(vector.name);
    const nlohmann::json golden = nlohmann::json::parse(vector.text);
    REQUIRE_FALSE(golden.at("source").get<std::string>().empty());
    const Frame expected = frame_of(golden.at("fields"));
    const Bytes bytes = from_hex(golden.at("hex"));
    CHECK(encode(expected) == bytes);
    Splitter splitter;
    splitter.push(bytes);
    Frame frame;
    REQUIRE(splitter.next(frame));
    CHECK(frame == expected);
    CHECK_FALSE(splitter.next(frame));
    CHECK(splitter.skipped_bytes() == 0);
  }
}

TEST_CASE("any chunking of an imprint stream gives the same frames") {
  std::mt19937 random(21);
  const Stream stream = random_stream(200, random);
  for (const std::size_t longest : {1U, 3U, 47U, 4000U}) {
    Splitter splitter;
    CHECK(split_in_pieces<Splitter, Frame>(splitter, stream.bytes, longest, random) ==
          stream.frames);
    CHECK(splitter.skipped_bytes() == 0);
    CHECK(splitter.damaged() == 0);
  }
}

TEST_CASE("a flipped bit costs one imprint frame") {
  std::mt19937 random(22);
  for (int round = 0; round < 300; ++round) {
    const Stream stream = random_stream(6, random);
    Bytes bytes = stream.bytes;
    const std::size_t at = stream.ends[0] + random() % (stream.ends[1] - stream.ends[0]);
    bytes[at] ^= static_cast<std::uint8_t>(1U << random() % 8);
    Splitter splitter;
    std::vector<Frame> expected = stream.frames;
    expected.erase(expected.begin() + 1);
    CHECK(split_in_pieces<Splitter, Frame>(splitter, bytes, 500, random) == expected);
  }
}

TEST_CASE("a cut imprint frame is given up for the ones behind it") {
  std::mt19937 random(23);
  const Frame first = random_frame(random), second = random_frame(random);
  const Bytes whole = encode(first);
  for (std::size_t cut = 0; cut < whole.size(); ++cut) {
    Bytes bytes(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(cut));
    append(bytes, second);
    bytes.insert(bytes.end(), whole.size(), 0);
    Splitter splitter;
    CHECK(split_in_pieces<Splitter, Frame>(splitter, bytes, 30, random) ==
          std::vector<Frame>{second});
  }
}

TEST_CASE("bodies that no array sends are no frames, whatever their check values say") {
  const std::pair<Kind, Bytes> bodies[] = {
      {Kind::scan, {0, 0, 1, 1, 128}},     // a count of eight bits
      {Kind::scan, {0, 0, 1, 2, 5}},       // fewer counts than the window has
      {Kind::scan, {0, 0, 1, 1, 5, 5}},    // more
      {Kind::scan, {0, 0, 0, 1, 5}},       // a window without taxels
      {Kind::scan, {127, 0, 2, 1, 5, 5}},  // beyond row 127
      {Kind::scan, {0, 255, 1, 1, 5}},     // beyond column 127
      {Kind::scan, {0, 0, 1, 1}},          // no counts
      {Kind::request, {0, 0, 129, 1}},     // more rows than there are
      {Kind::request, {0, 0, 1, 1, 0}},    // too long
      {Kind::description, Bytes(description_size - 1)},
      {static_cast<Kind>(3), {0, 0, 1, 1}},
  };
  for (const auto& [kind, body] : bodies) {
    Bytes bytes = sealed(kind, body);
    const std::size_t size = bytes.size();
    bytes.insert(bytes.end(), head_size, 0);
    Splitter splitter;
    splitter.push(bytes);
    Frame frame;
    CHECK_FALSE(splitter.next(frame));
    CHECK(splitter.damaged() == 1);
    CHECK(splitter.skipped_bytes() > size);
  }
  Splitter splitter;  // the same hand does make a right one
  splitter.push(sealed(Kind::scan, {0, 0, 1, 2, 5, 127}));
  Frame frame;
  CHECK(splitter.next(frame));
}

TEST_CASE("noise gives no imprint frames, and a splitter that nobody drains stays bounded") {
  std::mt19937 random(24);
  Splitter splitter;
  const Bytes noise = testing::random_bytes(200000, random);
  CHECK(split_in_pieces<Splitter, Frame>(splitter, noise, 1000, random).empty());
  CHECK(splitter.skipped_bytes() > 180000);
  Splitter full;
  for (int i = 0; i < 20; ++i) full.push(Bytes(10000, protocols::imprint::sync[0]));
  CHECK(full.skipped_bytes() == 20 * 10000 - Splitter::capacity);
}

}  // namespace imprint_test

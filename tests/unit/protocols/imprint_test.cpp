#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "protocols/base/bytes.hpp"
#include "protocols/imprint/imprint.hpp"
#include "tests/unit/protocols/streams.hpp"
#include "tests/unit/protocols/vectors.hpp"

namespace imprint_test {

using namespace weft;
using namespace weft::protocols::imprint;
using weft::testing::check_any_chunking;
using weft::testing::check_bounded;
using weft::testing::check_cut_frame;
using weft::testing::check_flipped_bit;
using weft::testing::hex;
using weft::testing::random_bytes;
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

/// A frame that our writers never make, with correct check values.
Bytes with_checksum(Kind kind, const Bytes& body) {
  // The checks cover the contents of a correct frame, so the frame is made by hand here.
  Bytes out{protocols::imprint::sync[0],
            protocols::imprint::sync[1],
            1,  // version
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
    const Bytes bytes = hex(golden.at("hex"));
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
  check_any_chunking<Splitter>(random, random_frame);
}

TEST_CASE("a flipped bit costs one imprint frame") {
  std::mt19937 random(22);
  check_flipped_bit<Splitter>(random, random_frame);
}

TEST_CASE("a cut imprint frame is given up for the ones behind it") {
  std::mt19937 random(23);
  check_cut_frame<Splitter>(random, random_frame);
}

TEST_CASE("bodies that no array sends are no frames, even with right check values") {
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
    Bytes bytes = with_checksum(kind, body);
    const std::size_t size = bytes.size();
    bytes.insert(bytes.end(), FrameHead::size, 0);
    Splitter splitter;
    splitter.push(bytes);
    Frame frame;
    CHECK_FALSE(splitter.next(frame));
    CHECK(splitter.damaged() == 1);
    CHECK(splitter.skipped_bytes() > size);
  }
  Splitter splitter;  // the same function makes a correct frame too
  splitter.push(with_checksum(Kind::scan, {0, 0, 1, 2, 5, 127}));
  Frame frame;
  CHECK(splitter.next(frame));
}

TEST_CASE("noise gives no imprint frames, and a splitter that is not drained stays bounded") {
  std::mt19937 random(24);
  Splitter splitter;
  const Bytes noise = testing::random_bytes(200000, random);
  CHECK(split_in_pieces<Splitter, Frame>(splitter, noise, 1000, random).empty());
  CHECK(splitter.skipped_bytes() > 180000);
  check_bounded<Splitter>(protocols::imprint::sync[0]);
}

}  // namespace imprint_test

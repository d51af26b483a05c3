#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "protocols/vibro/vibro.hpp"
#include "tests/unit/protocols/streams.hpp"
#include "tests/unit/protocols/vectors.hpp"

namespace vibro_test {

using namespace weft;
using namespace weft::protocols::vibro;
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

ChannelDescription channel_of(const nlohmann::json& json) {
  return {json.at("rate_mhz"), json.at("range_micro"), json.at("full_scale_counts"),
          json.at("block_readings")};
}

Frame frame_of(const nlohmann::json& f) {
  Frame frame;
  frame.sequence = f.at("sequence");
  frame.device_us = f.at("device_us");
  const std::string kind = f.at("kind");
  if (kind == "description") {
    frame.description = {f.at("serial"), f.at("firmware"), channel_of(f.at("acceleration")),
                         channel_of(f.at("sound"))};
    return frame;
  }
  frame.kind = kind == "sound" ? Kind::sound : Kind::acceleration;
  const auto values = f.at("values").get<std::vector<std::int16_t>>();
  frame.value_count = static_cast<std::uint16_t>(values.size());
  std::copy(values.begin(), values.end(), frame.values.begin());
  return frame;
}

ChannelDescription random_channel(std::mt19937& random) {
  return {static_cast<std::uint32_t>(random()), static_cast<std::uint32_t>(random()),
          static_cast<std::uint16_t>(random()), static_cast<std::uint16_t>(random())};
}

Frame random_frame(std::mt19937& random) {
  Frame frame;
  frame.kind = static_cast<Kind>(random() % 3);
  frame.sequence = static_cast<std::uint16_t>(random());
  frame.device_us = static_cast<std::uint32_t>(random());
  if (frame.kind == Kind::description) {
    frame.description = {static_cast<std::uint32_t>(random()),
                         {1, 2, 3},
                         random_channel(random),
                         random_channel(random)};
    return frame;
  }
  const std::size_t per_reading = values_per_reading(frame.kind);
  const std::size_t readings = 1 + random() % 60;
  frame.value_count = static_cast<std::uint16_t>(readings * per_reading);
  for (std::size_t i = 0; i < frame.value_count; ++i)
    frame.values[i] = static_cast<std::int16_t>(random());
  return frame;
}

}  // namespace

TEST_CASE("every vibro vector decodes to its fields and encodes back to its bytes") {
  const std::vector<Vector> vectors = testing::load_vectors("vibro");
  REQUIRE(vectors.size() >= 8);
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
  }
}

TEST_CASE("both channels at their usual rates fit 460800 baud twice over") {
  const auto frame_size = [](std::uint16_t body) {
    return static_cast<double>(FrameHead{0, body, 0, 0}.frame_size());
  };
  const double bytes_per_s =
      50 * (frame_size(4 * 3 * 2) + frame_size(160 * 2)) + frame_size(description_size);
  CHECK(bytes_per_s * 10 * 2 < 460800);
}

TEST_CASE("any chunking of a vibro stream gives the same frames") {
  std::mt19937 random(15);
  check_any_chunking<Splitter>(random, random_frame);
}

TEST_CASE("a flipped bit costs one vibro frame, and missing bytes block nothing") {
  std::mt19937 random(16);
  check_flipped_bit<Splitter>(random, random_frame);
}

TEST_CASE("a cut vibro frame is given up for the ones behind it") {
  std::mt19937 random(17);
  check_cut_frame<Splitter>(random, random_frame);
}

TEST_CASE("noise gives no vibro frames, and the counters show it") {
  std::mt19937 random(18);
  Splitter splitter;
  const Bytes noise = testing::random_bytes(200000, random);
  CHECK(split_in_pieces<Splitter, Frame>(splitter, noise, 1000, random).empty());
  CHECK(splitter.skipped_bytes() > 196000);
}

TEST_CASE("a head with a right check value and a body that no kind has is not a frame") {
  // kind 3; no readings; a part of a reading; too many readings; a description of another size
  const char* heads[] = {
      "D6 6D 01 03 02 00 00 00 00 00 00 00", "D6 6D 01 02 00 00 00 00 00 00 00 00",
      "D6 6D 01 01 04 00 00 00 00 00 00 00", "D6 6D 01 02 02 0C 00 00 00 00 00 00",
      "D6 6D 01 00 1F 00 00 00 00 00 00 00"};
  const char* checks[] = {"9E 2C", "1B 48", "32 6A", "D6 95", "0A 6A"};
  for (std::size_t i = 0; i < 5; ++i) {
    Bytes bytes = hex(std::string(heads[i]) + " " + checks[i]);
    bytes.insert(bytes.end(), 4000, 0);
    Splitter splitter;
    splitter.push(bytes);
    Frame frame;
    INFO(heads[i]);
    CHECK_FALSE(splitter.next(frame));
    CHECK(splitter.damaged() == 1);
    CHECK(splitter.skipped_bytes() > 3990);
  }
}

TEST_CASE("a vibro splitter that is not drained stays bounded") {
  check_bounded<Splitter>(protocols::vibro::sync[0]);
}

}  // namespace vibro_test
